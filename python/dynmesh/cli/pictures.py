"""The commands that show a sequence."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, cast

import typer

from .. import files
from ..draw.heatmap import likely_up, stated_up
from ..draw.picture_file import PICTURES
from ..draw.quantities import Colour, Range
from ..files import Reader, Source
from ..files.new_output import check_output
from ..files.scans import open_scans
from ..jobs import showing
from ..jobs.option import OUTPUT, given, offered, options_of
from ..jobs.tracking_options import TrackingOptions
from .options import Axis, InputPath, Overwrite, share_out, with_options, with_source
from .terminal import say, track


def _shown(default: Any, help: str, kind: Any = str, **more: Any) -> Any:
    return given(default, help, "What to show", kind, **more)


@dataclass(frozen=True, kw_only=True)
class _Picture:
    """What can be asked of both commands."""

    reference: Path | None = _shown(
        None,
        "The true sequence; colours then show the error, in mm if a file states its unit, else in "
        "% of the bounding-box diagonal.",
        Path,
        metavar="FILE",
    )
    colour: Colour | None = _shown(
        None,
        "error, generation, age, standard_error, known, distance (from the nearest point of the "
        "scans) or plain. [the first that there is]",
        Colour,
        metavar="NAME",
        flags=("--colour", "--color"),
    )
    range: Range | None = _shown(
        None,
        "The ends of the colour scale, in its unit: linear from 0, else logarithmic.",
        Range,
        metavar="LOW HIGH",
    )
    title: str | None = _shown(None, "The heading. [the name of IN]", metavar="TEXT")
    up: Axis | None = _shown(None, "The up axis. [as in IN; else y, or z for a flat sheet]", Axis)
    azimuth: float = _shown(
        60.0, "View from this angle around the up axis.", float, metavar="DEGREES"
    )

    @property
    def common(self) -> dict[str, Any]:
        """The keywords that what draws pages and pictures takes."""
        names = ("colour", "range", "title", "azimuth")
        up = None if self.up is None else self.up.value
        return {"up": up, **{name: getattr(self, name) for name in names}}


@dataclass(frozen=True, kw_only=True)
class _Page(_Picture):
    """What can be asked of a page."""

    input: Path | None = _shown(
        None,
        "The sequence that was completed, to show beside IN; --mask, --missing and --gaps then "
        "describe it.",
        Path,
        metavar="FILE",
    )
    scans: Path | None = _shown(
        None, "The scans that IN was tracked in, to show beside it.", Path, metavar="SCANS"
    )
    cameras: Path | None = _shown(
        None,
        "Where the cameras of the scans stand. [cameras.json beside SCANS]",
        Path,
        metavar="FILE",
    )
    scan_unit: str | float | None = offered(options_of(TrackingOptions)["scan_unit"])
    max_frames: int = _shown(120, "About this many frames at most.", int, metavar="N", least=1)
    max_vertices: int = _shown(
        20_000, "Simplify a mesh that has more vertices.", int, metavar="N", least=4
    )


@dataclass(frozen=True, kw_only=True)
class _Sheet(_Picture):
    """What can be asked of a picture."""

    frame: list[int] | None = _shown(
        None, "The frame with this number in IN; repeatable.", int, several=True, metavar="N"
    )
    sheet: int | None = _shown(
        None,
        "This many frames, evenly spaced. [6; all of them if the picture moves]",
        int,
        metavar="N",
        least=1,
    )
    size: int = _shown(480, "Pixels of a frame, each way.", int, metavar="N", least=16)
    turntable: bool = _shown(
        False, "Turn a moving picture once around; one --frame is shown from all sides.", bool
    )
    fps: float | None = _shown(
        None, "Frames per second of a moving picture. [as in IN, else 24]", float, metavar="N"
    )


@with_options(_Page, _Page)
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
    options: _Page,
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
    scans = options.scans
    beside = {"reference": options.reference, "given": options.input}
    check_output(output, overwrite, ".html")
    with _opened(path, source, **beside) as (reader, truth, partial):
        shown = showing.view(
            reader,
            output,
            reference=truth,
            input=partial,
            scans=None
            if scans is None
            else open_scans(scans, cameras=options.cameras, gaps="lost"),
            scan_unit=options.scan_unit,
            max_frames=options.max_frames,
            max_vertices=options.max_vertices,
            overwrite=overwrite,
            watch=lambda frames, n: track(frames, n, "reading"),
            **options.common,
        ).shown
        _say_more(options.up, reader, truth, partial)
    say(f"{output}: open it in a browser" + (f"; it shows {shown}" if str(shown) else ""))


@with_options(_Sheet, _Sheet)
@with_source
def picture(
    path: InputPath,
    *,
    output: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            metavar="PICTURE",
            help="A PNG file, or a GIF, WebP or MP4 file for a moving picture.",
            rich_help_panel=OUTPUT,
        ),
    ],
    options: _Sheet,
    overwrite: Overwrite = False,
    source: Source,
) -> None:
    """Draw frames of a sequence: one, a contact sheet of several, or a moving picture.

    Examples:
    ```text
    dynmesh picture completed.npz -o sheet.png
    dynmesh picture completed.npz --frame 30 --colour generation -o frame.png
    dynmesh picture completed.npz --turntable -o clip.mp4
    ```
    """
    check_output(output, overwrite, *PICTURES)
    with _opened(path, source, reference=options.reference) as (reader, truth, _):
        showing.picture(
            reader,
            output,
            frames=options.frame,
            count=options.sheet,
            reference=truth,
            size=options.size,
            turntable=options.turntable,
            fps=options.fps,
            overwrite=overwrite,
            watch=lambda frames, n: track(frames, n, "reading"),
            watch_drawing=lambda images, n: track(images, n, "drawing"),
            **options.common,
        )
        _say_more(options.up, reader, truth)
    say(f"{output}: drawn")


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


def _say_more(up: Axis | None, reader: Reader, *beside: Reader | None) -> None:
    """Says which axis is up if nothing states it."""
    if up is None and stated_up(reader, *beside) is None:
        guess = likely_up(next(iter(reader)).points, None)
        say(f"assuming that {guess} is up; if not, use --up {'y' if guess == 'z' else 'z'}")
