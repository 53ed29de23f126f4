"""A function as a command: its signature and docstring say all that a command line can.

Positional parameters without a default are arguments, all others options. :data:`What`,
:data:`How` and :data:`Output` around a type say under which heading the help lists the option. What
only Python can give, such as an array, a command line cannot; `progress` is set by whoever runs the
command.
"""

import functools
import inspect
import os
import types
import typing
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias, TypeVar, Union

from ._errors import InputError
from ._report import listed

T = TypeVar("T")

What: TypeAlias = Annotated[T, "what"]
How: TypeAlias = Annotated[T, "how"]
Output: TypeAlias = Annotated[T, "output"]

_NAMES = {
    "known": ("--mask",),
    "partial": ("--input",),
    "out": ("--output", "-o"),
    "colour": ("--colour", "--color"),
    "rig.output": ("--output", "-o"),
    "degrade_file.known": ("--known",),
    "picture.frames": ("--frame",),
    "picture.count": ("--sheet",),
}
"""Options that are not called like their parameters, of all functions or of one."""


def option_of(function: Callable[..., Any], parameter: str) -> str:
    """The option or the argument of a command line that stands for a parameter of a function."""
    one = inspect.signature(function).parameters.get(parameter)
    return _names(function, parameter)[0] if one is None or _is_option(one) else parameter.upper()


def _is_option(one: inspect.Parameter) -> bool:
    return one.kind == one.KEYWORD_ONLY or one.default is not one.empty


def _names(function: Callable[..., Any], parameter: str) -> tuple[str, ...]:
    usual = _NAMES.get(parameter, (f"--{parameter.replace('_', '-')}",))
    return _NAMES.get(f"{function.__name__}.{parameter}", usual)


def takes(function: Callable[..., Any], parameter: str | None) -> bool:
    """Whether a function has an option for this parameter."""
    parameters = inspect.signature(function).parameters
    source = parameters.get("source")
    of_source = () if source is None else _members(source.annotation)[0].__annotations__
    return parameter in parameters or parameter in of_source


def as_command(function: Callable[..., Any]) -> Callable[..., Any]:
    """Returns the function with a signature that says how a command line gives its arguments."""
    parameters = []
    for one in inspect.signature(function).parameters.values():
        is_option = _is_option(one)
        kind = one.KEYWORD_ONLY if is_option else one.POSITIONAL_ONLY
        names = _names(function, one.name) if is_option else None
        annotation = _annotation(one.name, names, one.annotation, one.default)
        parameters.append(one.replace(annotation=annotation, kind=kind))

    @functools.wraps(function)
    def run(*arguments: Any, **options: Any) -> Any:
        return function(*arguments, **options)

    vars(run)["__signature__"] = inspect.Signature(parameters)
    run.__annotations__ = {one.name: one.annotation for one in parameters}
    return run


def bound(function: Callable[..., Any], tokens: Sequence[str]) -> inspect.BoundArguments:
    """Binds the words of a command line to the parameters of a function.

    Raises:
        ValueError: they cannot be; the error names the parameter and the value, if there is one.
    """
    from cyclopts import App, CycloptsError

    app = App(default_command=as_command(function), help_flags=(), version_flags=())
    try:
        return app.parse_args(tokens, exit_on_error=False, print_error=False)[1]
    except CycloptsError as error:
        raise refusal(error) from None


def arguments_of(
    given: inspect.BoundArguments, folder: Path
) -> tuple[tuple[Any, ...], dict[str, Any]]:
    """The arguments and keywords that were bound, with paths relative to a folder."""

    def under(value: Any) -> Any:
        if isinstance(value, Path):
            return folder / value
        if isinstance(value, dict):
            return {name: under(one) for name, one in value.items()}
        return [under(one) for one in value] if isinstance(value, list) else value

    return tuple(map(under, given.args)), under(given.kwargs)


def refusal(error: Any) -> InputError:
    """Returns what cyclopts refuses as an error of dynmesh."""
    from cyclopts import App, CoercionError, MissingArgumentError, UnusedCliTokensError

    found = error.argument
    argument = None if found is None else [found.field_info.name, *found.keys][-1]
    if isinstance(error, CoercionError) and error.token is not None:
        value = error.token.value
        cause = error.__cause__
        told = str(cause) if cause else f"must be {_told(error.target_type)}, not {value!r}"
        return InputError(told, argument=argument, value=value)
    if isinstance(error, MissingArgumentError) and error.keyword is None:
        every = App(default_command=error.target).assemble_argument_collection(parse_docstring=True)
        what = str(next(one.parameter.help for one in every if one.field_info.name == argument))
        return InputError(f"is missing: {what.partition(';')[0]}", argument=argument)
    told = str(error)
    if isinstance(error, UnusedCliTokensError):
        first, *others = error.unused_tokens or [""]
        more = f" and {len(others)} more" if others else ""
        told = f"too many arguments: {first}{more}; put patterns in quotes and repeat options"
    return InputError(told)


