"""A verb as a command: the signatures and docstrings of functions say all that it takes.

Parameters without a default are arguments, all others options. What only Python can give, such as
an array, a command line cannot; `progress` is set by whoever runs the command.
"""

import contextlib
import inspect
import os
import re
import types
import typing
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, Union

from .. import formats
from .._errors import InputError
from .._options import Output
from .._report import DoubtfulWarning, listed
from ..frame import Frames
from ..scans import ScanRun, ScanSource, open_scans
from ..verbs.convert import convert_clouds
from .beside import BESIDE, checked, filled, overwrite

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


class Command:
    """A verb, joined with opening and writing.

    A verb of a `sequence` that returns frames has the options of :func:`dynmesh.open`, as has one
    with a `source`; frames that a verb returns are written, with the options of
    :func:`dynmesh.write`, and then what else can be made of its report. Called with the values of
    the options, it returns a report.
    """

    def __init__(self, verb: Callable[..., Any]) -> None:
        self._verb = verb
        self.__name__ = verb.__name__
        returned = inspect.signature(verb).return_annotation
        kinds = [typing.get_origin(kind) or kind for kind in members_of(returned)]
        self._writes = any(isinstance(kind, type) and issubclass(kind, Frames) for kind in kinds)
        own = [*options_of(verb)]
        self._reads = self._writes and own[0].parameter.name == "sequence"
        takes_source = any(option.parameter.name == "source" for option in own)
        every = [option for option in own if option.parameter.name != "source"]
        if self._reads or takes_source:  # the faces are those of the file
            every = [option for option in every if option.parameter.name != "faces"]
        if self._reads:
            del every[0]
        if any(p.kind is p.VAR_KEYWORD for p in inspect.signature(verb).parameters.values()):
            of_scans = ScanSource.__annotations__
            every += [o for o in options_of(open_scans) if o.parameter.name in of_scans]
        if self._reads or takes_source:
            every += [o for o in options_of(formats.open) if o.names or self._reads]
        if self._writes:
            of_write = options_of(formats.write)
            every += [o for o in of_write if o.parameter.name not in ("frames", "faces")]
        for one in (beside := BESIDE.get(self.__name__, [])):
            names = names_of(self.__name__, one.key)
            every.append(Option(filled, one.parameter, names, "output", one.help))
        if beside and not self._writes:
            every += options_of(overwrite)
        every += options_of(shared)
        every.sort(
            key=lambda each: (bool(each.names), not each.names and each.function is formats.write)
        )
        self.options: dict[str, list[Option]] = {}
        for option in every:
            self.options.setdefault(option.key, []).append(option)
        self.takes_source = takes_source
        parameters = [self._parameter(key, self._told(key)) for key in self.options]
        vars(self)["__signature__"] = inspect.Signature(parameters)
        self.__annotations__ = {each.name: each.annotation for each in parameters}

    def _told(self, key: str) -> Option:
        """The option whose help and default a command shows: that of the verb, if it has one."""
        options = self.options[key]
        return next((one for one in options if one.function is self._verb), options[-1])

    def _parameter(self, key: str, option: Option) -> inspect.Parameter:
        kind = inspect.Parameter.KEYWORD_ONLY if option.names else inspect.Parameter.POSITIONAL_ONLY
        annotation = annotation_of(option._replace(help=self.spelt(option.help)))
        return inspect.Parameter(key, kind, default=option.default, annotation=annotation)

    def option_of(self, argument: str) -> str | None:
        """The option or the argument of the command that stands for an argument of a function."""
        every = [option for options in self.options.values() for option in options]
        for option in sorted(every, key=lambda option: option.function is not self._verb):
            if argument in (option.parameter.name, option.key):
                return option.names[0] if option.names else option.key.upper()
        return None

    def spelt(self, text: str) -> str:
        """Names arguments of functions, which texts mark as in `threads`, as options."""

        def option(match: re.Match[str]) -> str:
            return self.option_of(match[1]) or names_of("", match[1])[0]

        return re.sub(r"`(\w+)`", option, text)

    def __call__(self, *arguments: Any, **keywords: Any) -> Any:
        """Runs the verb, between opening and writing."""
        values = inspect.signature(self).bind(*arguments, **keywords).arguments

        def of(*functions: Callable[..., Any]) -> dict[str, Any]:
            return {
                option.parameter.name: values[key]
                for key, options in self.options.items()
                for option in options
                if key in values and option.function in functions
            }

        own, opening, writing = of(self._verb, open_scans), of(formats.open), of(formats.write)
        for name in own.keys() & opening.keys() & {"least_confidence", "gaps"}:
            del (own if own.get("scans") is None else opening)[name]  # of scans, if there are any
        asked, replaces = of(filled), bool(values.get("overwrite"))
        wanted = checked(self.__name__, asked, replaces)
        if not self._writes:
            result = self._verb(**own, **({"source": opening} if self.takes_source else {}))
            return filled(result, wanted, replaces)
        output = writing.pop("path")
        writing["overwrite"] = replaces
        if self.__name__ != "degrade" or not (own.get("scan") or own.get("depth")):
            formats.check_format(output, writing.get("format"))
        with contextlib.ExitStack() as stack:
            stack.enter_context(warnings.catch_warnings())
            warnings.simplefilter("ignore", DoubtfulWarning)  # the report says it
            result = stack.enter_context(self._result(stack, own, opening))
            if isinstance(result, ScanRun):
                format = writing.pop("format", None)
                _refuse_for_scans({**writing, "overwrite": None, "output_format": format})
                return result.write(output, overwrite=replaces)
            written = formats.write(output, result, **writing)
            if wanted:
                filled(written.report, wanted, replaces)
            return written

    def _result(
        self, stack: contextlib.ExitStack, own: dict[str, Any], opening: dict[str, Any]
    ) -> Any:
        if not self._reads:
            return self._verb(**own)
        path = opening.pop("path")
        if self.__name__ == "convert":
            clouds = convert_clouds(path, opening.get("gaps", "refuse"), **own)
            if clouds is not None:
                _refuse_for_scans({**opening, "gaps": None})
                return clouds
        opened = formats.opened(path, "path", formats.Shared(own.get("template")), **opening)
        return self._verb(stack.enter_context(opened), **own)


