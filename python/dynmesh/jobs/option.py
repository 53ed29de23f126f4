"""How the options of jobs are given: in the shell, in tables, and as keywords of functions."""

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields
from inspect import signature
from pathlib import Path
from typing import Any, Literal, TypeAlias, TypeVar

from .._checks import check_path
from .._errors import InputError, KindError
from ..files import PathLike, Source
from ..files.units import UNITS
from ..settings import SETTINGS, Function, Settings, default_settings, with_keywords

Kind = TypeVar("Kind")

WHAT, HOW, FILES, OUTPUT = "What to complete", "How to complete", "Files", "Output"
ROOM = "Rooms"
"""Headings in the help of commands."""

Start: TypeAlias = int | Literal["auto", "whole", "best", "clean"]
"""The frame from which completion starts: see :func:`dynmesh.complete_file`."""

STARTS: tuple[Literal["auto", "whole", "best", "clean"], ...] = ("auto", "whole", "best", "clean")
"""The names among them."""


TrainingFiles: TypeAlias = PathLike | Iterable[PathLike]
"""The path of a training file, or those of several."""

_EXPECTED = "a path or a list of paths"


@dataclass(frozen=True)
class Option:
    """How users give a value in the shell and in tables of jobs.

    Attributes:
        help: what it does, in a sentence or two for the command line.
        group: its heading in the help of commands.
        kind: of its values; None is a value too if it is the default.
        several: whether it is a list of such values.
        name: in commands and tables, where it is not that of the field.
        flags: of the command line, where they do not follow from the name.
        metavar: what the command line calls a value.
        choices: all values, if there are few.
        least: the smallest value of an integer.
        parse: what reads a value from text, if its kind does not say that. A ValueError says why it
            cannot.
        default: the value if none is given; `dataclasses.MISSING` if one must be given.
    """

    help: str
    group: str
    kind: Any = str
    several: bool = False
    name: str = ""
    flags: tuple[str, ...] = ()
    metavar: str = ""
    choices: tuple[str, ...] = ()
    least: int | None = None
    parse: Callable[[str], Any] | None = None
    default: Any = None


def start_of(text: str) -> Start:
    """Parses the frame at which completion starts: a number or a name.

    Raises:
        ValueError: it is neither.
    """
    for name in STARTS:
        if text == name:
            return name
    if not text.removeprefix("-").isdecimal():
        raise ValueError(f"must be {', '.join(STARTS)} or the number of a frame, not '{text}'")
    return int(text)


UNIT_NAMES = f"{', '.join(UNITS)}, or a number of metres"
"""What names a unit of length, as text."""


def unit_of(text: str) -> str | float:
    """Parses a unit of length: a number of metres, or else a name, which may be unknown."""
    try:
        return float(text)
    except ValueError:
        return text


SOURCE: dict[str, Option] = {
    "format": Option("The format of IN, if its suffix does not tell.", FILES, metavar="NAME"),
    "faces": Option(
        "A file with the faces, if IN holds only positions.", FILES, Path, metavar="FILE"
    ),
    "prim": Option("Which mesh, if IN holds several (USD, Alembic).", FILES, metavar="PATH"),
    "known": Option(
        "Which vertices are known: bool (n, k) in a .npy file.",
        FILES,
        Path,
        name="mask",
        metavar="FILE",
    ),
    "missing": Option(
        "Vertices at exactly (0, 0, 0) after frame 0 are missing.", FILES, choices=("zero",)
    ),
    "gaps": Option(
        "Frames whose file is missing: an error, or frames in which nothing was observed.",
        FILES,
        metavar="refuse|lost",
        choices=("refuse", "lost"),
        default="refuse",
    ),
}
"""The options of a command that reads a sequence; the keywords of :class:`Source`."""

TRAINING = Option(
    "Learn from this file how the mesh varies: complete frames of the same mesh, such as a "
    "range-of-motion recording. May be repeated.",
    f"{HOW}: method detail",
    Path,
    several=True,
    metavar="FILE",
)
OUTPUT_FORMAT = Option("The format of OUT, if its suffix does not tell.", OUTPUT, metavar="NAME")

_OF_SETTINGS = {
    name: Option(
        row.help,
        HOW if row.method is None else f"{HOW}: method {row.method}",
        row.kind,
        metavar="" if row.choices else row.metavar,
        choices=tuple(row.choices),
        least=row.least,
        default=row.default,
    )
    for name, row in SETTINGS.items()
}


def options_of(kind: type[Any]) -> dict[str, Option]:
    """The options that commands and tables offer for a class of options, by name."""
    found: dict[str, Option] = {}
    for one in fields(kind):
        if one.name == "settings":
            found |= _OF_SETTINGS
        elif "source" in one.metadata:
            found |= one.metadata["source"]
        elif "option" in one.metadata:
            found[one.name] = one.metadata["option"]
    return found


def grouped(values: Mapping[str, Any]) -> dict[str, Any]:
    """The fields of :class:`CompletionOptions` for values by the names of :func:`options_of`."""
    own = {name: value for name, value in values.items() if name not in {**SETTINGS, **SOURCE}}
    own["settings"] = {name: values[name] for name in SETTINGS if name in values}
    own["source"] = {name: values[name] for name in SOURCE if name in values}
    return own


def takes(kind: type[Any], *without: str) -> Callable[[Function], Function]:
    """Shows the options of a function with ``**options`` as keywords, with their defaults."""
    own = [one for one in fields(kind) if one.name not in ("settings", *without)]
    keywords = {one.name: None if one.name == "source" else one.default for one in own}
    types = {one.name: Source | None if one.name == "source" else one.type for one in own}
    if len(own) < len(fields(kind)):
        keywords |= default_settings
        types |= Settings.__annotations__
    return lambda function: with_keywords(function, keywords, types)


def made_of(kind: Callable[..., Kind], options: Mapping[str, object]) -> Kind:
    """The options for the keywords of a function.

    Raises:
        TypeError: a keyword is unknown or missing. The error does not name the kind, which is no
            concern of users.
    """
    signature(kind).bind(**options)
    return kind(**options)


def paths_of(training: TrainingFiles | None) -> tuple[Path, ...]:
    """Returns the paths of the training files; none for None.

    Raises:
        TypeError, ValueError: they are not paths, or there are none.
    """
    if training is None:
        return ()
    if isinstance(training, str | os.PathLike):
        training = (training,)
    elif not isinstance(training, Iterable):
        raise KindError(f"must be {_EXPECTED}, not {training!r}", argument="training")
    training_files = list(training)
    for training_file in training_files:
        check_path("training", training_file, _EXPECTED)
    if not training_files:
        raise InputError("names no file; leave it out if there is none", argument="training")
    return tuple(map(Path, training_files))


def given(default: Any, help: str, group: str, kind: Any = str, **more: Any) -> Any:
    """The field of a dataclass for an option; the arguments are those of :class:`Option`."""
    return offered(Option(help, group, kind, default=default, **more))


def offered(option: Option) -> Any:
    """The field of a dataclass for this option."""
    return field(default=option.default, metadata={"option": option})
