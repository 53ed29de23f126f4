"""Pictures of a sequence as PNG: one frame, or a contact sheet of several."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np

from .._extras import require_all
from ..files import Reader
from . import figures
from .figures import SURFACE_COLOUR, Image, View
from .heatmap import Heatmap, ShownFrame, likely_up, stated_up, whole_faces
from .quantities import Colour, Range
from .scales import Scale, Values
from .sheet import contact_sheet


def evenly_spaced(n_frames: int, count: int) -> list[int]:
    """Returns at most `count` of `n_frames` frame numbers, including the first and the last."""
    return sorted({round(x) for x in np.linspace(0, n_frames - 1, count)})


def picture(
    reader: Reader,
    output: Path,
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
) -> None:
    """Draws frames of a sequence, all at the same scale, with one colour bar.

    Triangles with a missing vertex are left out; remaining vertices without a triangle become dots.

    Args:
        reader: of the sequence.
        output: a PNG file; an existing file is replaced.
        numbers: of the frames, one or several; see :func:`evenly_spaced`.
        reference: of the true sequence, for errors.
        colour: see :class:`dynmesh.draw.heatmap.Heatmap`.
        range: see :class:`dynmesh.draw.heatmap.Heatmap`; with the same range, pictures of several
            sequences can be compared.
        title: the heading; None means the name of the file and, in a scene, of the mesh.
        up: "x", "y" or "z"; None means as the file states it, else z for a flat sheet, else y.
        azimuth: viewing angle around the up axis, in degrees.
        size: of each frame, in pixels.
        watch: called with the frames and their number; it must pass the frames on.

    Raises:
        OSError: the file cannot be written.
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
    chosen = (frame for number in numbers for frame in _frame(heatmap, number))
    frames = list(watch(chosen, len(numbers)))
    seen = np.concatenate([frame.points[frame.visible] for frame in frames])
    if not len(seen):
        raise ValueError(f"{reader.path}: no vertex is known in these frames")
    scale = heatmap.scale(heatmap.colour, frames)
    up = up or likely_up(next(iter(reader)).points, stated_up(reader, reference))
    view = View.of(seen, up, azimuth, size)
    images = figures.cropped(
        [_draw(reader, frame, frame.values.get(heatmap.colour), scale, view) for frame in frames]
    )
    captions = [f"frame {frame.number}" for frame in frames]
    sheet = contact_sheet(title or reader.title, images, captions, scale)
    sheet.save(output, format="PNG")


def _frame(heatmap: Heatmap, number: int) -> Iterable[ShownFrame]:
    return heatmap.frames(range(number, number + 1))


def _draw(
    reader: Reader, frame: ShownFrame, values: Values | None, scale: Scale | None, view: View
) -> Image:
    faces, alone = whole_faces(reader.faces, frame.visible)
    places = np.zeros(len(frame.points), np.float32)
    if scale is not None and values is not None:
        places = np.where(frame.visible, scale.position(values), 0)
    return figures.render(
        faces,
        np.where(frame.visible[:, None], frame.points, 0),
        view,
        places=places,
        colours=(SURFACE_COLOUR,) if scale is None else scale.colours,
        dots=alone,
    )
