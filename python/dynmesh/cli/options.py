"""Arguments, options and checks that several commands share."""

import functools
import inspect
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, cast

import typer

from .. import files
from .._errors import SettingError
from ..jobs.checkpoint import Source
from ..settings import SETTINGS, Settings, default_settings

format_names = files.listed(files.formats)
"""The names of all formats, as text."""

WHAT, HOW, FILES, OUTPUT = "What to complete", "How to complete", "Files", "Output"
"""Headings in the help of several commands; options without a heading are under Options."""

UNIT = "m, cm, mm, or a number of metres"


def _formats() -> list[str]:
    return list(files.formats)


InputPath = Annotated[
    Path,
    typer.Argument(
        metavar="IN", help="A sequence: a file, a folder, or a pattern in quotes ('*.ply')."
    ),
]
OutputPath = Annotated[Path, typer.Argument(metavar="OUT", help="The result.")]
Format = Annotated[
    str | None,
    typer.Option(
        "--format",
        metavar="NAME",
        autocompletion=_formats,
        help="The format of IN, if its suffix does not tell.",
        rich_help_panel=FILES,
    ),
]
ScanUnit = Annotated[
    str | None,
    typer.Option(
        metavar="UNIT",
        help=f"Unit of length of SCANS: {UNIT}. [as their files state, else as the mesh]",
        rich_help_panel=FILES,
    ),
]
OutputFormat = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        autocompletion=_formats,
        help="The format of OUT, if its suffix does not tell.",
        rich_help_panel=OUTPUT,
    ),
]
Faces = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="A file with the faces, if IN holds only positions.",
        rich_help_panel=FILES,
    ),
]
Prim = Annotated[
    str | None,
    typer.Option(
        metavar="PATH",
        help="Which mesh, if IN holds several (USD, Alembic).",
        rich_help_panel=FILES,
    ),
]
PrimOrAll = Annotated[
    str | None,
    typer.Option(
        "--prim",
        metavar="PATH",
        help="Which mesh, if IN holds several (USD, Alembic), or all for every mesh that moves.",
        rich_help_panel=WHAT,
    ),
]
Overlay = Annotated[
    bool,
    typer.Option(
        "--overlay",
        help="Write OUT as a USD layer over IN, which changes the completed meshes alone.",
        rich_help_panel=OUTPUT,
    ),
]
MaskFile = Annotated[
    Path | None,
    typer.Option(
        "--mask",
        metavar="FILE",
        help="Which vertices are known: bool (n, k) in a .npy file.",
        rich_help_panel=FILES,
    ),
]
Seed = Annotated[int, typer.Option(metavar="N", help="Equal seeds give equal results.", min=0)]
Overwrite = Annotated[
    bool, typer.Option("--overwrite", help="Replace OUT if it exists.", rich_help_panel=OUTPUT)
]
DropAbove = Annotated[
    float | None,
    typer.Option(
        "--drop-above",
        metavar="DISTANCE",
        help="Leave vertices missing whose standard error exceeds this, in the unit of IN. Implies "
        "--uncertainty.",
        rich_help_panel=OUTPUT,
    ),
]
Resume = Annotated[
    bool,
    typer.Option(
        "--resume",
        help="Continue an interrupted run with the same input and options. If OUT is already "
        "complete, do nothing. It is then checked only for the numbers of frames and vertices, the "
        "faces, fps if both state it, and the presence of provenance, standard errors and dropped "
        "vertices.",
        rich_help_panel=OUTPUT,
    ),
]
FramesPerSecond = Annotated[
    float | None,
    typer.Option(
        "--fps",
        metavar="RATE",
        help="Frames per second of OUT. [as in IN]",
        rich_help_panel=OUTPUT,
    ),
]


Training = Annotated[
    list[Path] | None,
    typer.Option(
        "--training",
        metavar="FILE",
        help="Learn from this file how the mesh varies: complete frames of the same mesh, such as "
        "a range-of-motion recording. May be repeated.",
        rich_help_panel=f"{HOW}: method detail",
    ),
]


class Missing(StrEnum):
    """Which value, besides NaN, marks a position that was not observed."""

    zero = "zero"


MissingValue = Annotated[
    Missing | None,
    typer.Option(
        "--missing",
        help="Vertices at exactly (0, 0, 0) after frame 0 are missing.",
        rich_help_panel=FILES,
    ),
]


class WithGaps(StrEnum):
    """What becomes of frames whose file is missing."""

    refuse = "refuse"
    lost = "lost"


GapsOption = Annotated[
    WithGaps,
    typer.Option(
        "--gaps",
        metavar="refuse|lost",
        help="Frames whose file is missing: an error, or frames in which nothing was observed.",
        rich_help_panel=FILES,
    ),
]


class Axis(StrEnum):
    """A coordinate axis."""

    x = "x"
    y = "y"
    z = "z"

    @property
    def vector(self) -> tuple[float, float, float]:
        """The unit vector along the axis."""
        return float(self == Axis.x), float(self == Axis.y), float(self == Axis.z)


