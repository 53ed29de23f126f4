"""Pages and pictures of sequences, wherever these are."""

from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from .. import files
from .._checks import check_integer, check_path, check_positive
from .._command import How, Output, What
from .._errors import InputError
from .._progress import tracked
from ..draw import picture_file
from ..draw.page import Page, page, require_page
from ..draw.picture import evenly_spaced, pictures
from ..draw.quantities import Colour, Range
from ..files import OneSequence, PathLike, Reader, Source
from ..files.conversion import Axis
from ..files.new_output import check_output, new_output
from ..files.times import index_of, mean_rate
from ..scans import ScanReader, open_scans

if TYPE_CHECKING:
    from PIL import Image

_SHEET = 6
_TURN = 72  # pictures of one frame, seen from all sides
_USUAL_RATE = 24.0


def view(
    sequence: OneSequence,
    out: Output[PathLike | None] = None,
    *,
    reference: What[OneSequence | None] = None,
    input: What[OneSequence | None] = None,
    scans: What[PathLike | ScanReader | None] = None,
    cameras: What[PathLike | None] = None,
    scan_unit: What[float | str | None] = None,
    source: Source | None = None,
    colour: How[Colour | None] = None,
    range: How[Range | None] = None,
    title: How[str | None] = None,
    up: How[Axis | None] = None,
    azimuth: How[float] = 60.0,
    max_frames: How[int] = 120,
    max_vertices: How[int] = 20_000,
    overwrite: Output[bool] = False,
    progress: bool = False,
) -> Page:
    """Makes a page that plays a sequence in any browser, offline.

    The input and the reference play beside it. In the page, ? lists the keys. In a notebook, a page
    shows itself.

    Args:
        sequence: the sequence.
        out: the HTML file to write; without it, Python returns the page alone.
        reference: the true sequence; colours then show the error.
        input: the sequence that was completed.
        scans: those that the sequence was tracked in.
        cameras: where their cameras stand; else, `cameras.json` beside them.
        scan_unit: the unit of length of the scans: m, cm, mm, or a number of metres; else, as their
            files state it.
        source: how to read `input` if it is given, else the sequence; faces and the mesh are those
            of every file that needs them.
        colour: what colours show at first: "error", "generation", "age", "standard_error", "known",
            "distance", from the nearest point of the scans, or "plain"; else, the first of them
            that there is.
        range: the ends of the colour scale, in its unit: linear from 0, else logarithmic.
        title: the heading; else, the name of the file.
        up: the up axis; else, as a file states it, or a guess.
        azimuth: the viewing angle around the up axis, in degrees.
        max_frames: longer sequences show every second, third, ... frame.
        max_vertices: larger meshes are simplified to about this many vertices.
        overwrite: whether to replace an existing file.
        progress: whether to show a bar on standard error.

    Raises:
        FileExistsError: `out` exists.
        OSError, ImportError, TypeError, ValueError: a file cannot be read or written, an extra is
            not installed, or an argument is refused.
    """
    output = _output(out, overwrite, ".html")
    check_integer("max_frames", max_frames, 1)
    check_integer("max_vertices", max_vertices, 4)
    require_page(scans=scans is not None)
    if scans is not None and not isinstance(scans, ScanReader):
        scans = open_scans(scans, cameras=cameras, gaps="lost")
    with _opened(sequence, reference, input, source or {}) as (own, truth, given):
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
            progress=progress,
        )
    if output is None:
        return made
    with new_output(output, overwrite, ".html") as hidden:
        hidden.write_text(made.html, encoding="utf-8")
    return replace(made, output=output)


def picture(
    sequence: OneSequence,
    out: Output[PathLike | None] = None,
    *,
    frames: What[float | Iterable[float] | None] = None,
    count: What[int | None] = None,
    reference: What[OneSequence | None] = None,
    source: Source | None = None,
    colour: How[Colour | None] = None,
    range: How[Range | None] = None,
    title: How[str | None] = None,
    up: How[Axis | None] = None,
    azimuth: How[float] = 60.0,
    turntable: How[bool] = False,
    size: Output[int] = 480,
    fps: Output[float | None] = None,
    overwrite: Output[bool] = False,
    progress: bool = False,
) -> "Image.Image":
    """Draws frames of a sequence: one, a contact sheet of several, or a moving picture.

    In a notebook, a picture shows itself; of a moving one, it is the first.

    Args:
        sequence: the sequence.
        out: the file to write: PNG, or GIF, WebP or MP4 for a moving picture, which shows one frame
            after the other; without it, Python returns the picture alone.
        frames: the numbers of the frames, one or several; else, `count` of them, evenly spaced.
        count: the number of frames, at most; else 6, or all of them in a moving picture.
        reference: the true sequence; colours then show the error.
        source: how to read the sequence; faces and the mesh are those of the reference, too.
        colour: what colours show, as in a page: "error", "generation", "age", "standard_error",
            "known" or "plain".
        range: the ends of the colour scale, in its unit: linear from 0, else logarithmic.
        title: the heading; else, the name of the file.
        up: the up axis; else, as a file states it, or a guess.
        azimuth: the viewing angle around the up axis, in degrees.
        turntable: whether a moving picture turns once around the up axis; a single frame is then
            seen from all sides.
        size: pixels of a frame, each way.
        fps: frames per second of a moving picture; else, as the sequence states it, or 24.
        overwrite: whether to replace an existing file.
        progress: whether to show a bar on standard error.

    Raises:
        FileExistsError: `out` exists.
        OSError, ImportError, TypeError, ValueError: a file cannot be read or written, an extra is
            not installed, there is no such frame, or an argument is refused.
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
    with _opened(sequence, reference, None, source or {}) as (own, truth, _):
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
            progress=progress,
        )
        made: Image.Image
        if output is None:
            made = next(drawn)
        else:
            rate = fps or mean_rate(own.header) or _USUAL_RATE
            with new_output(output, overwrite, *picture_file.PICTURES) as hidden:
                images = tracked(drawn, len(indices) if moving else 1, "drawing", progress)
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
    sequence: OneSequence,
    reference: OneSequence | None,
    given: OneSequence | None,
    source: Source,
) -> Iterator[tuple[Reader, Reader | None, Reader | None]]:
    """Opens a sequence, its reference and its input, of those that there are."""
    shared: Source = {"faces": source.get("faces"), "prim": source.get("prim")}
    with ExitStack() as stack:
        truth = partial = None
        if reference is not None:
            truth = stack.enter_context(files.opened_beside(reference, "reference", shared))
        if given is not None:
            partial = stack.enter_context(files.opened_beside(given, "input", source))
            source = shared
        own = stack.enter_context(files.opened_beside(sequence, "sequence", source))
        yield own, truth, partial
