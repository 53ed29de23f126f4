"""Pictures of a sequence: one frame, or a contact sheet of several."""

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from .._extras import require_all
from ..files import Reader
from . import figures
from .figures import Image, View
from .heatmap import Heatmap, ShownFrame, likely_up, stated_up, whole_faces
from .quantities import Colour, Range
from .scales import Scale
from .sheet import contact_sheet


def evenly_spaced(n_frames: int, count: int) -> list[int]:
    """Returns at most `count` of `n_frames` frame numbers, including the first and the last."""
    return sorted({round(x) for x in np.linspace(0, n_frames - 1, count)})


def picture(
    reader: Reader,
    *,
    numbers: Sequence[int],
    reference: Reader | None = None,
    colour: Colour | None = None,
    range: Range | None = None,
    title: str | None = None,
    up: str | None = None,
    azimuth: float = 60.0,
    size: tuple[int, int] = (480, 480),
    watch: Callable[[Iterable[ShownFrame], int], Iterable[ShownFrame]] = lambda frames, _: frames,
) -> Any:
    """Draws frames of a sequence, all at the same scale, with one colour bar.

    Triangles with a missing vertex are left out; remaining vertices without a triangle become dots.
    The numbers are those of the frames, one or several, and the size is that of each, in pixels.
    The other options are those of :func:`dynmesh.draw.page.page`.

    Returns:
        An image of Pillow.

    Raises:
        ImportError: pyvista or Pillow is not installed.
        ValueError: a frame does not exist, no vertex is visible in any of them, or see
            :class:`dynmesh.draw.heatmap.Heatmap`.
    """
    require_all("PIL.Image", "matplotlib", extra="view")
    figures.load_pyvista()
    if reference is not None and colour not in (None, "error", "standard_error"):
        raise ValueError(f"reference: requires the colour error or standard_error, not {colour}")
    heatmap = Heatmap(reader, reference=reference, colour=colour, range=range)
    for number in numbers:
        if not 0 <= number < reader.n_frames:
            raise ValueError(
                f"{reader.path}: has no frame {number}, only 0 to {reader.n_frames - 1}; frames "
                "are counted from 0, whatever their numbers in the file"
            )
    frames = list(watch(map(heatmap.frame, numbers), len(numbers)))
    seen = np.concatenate([frame.points[frame.visible] for frame in frames])
    if not len(seen):
        raise ValueError(f"{reader.path}: no vertex is known in these frames")
    scale = heatmap.scale(heatmap.colour, frames)
    up = up or likely_up(next(iter(reader)).points, stated_up(reader, reference))
    view = View.of(seen, up, azimuth, size)
    images = figures.cropped([_draw(heatmap, frame, scale, view) for frame in frames])
    captions = [f"frame {frame.number}" for frame in frames]
    return contact_sheet(title or reader.title, images, captions, scale)


def _draw(heatmap: Heatmap, frame: ShownFrame, scale: Scale | None, view: View) -> Image:
    faces, alone = whole_faces(heatmap.reader.faces, frame.visible)
    places, colours = heatmap.places(frame, scale)
    points = np.where(frame.visible[:, None], frame.points, 0)
    return figures.render(faces, points, view, places=places, colours=colours, dots=alone)
