"""A sequence as one HTML page that plays in a browser."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..._extras import require_all
from ...files import Reader
from ...files.times import mean_rate
from ..figures import View
from ..heatmap import Colour, Heatmap, ShownFrame, likely_up
from .player import Playback, compose
from .thin import thin


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


def view(
    reader: Reader,
    output: Path,
    *,
    reference: Reader | None = None,
    colour: Colour | None = None,
    up: str | None = None,
    azimuth: float = 60.0,
    max_frames: int = 120,
    max_vertices: int = 20_000,
    watch: Callable[[Iterable[ShownFrame], int], Iterable[ShownFrame]] = lambda frames, _: frames,
) -> Shown:
    """Writes a page that plays a sequence and needs no other file and no network.

    Triangles with a missing vertex are left out; remaining vertices without a triangle become dots.
    The page states what it leaves out to stay small.

    Args:
        reader: of the sequence.
        output: an HTML file; an existing file is replaced.
        reference: of the true sequence, for errors.
        colour: see :class:`dynmesh.draw.heatmap.Heatmap`.
        up: "x", "y" or "z"; None means as the file states it, else z for a flat sheet, else y.
        azimuth: initial viewing angle around the up axis, in degrees.
        max_frames: longer sequences show every second, third, ... frame.
        max_vertices: larger meshes are simplified to about this many vertices.
        watch: called with the frames and their number; it must pass the frames on.

    Raises:
        OSError: the file cannot be written.
        ImportError: k3d or pyvista is not installed.
        ValueError: no vertex is known in any shown frame, a mesh to be simplified has no complete
            frame 0, or see :class:`dynmesh.draw.heatmap.Heatmap`.
    """
    require_all("k3d", "matplotlib", extra="view")
    heatmap = Heatmap(reader, reference=reference, colour=colour)
    kept, faces = thin(reader.faces, next(iter(reader)).points, max_vertices)
    step = -(-reader.n_frames // max_frames)
    numbers = range(0, reader.n_frames, step)
    frames = [frame.of(kept) for frame in watch(heatmap.frames(numbers), len(numbers))]
    seen = np.concatenate([frame.points[frame.visible] for frame in frames])
    if not len(seen):
        raise ValueError(f"{reader.path}: no vertex is known in these frames")
    shown = Shown(
        len(frames), reader.n_frames, step, len(kept), reader.n_vertices, len(faces),
        len(reader.faces),
    )  # fmt: skip
    playback = Playback(
        reader.path.name, str(shown), list(numbers), reader.n_frames, mean_rate(reader.header)
    )
    camera = View.of(
        seen, up or likely_up(next(iter(reader)).points, reader.header.up_axis), azimuth
    )
    page = compose(faces, frames, heatmap.scale(frames), camera, playback)
    output.write_text(page, encoding="utf-8")
    return shown


def _ordinal(number: int) -> str:
    ending = "th" if number % 100 in (11, 12, 13) else {1: "st", 2: "nd", 3: "rd"}.get(number % 10)
    return f"{number}{ending or 'th'}"
