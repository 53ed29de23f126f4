"""A sequence as one HTML page that plays in a browser."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._arrays import Positions
from ..._checks import path_of
from ..._errors import InputError, locating, require_all
from ..._report import Report, some_of, tracked
from ...formats import PathLike
from ...formats.times import are_clock_times, called, mean_rate
from ...frame import Frames, frame_at
from ...scans import ScanReader, unit_of_scans
from ...scans.cameras import Upwards, upwards_of
from ...topology import assumed, likely_up
from ..figures import View, thin
from ..heatmap import Colour, Heatmap, ShownFrame, short_names, stated_up
from .player import player
from .verdicts import shown_verdicts


@dataclass(frozen=True)
class Shown:
    """How much of a sequence a page shows.

    Attributes:
        frames: number of frames shown, of `n_frames`, evenly spaced from frame 0.
        step: every so many frames are shown.
        vertices: number of vertices shown, of `n_vertices`.
        triangles: number of triangles shown, of `n_triangles`.
    """

    frames: int
    n_frames: int
    step: int
    vertices: int
    n_vertices: int
    triangles: int
    n_triangles: int

    def __str__(self) -> str:
        parts = []
        if self.step > 1:
            parts.append(f"every {_ordinal(self.step)} of {self.n_frames} frames")
        if self.vertices < self.n_vertices:
            parts.append(f"{self.vertices} of {self.n_vertices} vertices")
            parts.append(f"{self.triangles} of {self.n_triangles} triangles")
        return ", ".join(parts)


@dataclass(frozen=True, kw_only=True)
class Page(Report):
    """A page that needs no other file and no network.

    Attributes:
        html: the document.
        shown: what it shows of the sequence.
        output: the file to which it was written; None if it was not.
    """

    html: str = field(repr=False)
    shown: Shown
    output: Path | None = None

    def lines(self) -> list[str]:
        """Says what is shown."""
        shown = f"; it shows {self.shown}" if str(self.shown) else ""
        return [f"open it in a browser{shown}", *super().lines()]

    def write(self, path: PathLike) -> None:
        """Writes the page to an HTML file."""
        path_of("path", path).write_text(self.html, encoding="utf-8")

    def _repr_html_(self) -> str:
        return framed(self.html)


def framed(html: str) -> str:
    """Returns a document in a frame of another one."""
    style = "width: 100%; height: 480px; border: 0"
    return f'<iframe srcdoc="{escape(html)}" title="player" style="{style}"></iframe>'


def require_page(*, scans: bool) -> None:
    """Imports what a page needs, so that a missing library is reported before any work begins."""
    require_all("k3d", *(["pyvista"] if scans else []), extra="view")


def page(
    reader: Frames,
    *,
    reference: Frames | None = None,
    input: Frames | None = None,
    scans: ScanReader | None = None,
    scan_unit: str | float | None = None,
    quality: Path | None = None,
    colour: Colour | None = None,
    colour_range: tuple[float, float] | None = None,
    title: str | None = None,
    up: str | None = None,
    azimuth: float = 60.0,
    max_frames: int = 120,
    max_vertices: int = 20_000,
    progress: bool | None = None,
) -> Page:
    """Creates a page that plays a sequence.

    The others play beside it, seen from the same side. Triangles with a missing
    vertex are left out; remaining vertices without a triangle become dots. The page states what it
    leaves out to stay small. It opens paused at the frame with the largest mean error if there is
    a reference; otherwise it plays from the first of those in which the most vertices are missing
    or were filled in.

    The arguments are those of :func:`dynmesh.view`, with readers in place of paths.
    """
    require_page(scans=scans is not None)
    factor = 1.0
    if scans is not None:
        factor = _scan_factor(scans, scan_unit, reader)
    heatmap = Heatmap(reader, reference, input, scans, factor, colour_range, wanted=colour)
    first_points = frame_at(reader, 0).points
    with locating(file=reader.path):
        kept, faces = thin(reader.faces, first_points, max_vertices)
    indices = range(0, reader.n_frames, -(-reader.n_frames // max_frames))
    verdicts = [] if quality is None else shown_verdicts(quality, reader, indices)
    read = tracked(heatmap.frames(indices), len(indices), "reading", progress)
    frames = [frame.of(kept) for frame in read]
    if not any(frame.visible.any() for frame in frames):
        raise InputError("no vertex is known in these frames", file=reader.path)
    size = (len(kept), reader.n_vertices, len(faces), len(reader.faces))
    shown = Shown(len(frames), reader.n_frames, indices.step, *size)
    completed = reader.path.name if input is None else _caption("completed", reader.path.name)
    captions = {"sequence": completed}
    if scans is not None:
        noun = "scan" if scans.n_frames == 1 else "scans"
        captions = {"scans": _caption(noun, scans.path.name), **captions}
    if input is not None:
        captions = {"input": _caption("seen", input.path.name), **captions}
    if reference is not None:
        captions = {**captions, "reference": _caption("true", reference.path.name)}
    upright, guess = _upright(up or stated_up(reader, reference, input), first_points)
    if guess and scans is not None:
        clouds = (frame.cloud for frame in frames if frame.cloud is not None)
        first_cloud = next((cloud / factor for cloud in clouds if len(cloud)), np.empty((0, 3)))
        if held := upwards_of(scans.rig, first_cloud):
            upright, guess = held, (f"assuming that {held} is up, as the cameras are held",)
    names = some_of(short_names([*reader.each]))
    notes = [names] * bool(names) + [f"shown: {shown}"] * bool(str(shown)) + [*guess]
    numbers = reader.header.numbers.tolist()
    content = {
        "title": title or reader.path.name,
        "note": "; ".join(notes),  # above the panes, as the title
        "names": [called(numbers[index], numbers) for index in indices],
        "clock": are_clock_times(numbers),  # then names tell the seconds
        "first": _most_telling(frames),  # the index of that which is shown first
        "plays": reference is None,  # at once, from there
        "last": called(numbers[-1], numbers).split(" ", 1)[1],
        "step": indices.step,
        "fps": mean_rate(reader.header),  # of the sequence, or None
        "colour": heatmap.colour,  # at first
        "verdicts": verdicts,
    }
    scales = {name: heatmap.scale(name, frames) for name in heatmap.colours}
    view = View.of(_corners(frames), upright.axis, azimuth, is_reversed=upright.is_reversed)
    html = player(faces, frames, scales, view, captions, content)
    return Page(html=html, shown=shown, remarks=guess)


def _upright(said: str | None, first: Positions) -> tuple[Upwards, tuple[str, ...]]:
    """Returns what is up, and a remark if that is a guess."""
    up = said or likely_up(first, None)
    return Upwards(up), () if said else (assumed(up),)


def _caption(what: str, name: str) -> str:
    """Says what a pane shows; a name in memory says nothing else."""
    if name in ("sequence", "input", "reference"):
        return what
    return name if name.startswith(what) else f"{what}: {name}"


def _scan_factor(scans: ScanReader, scan_unit: str | float | None, reader: Frames) -> float:
    """Returns the length of the unit of the scans in that of the sequence."""
    ours, theirs = reader.header.metres_per_unit, unit_of_scans(scans, scan_unit)
    if scan_unit is not None and ours is None:
        raise InputError("states no unit, so that of the scans tells nothing", file=reader.path)
    return 1.0 if ours is None or theirs is None else theirs / ours


def _most_telling(frames: Sequence[ShownFrame]) -> int:
    """Returns the index of the frame at which the page opens."""

    def tells(frame: ShownFrame) -> float:
        if "error" in frame.values:
            return float(frame.values["error"][frame.visible].mean()) if frame.visible.any() else 0
        missing = np.count_nonzero(~frame.visible)
        if "known" in frame.values:
            missing += np.count_nonzero(frame.visible & (frame.values["known"] == 0))
        return float(missing)

    return max(range(len(frames)), key=lambda index: tells(frames[index]))


def _corners(frames: Sequence[ShownFrame]) -> NDArray[Any]:
    meshes = [mesh for frame in frames for mesh in (frame, *frame.beside.values())]
    seen = [mesh.points[mesh.visible] for mesh in meshes if mesh.visible.any()]
    return np.stack([[points.min(axis=0), points.max(axis=0)] for points in seen])


def _ordinal(number: int) -> str:
    ending = "th" if number % 100 in (11, 12, 13) else {1: "st", 2: "nd", 3: "rd"}.get(number % 10)
    return f"{number}{ending or 'th'}"
