"""The parameters of functions as options and arguments of commands, and what these can be given."""

import inspect
import os
import re
import types
import typing
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, Union

from .. import formats
from .._errors import InputError
from .._options import Output
from .._report import listed

NAMES = {
    "open.known": ("--mask",),
    "write.format": ("--output-format",),
    "out": ("--output", "-o"),
    "colour": ("--colour", "--color"),
    "quiet": ("--quiet", "-q"),
    "rig.output": ("--output", "-o"),
    "picture.frames": ("--frame",),
    "picture.count": ("--sheet",),
}
"""Options that are not called like their parameters, of all functions or of one."""

HEADINGS = ("input", "method", "output")


def shared(
    *, quiet: Output[bool] = False, json: Output[bool] = False, traceback: Output[bool] = False
) -> None:
    """Declares the options of all commands, which :func:`dynmesh.cli.main` obeys.

    Args:
        quiet: print only what is wrong.
        json: print the report as JSON.
        traceback: show where in the program an error arose.
    """


SHARED = frozenset(inspect.signature(shared).parameters)
"""The keys of these options."""


class Option(NamedTuple):
    """A parameter of a function as an option or an argument of a command.

    Attributes:
        function: that declares it.
        parameter: as the function declares it.
        names: of the option; none for an argument.
        heading: under which the help lists it.
        help: what the docstring of the function says of it.
    """

    function: Callable[..., Any]
    parameter: inspect.Parameter
    names: tuple[str, ...]
    heading: str
    help: str

    @property
    def key(self) -> str:
        """Its name among the parameters of the command."""
        if self.names:
            return self.names[0].removeprefix("--").replace("-", "_")
        return "output" if self.function is formats.write else self.parameter.name

    @property
    def default(self) -> Any:
        """The value if it is not given: a command replaces no file unless it is asked to."""
        return False if self.parameter.name == "overwrite" else self.parameter.default


def options_of(function: Callable[..., Any]) -> Iterator[Option]:
    """Yields the parameters of a function as options and arguments."""
    helps = _arguments_in(function.__doc__ or "")
    usual = {formats.open: "input", formats.write: "output"}.get(function, "input")
    for parameter in inspect.signature(function).parameters.values():
        if parameter.kind is parameter.VAR_KEYWORD:  # the options of another function
            continue
        name, heading, names = parameter.name, usual, tuple[str, ...]()
        if parameter.kind == parameter.KEYWORD_ONLY or parameter.default is not parameter.empty:
            names = names_of(function.__name__, name)
        if typing.get_origin(parameter.annotation) is Annotated:
            heading = typing.get_args(parameter.annotation)[1]
        yield Option(function, parameter, names, heading, helps.get(name, ""))


def names_of(function: str, name: str) -> tuple[str, ...]:
    """The names of the option that stands for an argument of a function."""
    names = NAMES.get(name, (f"--{name.replace('_', '-')}",))
    return NAMES.get(f"{function}.{name}", names)


def _arguments_in(docstring: str) -> dict[str, str]:
    """What a docstring says of each argument, in one line."""
    section = inspect.cleandoc(docstring).partition("\nArgs:\n")[2].partition("\n\n")[0]
    result = re.findall(r"^    (\w+): ((?:.*\n?)(?:^ {8}.*\n?)*)", section, re.MULTILINE)
    return {name: " ".join(text.split()) for name, text in result}


def annotation_of(option: Option) -> Any:
    """The type of a parameter and what cyclopts must know beside it."""
    from cyclopts import Group, Parameter

    hint, default = option.parameter.annotation, option.default
    if option.parameter.name == "progress":
        return Annotated[hint, Parameter(parse=False)]
    if typing.get_origin(hint) is Annotated:
        hint = typing.get_args(hint)[0]
    more: dict[str, Any] = {"help": option.help}
    if option.names:
        heading = option.heading
        more["name"] = option.names
        more["group"] = Group(heading.capitalize(), sort_key=HEADINGS.index(heading))
    if slice in members_of(hint):
        more["converter"] = lambda _, tokens: slice_of(tokens[0].value)
        more["accepts_keys"], more["n_tokens"], hint = False, 1, str | None
    if int in members_of(hint):
        more["converter"] = _whole
    if {Path, list[Path]} & {*members_of(_of_shell(hint))}:
        more["converter"] = _path
    if any(typing.get_origin(kind) is list for kind in members_of(_of_shell(hint))):
        # Up to the next option; but behind the path of a mesh, a file may follow.
        more["consume_multiple"] = option.parameter.name != "prim"
    elif str in members_of(hint):
        more["allow_leading_hyphen"] = True  # of numbers
    if bool not in members_of(hint):
        more["negative"] = ""
    if default is False:
        more["show_default"] = False
    return Annotated[_of_shell(hint), Parameter(**more)]


def _whole(hint: Any, tokens: Any) -> Any:
    """Reads a whole number, of which cyclopts rounds others, or a word."""
    from cyclopts import convert

    text = tokens[0].value
    if not (text.removeprefix("-").isdecimal() or text.isalpha()):
        raise InputError(f"must be a whole number, not {text!r}")
    return convert(hint, tokens)


def _path(hint: Any, tokens: Any) -> Any:
    """Reads a path, or several, of which pathlib takes an empty one for the current folder."""
    from cyclopts import convert

    if not all(token.value for token in tokens):
        raise InputError("is empty")
    return convert(hint, tokens)


def _of_shell(hint: Any) -> Any:
    """What a command line can give of the values of a type."""
    members = members_of(hint)
    empty = (None,) if type(None) in typing.get_args(hint) else ()
    for kind in members:
        if typing.get_origin(kind) is Iterable:
            item: Any = _of_shell(typing.get_args(kind)[0])
            return Union[list[item], *empty]
    if any(typing.get_origin(kind) is os.PathLike or kind is Path for kind in members):
        return Union[Path, *empty]
    simple = [kind for kind in members if kind in _SIMPLE or typing.get_origin(kind) is Literal]
    return Union[*(simple or members), *empty]


_SIMPLE = (int, float, bool, str)


def members_of(hint: Any) -> list[Any]:
    """The types of a union but for None, or the type alone."""
    is_union = typing.get_origin(hint) in (Union, types.UnionType)
    return (
        [kind for kind in typing.get_args(hint) if kind is not type(None)] if is_union else [hint]
    )


def in_words(hint: Any) -> str:
    """What values of a type are, in words."""
    words: list[str] = []
    for kind in members_of(hint):
        is_choice = typing.get_origin(kind) is Literal
        words += typing.get_args(kind) if is_choice else [_WORDS.get(kind, "text")]
    return listed(dict.fromkeys(words), "or")


_WORDS = {int: "a whole number", float: "a number", bool: "yes or no", Path: "a path"}


def slice_of(text: str) -> slice:
    """Parses A:B, A: or :B, or one of them with :STEP, as slices of Python."""
    parts = text.split(":")
    try:
        if not 2 <= len(parts) <= 3:
            raise ValueError
        begin, end, *step = (
            None if not part else float(part) if "." in part else int(part) for part in parts
        )
    except ValueError:
        raise InputError(f"must be two numbers of frames, as in 1001:1050, not '{text}'") from None
    return slice(begin, end, *step)