def _annotation(name: str, names: tuple[str, ...] | None, hint: Any, default: Any) -> Any:
    """The type of a parameter and what cyclopts must know beside it."""
    from cyclopts import Group, Parameter

    if name == "progress":
        return Annotated[hint, Parameter(parse=False)]
    heading = "what"
    if typing.get_origin(hint) is Annotated:
        hint, heading = typing.get_args(hint)
    group = Group(heading.capitalize(), sort_key=_ORDER.index(heading))
    if name == "source":
        return Annotated[_source(_members(hint)[0]) | None, Parameter(name="*", group=group)]
    more: dict[str, Any] = {"name": names, "group": group}
    if name == "out":  # which Python can do without
        more["required"] = True
    if slice in _members(hint):
        more["converter"] = lambda _, tokens: slice_of(tokens[0].value)
        more["accepts_keys"], more["n_tokens"], hint = False, 1, str | None
    if int in _members(hint):
        more["converter"] = _whole
    if {Path, list[Path]} & {*_members(_of_shell(hint))}:
        more["converter"] = _path
    if str in _members(hint):
        more["allow_leading_hyphen"] = True  # of numbers
    if default is False or bool not in _members(hint):
        more["negative"] = ""
    if default is False:
        more["show_default"] = False
    return Annotated[_of_shell(hint), Parameter(**more)]


def _whole(hint: Any, tokens: Any) -> Any:
    """Reads a whole number, of which cyclopts rounds others, or a word."""
    from cyclopts import convert

    text = tokens[0].value
    if not (text.removeprefix("-").isdecimal() or text.isalpha()):
        raise ValueError(f"must be a whole number, not {text!r}")
    return convert(hint, tokens)


def _path(hint: Any, tokens: Any) -> Any:
    """Reads a path, or several, of which pathlib takes an empty one for the current folder."""
    from cyclopts import convert

    if not all(token.value for token in tokens):
        raise ValueError("is empty")
    return convert(hint, tokens)


_ORDER = ("what", "how", "output")


def _source(kind: Any) -> Any:
    """The keywords of reading a file, as options."""
    fields = {
        name: _annotation(name, _NAMES.get(name, (f"--{name}",)), hint, None)
        for name, hint in typing.get_type_hints(kind).items()
    }
    made: Any = typing.TypedDict("Source", fields, total=False)  # type: ignore[misc]
    made.__doc__ = kind.__doc__
    return made


def _of_shell(hint: Any) -> Any:
    """What a command line can give of the values of a type."""
    members = _members(hint)
    empty = (None,) if type(None) in typing.get_args(hint) else ()
    for one in members:
        if typing.get_origin(one) is Iterable:
            item: Any = _of_shell(typing.get_args(one)[0])
            return Union[list[item], *empty]
    if any(typing.get_origin(one) is os.PathLike or one is Path for one in members):
        return Union[Path, *empty]
    simple = [one for one in members if one in _SIMPLE or typing.get_origin(one) is Literal]
    return Union[*(simple or members), *empty]


_SIMPLE = (int, float, bool, str)


def _members(hint: Any) -> list[Any]:
    """The types of a union but for None, or the type alone."""
    is_union = typing.get_origin(hint) in (Union, types.UnionType)
    return [one for one in typing.get_args(hint) if one is not type(None)] if is_union else [hint]


def _told(hint: Any) -> str:
    """What values of a type are, in words."""
    words: list[str] = []
    for one in _members(hint):
        is_choice = typing.get_origin(one) is Literal
        words += typing.get_args(one) if is_choice else [_WORDS.get(one, "text")]
    return listed(dict.fromkeys(words), "or")


_WORDS = {int: "a whole number", float: "a number", bool: "yes or no", Path: "a path"}


def slice_of(text: str) -> slice:
    """Parses A:B, A: or :B, or one of them with :STEP, as slices of Python.

    Raises:
        ValueError: it is none of these.
    """
    parts = text.split(":")
    try:
        if not 2 <= len(parts) <= 3:
            raise ValueError
        begin, end, *step = (
            None if not part else float(part) if "." in part else int(part) for part in parts
        )
    except ValueError:
        raise ValueError(f"must be two numbers of frames, as in 1001:1050, not '{text}'") from None
    return slice(begin, end, *step)
