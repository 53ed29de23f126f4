"""Pages and pictures of sequences, wherever these are."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from .. import files
from .._checks import check_integer, check_path, check_positive
from .._errors import InputError
from ..draw import picture_file
from ..draw.heatmap import ShownFrame
from ..draw.page import Page, page
from ..draw.picture import evenly_spaced, pictures
from ..draw.quantities import Colour, Range
from ..files import OneSequence, PathLike, Reader
from ..files.new_output import check_output, new_output
from ..files.times import index_of, mean_rate
from ..scans import ScanReader, open_scans

if TYPE_CHECKING:
    from PIL import Image

Watch: TypeAlias = Callable[[Iterable[ShownFrame], int], Iterable[ShownFrame]]

_SHEET = 6
_TURN = 72  # pictures of one frame, seen from all sides
_USUAL_RATE = 24.0


def view(
    sequence: OneSequence,
    out: PathLike | None = None,
    *,
    reference: OneSequence | None = None,
    input: OneSequence | None = None,
    scans: PathLike | ScanReader | None = None,
    scan_unit: str | float | None = None,
    colour: Colour | None = None,
    range: Range | None = None,
    title: str | None = None,
    up: str | None = None,
    azimuth: float = 60.0,
    max_frames: int = 120,
    max_vertices: int = 20_000,
    overwrite: bool = False,
    watch: Watch = lambda frames, _: frames,
) -> Page:
    """Makes a page that plays a sequence in any browser, offline.

    The input and the reference play beside it. A page shows itself in a notebook.

    Args:
        sequence: a file in any format, a reader from :func:`dynmesh.open`, or a sequence in memory.
        out: path of an HTML file to write; None writes none.
        reference: the true sequence, for errors.
        input: the sequence that was completed.
        scans: those that the sequence was tracked in.
        scan_unit: "m", "cm", "mm" or metres per unit of the scans; None means as they state it.
        colour: what colours show at first: "error", "generation", "age", "standard_error", "known",
            "distance", from the nearest point of the scans in mean edges, or "plain"; None means
            the first of them that there is.
        range: the ends of the scale of that colour.
        title: the heading; None means the name of the file.
        up: "x", "y" or "z"; None means as a file states it, else a guess.
        azimuth: the viewing angle around the up axis, in degrees.
        max_frames: longer sequences show every second, third, ... frame.
        max_vertices: larger meshes are simplified to about this many vertices.
        overwrite: whether to replace `out` if it exists.
        watch: called with the frames and their number; it must pass the frames on.

    Raises:
        FileExistsError: `out` exists.
        OSError, ImportError, TypeError, ValueError: a file cannot be read or written, the extra
            `view` is not installed, or see :func:`dynmesh.draw.page.page`.
    """
    output = _output(out, overwrite, ".html")
    if scans is not None and not isinstance(scans, ScanReader):
        scans = open_scans(scans, gaps="lost")
    with _opened(sequence, reference=reference, input=input) as (own, truth, given):
        made = page(
            own,
            reference=truth,
            input=given,
            scans=scans,
            scan_unit=scan_unit,
            colour=colour,
            range=range,
            title=title,
            up=up,
            azimuth=azimuth,
            max_frames=max_frames,
            max_vertices=max_vertices,
            watch=watch,
        )
    if output is not None:
        with new_output(output, overwrite, ".html") as hidden:
            hidden.write_text(made.html, encoding="utf-8")
    return made


def picture(
    sequence: OneSequence,
    out: PathLike | None = None,
    *,
    frames: float | Iterable[float] | None = None,
    count: int | None = None,
    reference: OneSequence | None = None,
    colour: Colour | None = None,
    range: Range | None = None,
    title: str | None = None,
    up: str | None = None,
    azimuth: float = 60.0,
    size: int = 480,
    turntable: bool = False,
    fps: float | None = None,
    overwrite: bool = False,
    watch: Watch = lambda frames, _: frames,
    watch_drawing: Callable[[Iterable[Any], int], Iterable[Any]] = lambda images, _: images,
) -> "Image.Image":
    """Draws frames of a sequence: one, a contact sheet of several, or a moving picture.

    Args:
        sequence: a file in any format, a reader from :func:`dynmesh.open`, or a sequence in memory.
        out: path of a file to write: PNG, or GIF, WebP or MP4 for a moving picture, which shows one
            frame after the other; None writes none.
        frames: the number of a frame in its file, or those of several; None chooses `count`
            of them, evenly spaced, the first and the last included.
        count: at most so many frames are drawn if `frames` is None; None means 6, or all of them in
            a moving picture.
        reference: the true sequence, for errors.
        colour: what colours show, as in :func:`view`.
        range: the ends of the colour scale.
        title: the heading; None means the name of the file.
        up: "x", "y" or "z"; None means as a file states it, else a guess.
        azimuth: the viewing angle around the up axis, in degrees.
        size: pixels of a frame, each way.
        turntable: whether a moving picture turns once around the up axis. If `frames` is one frame,
            it is seen from all sides.
        fps: of a moving picture, frames per second; None means as the sequence states it, else 24.
        overwrite: whether to replace `out` if it exists.
        watch: called with the frames and their number; it must pass the frames on.
        watch_drawing: the same for the pictures of a moving one.

    Returns:
        The picture, which shows itself in a notebook; the first of a moving one.

    Raises:
        FileExistsError: `out` exists.
        OSError, ImportError, TypeError, ValueError: a file cannot be read or written, the extra
            `view`, or `movie` for MP4, is not installed, there is no such frame, `turntable` or
            `fps` is given without a moving picture, or see :func:`dynmesh.draw.page.page`.
    """
    output = _output(out, overwrite, *picture_file.PICTURES)
    moving = output is not None and output.suffix.lower() in picture_file.MOVING
    for name, asked in (("turntable", turntable), ("fps", fps is not None)):
        if asked and not moving:
            raise InputError("requires a moving picture: .gif, .webp or .mp4", argument=name)
    if fps is not None:
        check_positive("fps", fps)
    check_integer("size", size, 16)
    if count is not None:
        check_integer("count", count, 1)
    if output is not None:
        picture_file.require_format(output)
    with _opened(sequence, reference=reference) as (own, truth, _):
        if frames is None:
            indices = evenly_spaced(own.n_frames, count or (own.n_frames if moving else _SHEET))
        else:
            numbers = frames if isinstance(frames, Iterable) else [frames]
            with files.naming(own.path):
                indices = [index_of(own.header, number, "frames") for number in numbers]
        if turntable and len(indices) == 1:
            indices *= _TURN
        drawn = pictures(
            own,
            indices=indices,
            reference=truth,
            colour=colour,
            range=range,
            title=title,
            up=up,
            azimuth=azimuth,
            size=(size, size),
            turn=360 / len(indices) if turntable else 0.0 if moving else None,
            watch=watch,
        )
        made: Image.Image
        if output is None:
            made = next(drawn)
        else:
            rate = fps or mean_rate(own.header) or _USUAL_RATE
            with new_output(output, overwrite, *picture_file.PICTURES) as hidden:
                images = watch_drawing(drawn, len(indices) if moving else 1)
                made = picture_file.write(images, hidden, rate)
    return made


def _output(out: PathLike | None, overwrite: bool, *suffixes: str) -> Path | None:
    """The path of an output, which is refused before any work begins."""
    if out is None:
        return None
    check_path("out", out)
    check_output(Path(out), overwrite, *suffixes)
    return Path(out)


@contextmanager
def _opened(
    sequence: OneSequence, **beside: OneSequence | None
) -> Iterator[tuple[Reader, Reader | None, Reader | None]]:
    """Opens a sequence, its reference and its input, of those that there are."""
    with ExitStack() as stack:
        truth, given = (
            None
            if (other := beside.get(name)) is None
            else stack.enter_context(files.opened(other, name))
            for name in ("reference", "input")
        )
        yield stack.enter_context(files.opened(sequence)), truth, given
