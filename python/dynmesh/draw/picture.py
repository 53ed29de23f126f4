"""Pictures of a sequence: a frame, a contact sheet of several, or one after the other."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._extras import require_all
from .._progress import tracked
from ..files import Reader
from . import figures
from .figures import Image, View
from .heatmap import Heatmap, ShownFrame, likely_up, stated_up, whole_faces
from .quantities import Colour, Range
from .scales import Scale
from .sheet import contact_sheet


def evenly_spaced(n_frames: int, count: int) -> list[int]:
    """Returns the indices of at most `count` of `n_frames` frames, with the first and the last."""
    return sorted({round(x) for x in np.linspace(0, n_frames - 1, count)})


def pictures(
    reader: Reader,
    *,
    indices: Sequence[int],
    reference: Reader | None = None,
    colour: Colour | None = None,
    range: Range | None = None,
    title: str | None = None,
    up: str | None = None,
    azimuth: float = 60.0,
    size: tuple[int, int] = (480, 480),
    turn: float | None = None,
    progress: bool = False,
) -> Iterator[Any]:
    """Draws frames of a sequence, all at the same scale, with one colour bar.

    Triangles with a missing vertex are left out; remaining vertices without a triangle become dots.
    The indices are those of the frames, one or several, and the size is that of each, in pixels.
    With `turn`, there is a picture of each frame instead of one sheet, in which the camera follows
    what is visible, and the azimuth grows by so many degrees from one to the next. The other
    options are those of :func:`dynmesh.draw.page.page`.

    Yields:
        Images of Pillow, of one size.

    Raises:
        ImportError: pyvista or Pillow is not installed.
        ValueError: no vertex is visible in any of them, or see
            :class:`dynmesh.draw.heatmap.Heatmap`.
    """
    require_all("PIL.Image", "matplotlib", extra="view")
    figures.load_pyvista()
    if reference is not None and colour not in (None, "error", "standard_error"):
        raise ValueError(f"reference: requires the colour error or standard_error, not {colour}")
    heatmap = Heatmap(reader, reference=reference, colour=colour, range=range)
    frames = list(tracked(map(heatmap.frame, indices), len(indices), "reading", progress))
    seen = np.concatenate([frame.points[frame.visible] for frame in frames])
    if not len(seen):
        raise ValueError(f"{reader.path}: no vertex is known in these frames")
    scale = heatmap.scale(heatmap.colour)
    up = up or likely_up(next(iter(reader)).points, stated_up(reader, reference))
    heading = title or reader.path.name
    captions = [f"frame {reader.header.number(frame.number)}" for frame in frames]
    if turn is None:
        view = View.of(seen, up, azimuth, size)
        images = figures.cropped([_draw(heatmap, frame, scale, view) for frame in frames])
        yield contact_sheet(heading, images, captions, scale)
        return
    boxes = enumerate(_boxes(frames))
    views = [View.of(box, up, azimuth + i * turn, size) for i, box in boxes]
    reach = max(view.reach for view in views)  # a figure that turns must not seem to grow
    for frame, view, caption in zip(frames, views, captions, strict=True):
        image = _draw(heatmap, frame, scale, replace(view, least_reach=reach))
        yield contact_sheet(heading, [image], [caption], scale)


def _boxes(frames: Sequence[ShownFrame]) -> list[NDArray[Any]]:
    """Returns the corners (2, 3) of what is shown of each frame, of one size.

    A box holds its frame and moves no more than it must, so that a figure that stays in its place
    is seen to move.
    """
    ends = [
        np.stack([seen.min(axis=0), seen.max(axis=0)]) if len(seen) else None
        for seen in (frame.points[frame.visible].astype(np.float64) for frame in frames)
    ]
    first, *_ = visible = [one for one in ends if one is not None]
    size = np.max([high - low for low, high in visible], axis=0)
    corner = first.mean(axis=0) - size / 2
    boxes = []
    for one in ends:
        if one is not None:
            corner = np.clip(corner, one[1] - size, one[0])
        boxes.append(np.stack([corner, corner + size]))
    return boxes


def _draw(heatmap: Heatmap, frame: ShownFrame, scale: Scale | None, view: View) -> Image:
    faces, alone = whole_faces(heatmap.reader.faces, frame.visible)
    places, colours = heatmap.places(frame, scale)
    points = np.where(frame.visible[:, None], frame.points, 0)
    return figures.render(faces, points, view, places, colours, alone)
