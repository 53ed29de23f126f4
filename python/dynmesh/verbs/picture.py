"""Pictures of sequences."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

from .._checks import check_integer
from .._options import Input, Method, Output
from ..draw.heatmap import Alone, range_of
from ..draw.picture import drawn, evenly_spaced
from ..formats import OneSequence, Source
from ..formats.conversion import remarks_of
from ..formats.times import index_of
from ..header import Axis
from .view import opened_together

if TYPE_CHECKING:
    from PIL import Image


def picture(
    sequence: OneSequence,
    *,
    frames: Input[float | Iterable[float] | None] = None,
    count: Input[int] = 6,
    reference: Input[OneSequence | None] = None,
    source: Source | None = None,
    colour: Method[Alone | None] = None,
    colour_range: Method[str | tuple[float, float] | None] = None,
    title: Method[str | None] = None,
    up: Method[Axis | None] = None,
    azimuth: Method[float] = 60.0,
    size: Output[int] = 480,
    progress: bool | None = None,
) -> "Image.Image":
    """Draws frames of a sequence: one, or a contact sheet of several.

    In a notebook, a picture shows itself; its `save` writes it to a file. Its `info` has the
    remarks that commands print.

    Args:
        sequence: the sequence.
        frames: the number of a frame, or of several; else, `count` frames, evenly spaced.
        count: the number of frames, at most.
        reference: the true sequence; colours then show the error.
        source: how to read the sequence; faces and the mesh are those of the reference, too.
        colour: what colours show, as in a page: "error", "generation", "age", "standard_error",
            "known", "mesh", which names several meshes, or "plain".
        colour_range: the range of the colours of errors and standard errors, such as 0.1:10, in the
            unit in which they are shown; else, both have that of the errors.
        title: the heading; else, the name of the file.
        up: the up axis; else, as a file states it, or a guess.
        azimuth: the viewing angle around the up axis, in degrees.
        size: pixels of a frame, each way.
        progress: whether to show on standard error how far it is.
    """
    check_integer("size", size, 16)
    check_integer("count", count, 1)
    shown_range = range_of(colour_range)
    with opened_together(sequence, reference, None, source or {}) as (own, truth, _):
        if frames is None:
            indices = evenly_spaced(own.n_frames, count)
        else:
            numbers = frames if isinstance(frames, Iterable) else [frames]
            indices = [index_of(own.header, number, "frames") for number in numbers]
        result: Image.Image = drawn(
            own,
            indices=indices,
            reference=truth,
            colour=colour,
            colour_range=shown_range,
            title=title,
            up=up,
            azimuth=azimuth,
            size=size,
            progress=progress,
        )
        result.info["remarks"] = (*result.info["remarks"], *remarks_of(own, truth))
    return result