def _refuse_for_scans(given: Mapping[str, Any]) -> None:
    """Refuses what is asked of files of frames alone."""
    for name, value in given.items():
        if value not in (None, "ply"):
            raise InputError("is for sequences, not for scans", argument=name, value=value)


def refusal(error: Any, tokens: list[str]) -> InputError:
    """Returns what cyclopts refuses of a command line as an error of dynmesh."""
    from cyclopts import (
        CoercionError,
        MissingArgumentError,
        UnknownOptionError,
        UnusedCliTokensError,
    )

    result = error.argument
    argument = None if result is None else [result.field_info.name, *result.keys][-1]
    if isinstance(error, CoercionError) and error.token is not None:
        value = error.token.value
        cause = error.__cause__
        message = str(cause) if cause else f"must be {in_words(error.target_type)}, not {value!r}"
        return InputError(message, argument=argument, value=value)
    if isinstance(error, MissingArgumentError) and error.keyword is None:
        command: Any = error.target
        what = command.spelt(command.options[argument][-1].help)
        return InputError(f"is missing: {what.partition(';')[0]}", argument=argument)
    message = str(error)
    if isinstance(error, UnusedCliTokensError):
        first, *others = error.unused_tokens or [""]
        more = f" and {len(others)} more" if others else ""
        message = f"too many arguments: {first}{more}; put patterns in quotes"
        if first in ("true", "false", "yes", "no"):
            message = (
                f"too many arguments: {first}; the value of a flag follows =, as in --json={first}"
            )
    if isinstance(error, UnknownOptionError):
        name = error.token.keyword or error.token.value
        if "--" in tokens and name in tokens[tokens.index("--") :]:
            message = f"too many arguments: {name}; options stand before --"
    return InputError(message)
