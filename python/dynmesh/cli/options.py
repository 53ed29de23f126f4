"""Arguments, options and checks that several commands share."""

import functools
import inspect
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, cast

import typer

from .. import files
from .._errors import SettingError
from ..jobs.checkpoint import Source
from ..settings import SETTINGS, Setting, Settings

format_names = files.listed(files.formats)
"""The names of all formats, as text."""

InputPath = Annotated[
    Path,
    typer.Argument(
        metavar="IN", help="A sequence: a file, a folder, or a pattern or glob in quotes."
    ),
]
OutputPath = Annotated[Path, typer.Argument(metavar="OUT", help="The result.")]
Format = Annotated[
    str | None,
    typer.Option(
        "--format", metavar="NAME", help=f"Format of IN. [by its suffix] One of {format_names}"
    ),
]
OutputFormat = Annotated[
    str | None, typer.Option(metavar="NAME", help="Format of OUT. [by its suffix]")
]
Faces = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="A file with the mesh, if IN holds only positions."),
]
Prim = Annotated[
    str | None,
    typer.Option(metavar="PATH", help="Path of the mesh, if IN holds several (USD, Alembic)."),
]
PrimOrAll = Annotated[
    str | None,
    typer.Option(
        "--prim",
        metavar="PATH",
        help="Path of the mesh, if IN holds several (USD, Alembic), or `all` for every mesh that "
        "moves.",
    ),
]
Overlay = Annotated[
    bool,
    typer.Option(
        "--overlay",
        help="Write OUT as a USD layer over IN, which changes the completed meshes alone.",
    ),
]
MaskFile = Annotated[
    Path | None,
    typer.Option("--mask", metavar="FILE", help="The known masks, (n, k) bool in a .npy file."),
]
Seed = Annotated[int, typer.Option(help="Equal seeds give equal results.", min=0)]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace OUT if it exists.")]
FramesPerSecond = Annotated[
    float | None,
    typer.Option("--fps", metavar="RATE", help="Frames per second of OUT. [as in IN]"),
]


class Missing(StrEnum):
    """Which value, besides NaN, marks a position that was not observed."""

    zero = "zero"


MissingValue = Annotated[
    Missing | None,
    typer.Option(
        "--missing", help="Treat positions of exactly (0, 0, 0) after frame 0 as missing."
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


def with_settings(command: Callable[..., None]) -> Callable[..., None]:
    """Replaces the parameter `settings` of a command by an option for each setting."""
    signature = inspect.signature(command)
    parameters: list[inspect.Parameter] = []
    for parameter in signature.parameters.values():
        if parameter.name == "settings":
            parameters += [_option(name, setting) for name, setting in SETTINGS.items()]
        else:
            parameters.append(parameter)

    @functools.wraps(command)
    def run(**given: Any) -> None:
        settings = {name: given.pop(name) for name in SETTINGS}
        command(**given, settings=settings)

    vars(run)["__signature__"] = signature.replace(parameters=parameters)
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return run


def _option(name: str, setting: Setting) -> inspect.Parameter:
    """The option for a setting, as typer takes it."""
    flag = [f"--{name.replace('_', '-')}"] if setting.default is False else []  # without a --no-...
    option = typer.Option(*flag, help=setting.help, min=setting.least, metavar=setting.metavar)
    return inspect.Parameter(
        name,
        inspect.Parameter.POSITIONAL_OR_KEYWORD,
        default=setting.default,
        annotation=Annotated[Settings.__annotations__[name], option],
    )


def source_of(
    format: str | None,
    faces: Path | None,
    prim: str | None,
    mask: Path | None,
    missing: Missing | None,
) -> Source:
    """Collects the options that describe how to read IN."""
    return {
        "format": format,
        "faces": faces,
        "prim": prim,
        "known": mask,
        "missing": None if missing is None else "zero",
    }


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


def usage_error(error: SettingError) -> typer.BadParameter:
    """Returns the usage error of the option that stands for a refused setting."""
    option = f"'--{str(error.argument).replace('_', '-')}'"
    return typer.BadParameter(error.reason, param_hint=option)


@contextmanager
def as_usage(option: str) -> Iterator[None]:
    """Reports a value that the library refuses as a usage error of this option."""
    try:
        yield
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint=f"'{option}'") from error
