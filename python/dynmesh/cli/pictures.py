"""The commands that show a sequence."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Annotated, cast

import typer

from .. import files
from ..draw.heatmap import likely_up, stated_up
from ..draw.quantities import Colour, Range
from ..files import Reader
from ..files.lock import unfinished_folder, working_folder
from ..files.scans import open_scans
from ..jobs.checkpoint import Source
from .options import (
    OUTPUT,
    Axis,
    InputPath,
    Overwrite,
    ScanUnit,
    as_unit,
    share_out,
    with_source,
)
from .terminal import say, say_remarks, track
from .zeros import Zeros

_SHOWN = "What to show"

Reference = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        help="The true sequence; colours then show the error, in mm if a file states its unit, "
        "else in % of the bounding-box diagonal.",
        rich_help_panel=_SHOWN,
    ),
]
ColourOption = Annotated[
    Colour | None,
    typer.Option(
        "--colour",
        "--color",
        metavar="NAME",
        help="error, generation, age, standard_error, known or plain. [the first that IN holds]",
        rich_help_panel=_SHOWN,
    ),
]
RangeOption = Annotated[
    Range | None,
    typer.Option(
        "--range",
        metavar="LOW HIGH",
        help="The ends of the colour scale, in its unit: linear from 0, else logarithmic.",
        rich_help_panel=_SHOWN,
    ),
]
Title = Annotated[
    str | None,
    typer.Option(metavar="TEXT", help="The heading. [the name of IN]", rich_help_panel=_SHOWN),
]
Up = Annotated[
    Axis | None,
    typer.Option(
        help="The up axis. [as in IN; else y, or z for a flat sheet]", rich_help_panel=_SHOWN
    ),
]
Azimuth = Annotated[
    float,
    typer.Option(
        metavar="DEGREES", help="View from this angle around the up axis.", rich_help_panel=_SHOWN
    ),
]


@with_source
def view(
    path: InputPath,
    *,
    output: Annotated[
        Path,
        typer.Option(
            "--output", "-o", metavar="PAGE", help="An HTML file.", rich_help_panel=OUTPUT
        ),
    ],
    reference: Reference = None,
    given: Annotated[
        Path | None,
        typer.Option(
            "--input",
            metavar="FILE",
            help="The sequence that was completed, to show beside IN; "
            "--mask, --missing and --gaps then describe it.",
            rich_help_panel=_SHOWN,
        ),
    ] = None,
    scans: Annotated[
        Path | None,
        typer.Option(
            metavar="SCANS",
            help="The scans that IN was tracked in, to show beside it.",
            rich_help_panel=_SHOWN,
        ),
    ] = None,
    cameras: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Where the cameras of the scans stand. [cameras.json beside SCANS]",
            rich_help_panel=_SHOWN,
        ),
    ] = None,
    scan_unit: ScanUnit = None,
    colour: ColourOption = None,
    range: RangeOption = None,
    title: Title = None,
    up: Up = None,
    azimuth: Azimuth = 60.0,
    max_frames: Annotated[
        int,
        typer.Option(
            metavar="N", min=1, help="About this many frames at most.", rich_help_panel=_SHOWN
        ),
    ] = 120,
    max_vertices: Annotated[
        int,
        typer.Option(
            metavar="N",
            min=4,
            help="Simplify a mesh that has more vertices.",
            rich_help_panel=_SHOWN,
        ),
    ] = 20_000,
    overwrite: Overwrite = False,
    source: Source,
) -> None:
    """Write a page that plays a sequence in any browser, offline.

    The input and the reference play beside it. In the page, ? lists the keys. Examples:

    ```text
    dynmesh view completed.npz -o page.html
    dynmesh view completed.npz --input partial.npz --reference truth.npz -o errors.html
    dynmesh view tracked.npz --scans scans --reference truth.npz -o tracked.html
    ```
    """
    from ..draw.page import view as write

    zeros = Zeros()
    with (
        _opened(path, source, reference=reference, given=given) as (reader, truth, partial),
        new_output(output, overwrite, ".html") as made,
    ):
        shown = write(
            reader,
            made,
            reference=truth,
            input=partial,
            scans=None if scans is None else open_scans(scans, cameras=cameras, gaps="lost"),
            scan_unit=as_unit(scan_unit),
            colour=colour,
            range=range,
            title=title,
            up=None if up is None else up.value,
            azimuth=azimuth,
            max_frames=max_frames,
            max_vertices=max_vertices,
            watch=lambda frames, n: track(zeros.watch_shown(frames), n, "reading"),
        )
        _say_if_guessed(up, reader, truth, partial)
    say(f"{output}: open it in a browser" + (f"; it shows {shown}" if str(shown) else ""))
    zeros.say_if_many()


@with_source
def picture(
    path: InputPath,
    *,
    output: Annotated[
        Path,
        typer.Option("--output", "-o", metavar="PNG", help="A PNG file.", rich_help_panel=OUTPUT),
    ],
    frame: Annotated[
        list[int] | None,
        typer.Option(
            metavar="N", help="This frame, counted from 0; repeatable.", rich_help_panel=_SHOWN
        ),
    ] = None,
    sheet: Annotated[
        int,
        typer.Option(
            metavar="N", min=1, help="This many frames, evenly spaced.", rich_help_panel=_SHOWN
        ),
    ] = 6,
    reference: Reference = None,
    colour: ColourOption = None,
    range: RangeOption = None,
    title: Title = None,
    up: Up = None,
    azimuth: Azimuth = 60.0,
    size: Annotated[
        int,
        typer.Option(
            metavar="N", min=16, help="Pixels of a frame, each way.", rich_help_panel=_SHOWN
        ),
    ] = 480,
    overwrite: Overwrite = False,
    source: Source,
) -> None:
    """Draw frames of a sequence: one, or a contact sheet of several.

    Examples:
        dynmesh picture completed.npz -o sheet.png
        dynmesh picture completed.npz --frame 30 --colour generation -o frame.png
    """
    from ..draw.picture import evenly_spaced
    from ..draw.picture import picture as draw

    zeros = Zeros()
    with (
        _opened(path, source, reference=reference) as (reader, truth, _),
        new_output(output, overwrite, ".png") as made,
    ):
        draw(
            reader,
            made,
            numbers=frame or evenly_spaced(reader.n_frames, sheet),
            reference=truth,
            colour=colour,
            range=range,
            title=title,
            up=None if up is None else up.value,
            azimuth=azimuth,
            size=(size, size),
            watch=lambda frames, n: track(zeros.watch_shown(frames), n, "reading"),
        )
        _say_if_guessed(up, reader, truth)
    say(f"{output}: drawn")
    zeros.say_if_many()


@contextmanager
def _opened(
    path: Path, source: Source, *, reference: Path | None, given: Path | None = None
) -> Iterator[tuple[Reader, Reader | None, Reader | None]]:
    """Opens a sequence, its reference and its input, of those that there are."""
    own = source
    lent: list[Source] = []
    for other in (reference, given):
        kept, theirs = (own, source) if other is None else share_out(source, path, other)
        own = cast(Source, {name: kept.get(name) for name in own if name in kept})
        lent.append(theirs)
    if given is not None:  # a completed sequence has no missing vertices
        lent[1] |= {"known": own["known"], "missing": own["missing"], "gaps": own["gaps"]}
        own |= {"known": None, "missing": None, "gaps": "refuse"}
    with ExitStack() as stack:
        truth, partial = (
            None if other is None else stack.enter_context(files.open(other, **options))
            for other, options in zip((reference, given), lent, strict=True)
        )
        yield stack.enter_context(files.open(path, **own)), truth, partial


def _say_if_guessed(up: Axis | None, reader: Reader, *beside: Reader | None) -> None:
    if up is None and stated_up(reader, *beside) is None:
        guess = likely_up(next(iter(reader)).points, None)
        say(f"assuming that {guess} is up; if not, use --up {'y' if guess == 'z' else 'z'}")


def check_output(path: Path, overwrite: bool, suffix: str) -> None:
    """Refuses an output path that a picture or page cannot be written to."""
    if path.suffix.lower() != suffix:
        raise ValueError(f"{path}: must end in {suffix}")
    if not path.parent.is_dir():
        raise FileNotFoundError(f"{path}: there is no folder {path.parent}")
    if path.exists() and not overwrite:
        raise FileExistsError(f"{path}: exists already; --overwrite replaces it")


@contextmanager
def new_output(path: Path, overwrite: bool, suffix: str) -> Iterator[Path]:
    """Checks a path, and yields a hidden one to write to, which becomes it at the end."""
    check_output(path, overwrite, suffix)
    try:
        with working_folder(path) as (folder, remarks):
            yield folder / path.name
            check_output(path, overwrite, suffix)  # another process may have written it
            (folder / path.name).replace(path)
    except OSError as error:
        if error.errno is None or not _is_in(error.filename, unfinished_folder(path)):
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error
    say_remarks(path, remarks)


def _is_in(file: object, folder: Path) -> bool:
    return file is not None and Path(str(file)).is_relative_to(folder)
