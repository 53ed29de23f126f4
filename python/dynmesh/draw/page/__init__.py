"""A sequence as one HTML page that plays in a browser."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..._errors import InputError, locating
from ..._extras import require_all
from ...files import Reader
from ...files.scans import ScanReader, given_unit
from ...frames.times import mean_rate
from ...sequence import Positions
from ..figures import View
from ..heatmap import Heatmap, ShownFrame, likely_up, stated_up
from ..quantities import Colour, Range
from ..scales import Scale
from .player import Playback, compose
from .thin import thin

_MOST_POINTS = 5000
"""Of a scan in a frame; more would make the page large and look the same."""


@dataclass(frozen=True)
class Shown:
    """How much of a sequence a page shows.

    Attributes:
        frames: number of frames shown, of `n_frames`, evenly spaced from frame 0.
        step: difference between the numbers of two shown frames.
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
        """Describes what was left out; empty if nothing was."""
        parts = []
        if self.step > 1:
            parts.append(f"every {_ordinal(self.step)} of {self.n_frames} frames")
        if self.vertices < self.n_vertices:
            parts.append(f"{self.vertices} of {self.n_vertices} vertices")
            parts.append(f"{self.triangles} of {self.n_triangles} triangles")
        return ", ".join(parts)


@dataclass(frozen=True)
class Page:
    """A page that needs no other file and no network.

    Attributes:
        html: the document.
        shown: what it shows of the sequence.
    """

    html: str
    shown: Shown


def view(reader: Reader, output: Path, **options: Any) -> Shown:
    """Writes the page that :func:`page` returns to an HTML file, which it replaces.

    The errors are those of :func:`page`, and OSError if the file cannot be written.
    """
    made = page(reader, **options)
    output.write_text(made.html, encoding="utf-8")
    return made.shown


def page(
    reader: Reader,
    *,
    reference: Reader | None = None,
    input: Reader | None = None,
    scans: ScanReader | None = None,
    scan_unit: str | float | None = None,
    colour: Colour | None = None,
    range: Range | None = None,
    title: str | None = None,
    up: str | None = None,
    azimuth: float = 60.0,
    max_frames: int = 120,
    max_vertices: int = 20_000,
    watch: Callable[[Iterable[ShownFrame], int], Iterable[ShownFrame]] = lambda frames, _: frames,
) -> Page:
    """Creates a page that plays a sequence.

    The input and the reference play beside it, seen from the same side. Triangles with a missing
    vertex are left out; remaining vertices without a triangle become dots. The page states what it
    leaves out to stay small. It opens playing, at the frame with the largest mean error if there is
    a reference; otherwise at the first of those in which the most vertices are missing or were
    filled in.

    Args:
        reader: of the sequence.
        reference: of the true sequence, for errors.
        input: of the sequence that was completed.
        scans: those that the sequence was tracked in; some points of each are shown.
        scan_unit: "m", "cm", "mm" or metres per unit of the scans; None means as their files state
            it, or else the unit of the sequence.
        colour: what the colours show at first; see :class:`dynmesh.draw.heatmap.Heatmap`. In the
            page, they can be switched to everything else that the sequence has.
        range: of the scale of that colour; see :class:`dynmesh.draw.heatmap.Heatmap`. With the same
            range, pages of several sequences can be compared.
        title: the heading; None means the name of the file and, in a scene, of the mesh.
        up: "x", "y" or "z"; None means as one of the files states it, else z for a flat sheet,
            else y.
        azimuth: initial viewing angle around the up axis, in degrees.
        max_frames: longer sequences show every second, third, ... frame.
        max_vertices: larger meshes are simplified to about this many vertices.
        watch: called with the frames and their number; it must pass the frames on.

    Raises:
        ImportError: k3d or pyvista is not installed.
        ValueError: no vertex is known in any shown frame, a mesh to be simplified has no complete
            frame 0, no point of the scans is near the mesh, or see
            :class:`dynmesh.draw.heatmap.Heatmap`.
    """
    require_all("k3d", "matplotlib", extra="view")
    heatmap = Heatmap(reader, reference=reference, input=input, colour=colour, range=range)
    first_points = next(iter(reader)).points
    kept, faces = thin(reader.faces, first_points, max_vertices)
    step = -(-reader.n_frames // max_frames)
    numbers = _every(step, reader.n_frames)
    frames = [frame.of(kept) for frame in watch(heatmap.frames(numbers), len(numbers))]
    if not any(frame.visible.any() for frame in frames):
        raise ValueError(f"{reader.path}: no vertex is known in these frames")
    shown = Shown(
        len(frames), reader.n_frames, step, len(kept), reader.n_vertices, len(faces),
        len(reader.faces),
    )  # fmt: skip
    captions = {"sequence": reader.path.name}
    if scans is not None:
        if scans.n_frames != reader.n_frames:
            raise ValueError(
                f"{scans.path} has {scans.n_frames} frames, but {reader.path} has {reader.n_frames}"
            )
        factor = _factor(scans, scan_unit, reader)
        captions = {"scans": f"{scans.path.name}, the scans", **captions}
    if input is not None:
        captions = {"input": f"{input.path.name}, the input", **captions}
    if reference is not None:
        captions = {**captions, "reference": f"{reference.path.name}, the reference"}
    playback = Playback(
        title or reader.title,
        str(shown),
        captions,
        list(numbers),
        _most_telling(frames),
        reader.n_frames,
        mean_rate(reader.header),
    )
    up = up or likely_up(first_points, stated_up(reader, reference, input))
    camera = View.of(_corners(frames), up, azimuth)
    scales: dict[Colour, Scale | None] = {
        name: heatmap.scale(name, frames) for name in heatmap.colours
    }
    clouds = None if scans is None else list(_clouds(scans, factor, step))
    with locating(file=None if scans is None else scans.path):
        html = compose(faces, frames, scales, heatmap.colour, camera, playback, clouds)
    return Page(html, shown)


def _factor(scans: ScanReader, scan_unit: str | float | None, reader: Reader) -> float:
    """Returns the length of the unit of the scans in that of the sequence."""
    ours, theirs = reader.header.metres_per_unit, scans.metres_per_unit
    if scan_unit is not None:
        theirs = given_unit("scan_unit", scan_unit)
        if ours is None:
            raise InputError("states no unit, so that of the scans tells nothing", file=reader.path)
    return 1.0 if ours is None or theirs is None else theirs / ours


def _clouds(scans: ScanReader, factor: float, step: int) -> Iterator[Positions]:
    """Yields some points of the scan of each shown frame, in the unit of the sequence."""
    for scan in scans.frames(step=step):
        cloud = np.zeros((0, 3)) if scan is None else scan.scaled(factor).cloud
        yield cloud[:: max(1, -(-len(cloud) // _MOST_POINTS))]


def _every(step: int, n_frames: int) -> range:
    return range(0, n_frames, step)


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
    """Returns the (n, 2, 3) corners of the box of each mesh in each frame."""
    meshes = [mesh for frame in frames for mesh in (frame, *frame.beside.values())]
    seen = [mesh.points[mesh.visible] for mesh in meshes if mesh.visible.any()]
    return np.stack([[points.min(axis=0), points.max(axis=0)] for points in seen])


def _ordinal(number: int) -> str:
    ending = "th" if number % 100 in (11, 12, 13) else {1: "st", 2: "nd", 3: "rd"}.get(number % 10)
    return f"{number}{ending or 'th'}"
