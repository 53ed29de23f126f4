"""What several commands share: arguments, options and the checks of them."""

import functools
import inspect
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, cast

import typer

from .. import files
from ..jobs.checkpoint import Source
from ..settings import SETTINGS, Setting, Settings

format_names = files.listed(files.formats)
"""Of all formats, for people."""

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
    typer.Option(metavar="FILE", help="A file with the mesh, for an IN of positions alone."),
]
Prim = Annotated[
    str | None,
    typer.Option(metavar="PATH", help="The mesh in IN, where there are several (USD, Alembic)."),
]
MaskFile = Annotated[
    Path | None,
    typer.Option("--mask", metavar="FILE", help="The known masks, (n, k) bool in a .npy file."),
]
Seed = Annotated[int, typer.Option(help="Equal seeds give equal results.", min=0)]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace OUT if it exists.")]
FramesPerSecond = Annotated[
    float | None,
    typer.Option("--fps", metavar="RATE", help="Frames per second of OUT. [as IN says]"),
]


class Missing(StrEnum):
    """What stands for a position that was not observed, beside NaN."""

    zero = "zero"


MissingValue = Annotated[
    Missing | None,
    typer.Option("--missing", help="Positions of exactly (0, 0, 0) are missing, after frame 0."),
]


class Axis(StrEnum):
    """A coordinate axis."""

    x = "x"
    y = "y"
    z = "z"

    @property
    def vector(self) -> tuple[float, float, float]:
        """Its unit vector."""
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
    """How to read IN, as these options say."""
    return {
        "format": format,
        "faces": faces,
        "prim": prim,
        "known": mask,
        "missing": None if missing is None else "zero",
    }


def share_out(source: Source, path: Path, reference: Path) -> tuple[Source, Source]:
    """How to read a sequence and its reference: --faces and --prim are for whichever takes them.

    What neither takes stays with the sequence, whose reader refuses it.
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
    """A share as people write it: 0.3 or 30%, above 0 and below 1."""
    number = text.strip().removesuffix("%")
    in_percent = number != text.strip()
    try:
        value = float(number)
    except ValueError:
        raise typer.BadParameter(f"must be a share, as 0.3 or 30%, not '{text}'") from None
    if not 0 < value < (100 if in_percent else 1):
        limits = "0% and below 100%" if in_percent else "0 and below 1"
        advice = f"; {value:g} per cent is written {value:g}%" if 1 <= value < 100 else ""
        raise typer.BadParameter(f"must be above {limits}, not {text}{advice}")
    return value / 100 if in_percent else value


@contextmanager
def as_usage(option: str) -> Iterator[None]:
    """A value of this option that the library refuses is a wrong call."""
    try:
        yield
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint=f"'{option}'") from error