def source_of(
    *,
    format: Format = None,
    faces: Faces = None,
    prim: Prim = None,
    mask: MaskFile = None,
    missing: MissingValue = None,
    gaps: GapsOption = WithGaps.refuse,
) -> Source:
    """Collects the options that describe how to read IN."""
    return {
        "format": format,
        "faces": faces,
        "prim": prim,
        "known": mask,
        "missing": None if missing is None else "zero",
        "gaps": "lost" if gaps == WithGaps.lost else "refuse",
    }


def with_source(
    command: Callable[..., None] | None = None, *, prim: Any = Prim
) -> Callable[..., Any]:
    """Replaces the parameter `source` of a command by the options of :func:`source_of`."""
    if command is None:
        return functools.partial(with_source, prim=prim)
    options = dict(inspect.signature(source_of).parameters)
    options["prim"] = options["prim"].replace(annotation=prim)
    return _replaced(command, "source", options, source_of)


def with_settings(command: Callable[..., None]) -> Callable[..., None]:
    """Replaces the parameter `settings` of a command by an option for each setting."""
    options = {name: _option(name, default) for name, default in default_settings.items()}
    return _replaced(command, "settings", options, dict)


def _replaced(
    command: Callable[..., None],
    name: str,
    options: Mapping[str, inspect.Parameter],
    collect: Callable[..., Any],
) -> Callable[..., None]:
    """The command with `options`, which `collect` makes into its parameter `name`."""
    signature = inspect.signature(command)
    parameters: list[inspect.Parameter] = []
    for parameter in signature.parameters.values():
        parameters += options.values() if parameter.name == name else [parameter]

    @functools.wraps(command)
    def run(**given: Any) -> None:
        collected = collect(**{option: given.pop(option) for option in options})
        command(**given, **{name: collected})

    vars(run)["__signature__"] = signature.replace(parameters=parameters)
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return run


def _option(name: str, default: object) -> inspect.Parameter:
    """The option for a setting, as typer takes it."""
    setting = SETTINGS[name]
    flag = [f"--{name.replace('_', '-')}"] if setting.default is False else []  # without a --no-...
    option = typer.Option(
        *flag,
        help=setting.help,
        min=setting.least,
        metavar=None if setting.choices else setting.metavar or None,
        rich_help_panel=HOW if setting.method is None else f"{HOW}: method {setting.method}",
    )
    return inspect.Parameter(
        name,
        inspect.Parameter.KEYWORD_ONLY,
        default=default,
        annotation=Annotated[Settings.__annotations__[name], option],
    )


def share_out(source: Source, path: Path, reference: Path) -> tuple[Source, Source]:
    """Assigns --faces and --prim to the sequence, its reference or both, by their formats.

    An option that neither format supports is passed to the sequence, whose reader refuses it.
    """
    ours, theirs = files.format_of(path, source.get("format")), files.format_of(reference)
    kept = {
        name: value
        for name, value in source.items()
        if name in ours.takes or name not in theirs.takes
    }
    lent = {name: source.get(name) for name in theirs.takes}
    return (
        cast(Source, {**kept, "format": ours.name}),
        cast(Source, {**lent, "format": theirs.name}),
    )


def share(text: str) -> float:
    """Parses a share above 0 and below 1, such as 0.3 or 30%."""
    number = text.strip().removesuffix("%")
    in_percent = number != text.strip()
    try:
        value = float(number)
    except ValueError:
        raise typer.BadParameter(f"must be a share such as 0.3 or 30%, not '{text}'") from None
    if not 0 < value < (100 if in_percent else 1):
        limits = "0% and below 100%" if in_percent else "0 and below 1"
        advice = f"; for {value:g} per cent, write {value:g}%" if 1 <= value < 100 else ""
        raise typer.BadParameter(f"must be above {limits}, not {text}{advice}")
    return value / 100 if in_percent else value


def usage_error(error: SettingError, settings: Settings) -> typer.BadParameter:
    """Returns the usage error of the option that stands for a refused setting."""
    name = str(error.argument)
    method = "detail" if name in ("training", "drop_above") else None
    method = SETTINGS[name].method if name in SETTINGS else method
    other = method is not None and method != settings["method"]
    reason = f"requires --method {method}" if other else error.reason
    negation = "no-" if settings.get(name) is False else ""
    return typer.BadParameter(reason, param_hint=f"'--{negation}{name.replace('_', '-')}'")


@contextmanager
def as_usage(option: str) -> Iterator[None]:
    """Reports a value that the library refuses as a usage error of this option."""
    try:
        yield
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint=f"'{option}'") from error


def as_unit(text: str | None) -> str | float | None:
    """Returns a number of metres where one is written."""
    try:
        return None if text is None else float(text)
    except ValueError:
        return text
