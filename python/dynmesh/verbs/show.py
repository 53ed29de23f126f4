"""Pages and pictures of sequences, wherever these are."""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from .. import files
from .._checks import check_integer, check_path
from .._command import How, Output, What
from .._errors import InputError
from ..draw.page import Page, page, require_page, scan_factor
from ..draw.page.pick import pick_page
from ..draw.picture import drawn, evenly_spaced
from ..draw.quantities import Alone, Colour
from ..files import OneSequence, PathLike, Reader, Source
from ..files.conversion import Axis
from ..files.new_output import check_output, new_output
from ..files.reader import remarks_of
from ..files.times import index_of
from ..scans import ScanReader, open_scans
from ..tracking.room import Crop, Room, RoomlessScans
from ..tracking.single_scan import open_single

if TYPE_CHECKING:
    from PIL import Image


def view(
    sequence: OneSequence,
    out: Output[PathLike | None] = None,
    *,
    reference: What[OneSequence | None] = None,
    input: What[OneSequence | None] = None,
    scans: What[PathLike | ScanReader | None] = None,
    cameras: What[PathLike | None] = None,
    scan_unit: What[float | str | None] = None,
    crop: What[Crop | str | None] = None,
    remove_planes: What[bool] = False,
    quality: What[PathLike | None] = None,
    pick: What[PathLike | None] = None,
    source: Source | None = None,
    colour: How[Colour | None] = None,
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
        crop: leave out points outside the box x,y,z,x,y,z, or farther than this from that of the
            mesh, in the unit of the sequence.
        remove_planes: whether to leave out floor and walls: planes in the first scan that are
            larger than the mesh.
        quality: the table that tracking wrote by `csv`; a line under the slider then shows how good
            each frame is, and leads to those that are clicked.
        pick: instead, show frame 0, the template, beside the first of the scans, a file or several;
            the page pairs vertices and points that are clicked, and saves them under this name, as
            landmarks of a registration.
        source: how to read `input` if it is given, else the sequence; faces and the mesh are those
            of every file that needs them.
        colour: what colours show at first: "error", "generation", "age", "standard_error", "known",
            "distance", from the nearest point of the scans, or "plain"; else, the first of them
            that there is.
        title: the heading; else, the name of the file.
        up: the up axis; else, as a file states it, or a guess.
        azimuth: the viewing angle around the up axis, in degrees.
        max_frames: longer sequences show every second, third, ... frame.
        max_vertices: larger meshes are simplified to about this many vertices.
        overwrite: whether to replace an existing file.
        progress: whether to show on standard error how far it is.

    Raises:
        FileExistsError: `out` exists.
        OSError, ImportError, TypeError, ValueError: a file cannot be read or written, an extra is
            not installed, or an argument is refused.
    """
    output = _output(out, overwrite, ".html")
    check_integer("max_frames", max_frames, 1)
    check_integer("max_vertices", max_vertices, 4)
    require_page(scans=scans is not None)
    room = Room(crop, remove_planes)
    of_scans = {"cameras": cameras, "scan_unit": scan_unit, "crop": crop}
    for name, value in (of_scans | {"remove_planes": remove_planes or None}).items():
        if value is not None and scans is None:
            raise InputError("is that of `scans`, which are not given", argument=name)
    if pick is not None:
        others = {"reference": reference, "input": input, "quality": quality, "colour": colour}
        _check_pick(pick, scans, {**others, "scan_unit": scan_unit})
    if quality is not None:
        check_path("quality", quality)
    if scans is not None and not isinstance(scans, ScanReader):
        if pick is not None and Path(scans).is_file():
            scans = open_single(Path(scans), cameras)
        else:
            scans = open_scans(scans, cameras=cameras, gaps="lost")
    with _opened(sequence, reference, input, source or {}) as (own, truth, given):
        if room and scans is not None:
            scans = RoomlessScans(scans, own, room, scan_factor(scans, scan_unit, own))
        if pick is not None and scans is not None:
            look = azimuth, max_vertices
            made = pick_page(own, scans, Path(pick).name, *look, title=title, up=up)
        else:
            made = page(
                own,
                reference=truth,
                input=given,
                scans=scans,
                scan_unit=scan_unit,
                quality=None if quality is None else Path(quality),
                colour=colour,
                title=title,
                up=up,
                azimuth=azimuth,
                max_frames=max_frames,
                max_vertices=max_vertices,
                progress=progress,
            )
        made = replace(made, remarks=(*made.remarks, *remarks_of(own, truth, given)))
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
    count: What[int] = 6,
    reference: What[OneSequence | None] = None,
    source: Source | None = None,
    colour: How[Alone | None] = None,
    title: How[str | None] = None,
    up: How[Axis | None] = None,
    azimuth: How[float] = 60.0,
    size: Output[int] = 480,
    overwrite: Output[bool] = False,
    progress: bool = False,
) -> "Image.Image":
    """Draws frames of a sequence: one, or a contact sheet of several.

    In a notebook, a picture shows itself. Its `info` has the remarks that commands print.

    Args:
        sequence: the sequence.
        out: the PNG file to write; without it, Python returns the picture alone.
        frames: the number of a frame, or of several, for which a command repeats the option; else,
            `count` frames, evenly spaced.
        count: the number of frames, at most.
        reference: the true sequence; colours then show the error.
        source: how to read the sequence; faces and the mesh are those of the reference, too.
        colour: what colours show, as in a page: "error", "generation", "age", "standard_error",
            "known" or "plain".
        title: the heading; else, the name of the file.
        up: the up axis; else, as a file states it, or a guess.
        azimuth: the viewing angle around the up axis, in degrees.
        size: pixels of a frame, each way.
        overwrite: whether to replace an existing file.
        progress: whether to show on standard error how far it is.

    Raises:
        FileExistsError: `out` exists.
        OSError, ImportError, TypeError, ValueError: a file cannot be read or written, an extra is
            not installed, there is no such frame, or an argument is refused.
    """
    output = _output(out, overwrite, ".png")
    check_integer("size", size, 16)
    check_integer("count", count, 1)
    with _opened(sequence, reference, None, source or {}) as (own, truth, _):
        if frames is None:
            indices = evenly_spaced(own.n_frames, count)
        else:
            numbers = frames if isinstance(frames, Iterable) else [frames]
            indices = [index_of(own.header, number, "frames") for number in numbers]
        made: Image.Image = drawn(
            own,
            indices=indices,
            reference=truth,
            colour=colour,
            title=title,
            up=up,
            azimuth=azimuth,
            size=size,
            progress=progress,
        )
        made.info["remarks"] = remarks_of(own, truth)
    if output is not None:
        with new_output(output, overwrite, ".png") as hidden:
            made.save(hidden)
    return made


def _check_pick(pick: PathLike, scans: object, others: Mapping[str, object]) -> None:
    """Refuses what cannot be picked, or shown beside it."""
    check_path("pick", pick)
    if Path(pick).suffix != ".json":
        raise InputError(f"must end with .json, not {pick}", argument="pick", value=pick)
    if scans is None:
        raise InputError("are needed, to pick points of the first one", argument="scans")
    for name, given in others.items():
        if given is not None:
            raise InputError("cannot be shown where landmarks are picked", argument=name)


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
        how = source if given is None else shared
        own = stack.enter_context(files.opened_beside(sequence, "sequence", how))
        truth, partial = (
            None if one is None else stack.enter_context(files.opened_beside(one, name, how))
            for name, one, how in (("reference", reference, shared), ("input", given, source))
        )
        yield own, truth, partial
