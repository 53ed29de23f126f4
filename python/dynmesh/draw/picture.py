"""Pictures of a sequence: a frame, or a contact sheet of several."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from .._extras import require_all
from .._progress import tracked
from ..files import Reader
from . import figures
from .figures import Image, View
from .heatmap import Heatmap, ShownFrame, likely_up, stated_up, whole_faces
from .quantities import Colour
from .scales import Scale
from .sheet import contact_sheet


def evenly_spaced(n_frames: int, count: int) -> list[int]:
    """Returns the indices of at most `count` of `n_frames` frames, with the first and the last."""
    return sorted({round(x) for x in np.linspace(0, n_frames - 1, count)})


def drawn(
    reader: Reader,
    *,
    indices: Sequence[int],
    reference: Reader | None = None,
    colour: Colour | None = None,
    title: str | None = None,
    up: str | None = None,
    azimuth: float = 60.0,
    size: int = 480,
    progress: bool = False,
) -> Any:
    """Draws frames of a sequence on one sheet, all at the same scale, with one colour bar.

    Triangles with a missing vertex are left out; remaining vertices without a triangle become dots.
    The indices are those of the frames, one or several, and the size is that of each, in pixels
    each way. The other options are those of :func:`dynmesh.draw.page.page`.

    Returns:
        An image of Pillow.

    Raises:
        ImportError: pyvista or Pillow is not installed.
        ValueError: no vertex is visible in any of them, or see
            :class:`dynmesh.draw.heatmap.Heatmap`.
    """
    require_all("PIL.Image", "matplotlib", extra="view")
    figures.load_pyvista()
    if reference is not None and colour not in (None, "error", "standard_error"):
        raise ValueError(f"reference: requires the colour error or standard_error, not {colour}")
    heatmap = Heatmap(reader, reference=reference, colour=colour)
    frames = list(tracked(map(heatmap.frame, indices), len(indices), "reading", progress))
    seen = np.concatenate([frame.points[frame.visible] for frame in frames])
    if not len(seen):
        raise ValueError(f"{reader.path}: no vertex is known in these frames")
    scale = heatmap.scale(heatmap.colour, frames)
    up = up or likely_up(next(iter(reader)).points, stated_up(reader, reference))
    captions = [f"frame {reader.header.number(frame.number)}" for frame in frames]
    view = View.of(seen, up, azimuth, (size, size))
    images = figures.cropped([_draw(heatmap, frame, scale, view) for frame in frames])
    return contact_sheet(title or reader.path.name, images, captions, scale)


def _draw(heatmap: Heatmap, frame: ShownFrame, scale: Scale | None, view: View) -> Image:
    faces, alone = whole_faces(heatmap.reader.faces, frame.visible)
    places, colours = heatmap.places(frame, scale)
    points = np.where(frame.visible[:, None], frame.points, 0)
    return figures.render(faces, points, view, places, colours, alone)
