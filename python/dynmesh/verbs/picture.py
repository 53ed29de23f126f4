"""Pictures of sequences."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from .._checks import check_integer, check_text
from .._errors import InputError, require
from .._options import Input, Method, Output
from .._report import tracked
from ..draw.figures import View, cropped, load_pyvista
from ..draw.heatmap import Alone, Heatmap, stated_up
from ..draw.picture import centred, contact_sheet, drawn, evenly_spaced
from ..draw.scales import range_of
from ..formats import OneSequence, Source, opened_together
from ..formats.conversion import remarks_of
from ..formats.times import called, index_of
from ..frame import frame_at
from ..header import Axis
from ..topology import assumed, likely_up

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

    Returns:
        A picture, which shows itself in a notebook; its `save` writes it to a file, and its `info`
        has the remarks that commands print.
    """
    check_integer("size", size, 16)
    check_integer("count", count, 1)
    if title is not None:
        check_text("title", title)
    shown_range = range_of(colour_range)
    with opened_together(source or {}, sequence=sequence, reference=reference) as (own, truth):
        if frames is None:
            indices = evenly_spaced(own.n_frames, count)
        else:
            numbers = frames if isinstance(frames, Iterable) else [frames]
            indices = [index_of(own.header, number, "frames") for number in numbers]
        require("PIL.Image", extra="view")
        load_pyvista()
        if truth is not None and colour not in (None, "error", "standard_error"):
            raise InputError(
                f"requires the colour error or standard_error, not {colour}", argument="reference"
            )
        heatmap = Heatmap(own, reference=truth, colour_range=shown_range, wanted=colour)
        each = (one for index in indices for one in heatmap.frames(range(index, index + 1)))
        shown = list(tracked(each, len(indices), "reading", progress))
        seen = [frame.points[frame.visible] for frame in shown if frame.visible.any()]
        if not seen:
            raise InputError("no vertex is known in these frames", file=own.path)
        scale = heatmap.scale(heatmap.colour, shown)
        said = up or stated_up(own, truth)
        upwards = said or likely_up(frame_at(own, 0).points, None)
        every = own.header.numbers.tolist()
        captions = [called(every[frame.number], every) for frame in shown]
        view = View.of(np.concatenate([*map(centred, seen)]), upwards, azimuth, (size, size))
        images = cropped([drawn(heatmap, frame, scale, view) for frame in shown])
        guess = "" if said else assumed(upwards)
        heading = title or own.path.name
        result: Image.Image = contact_sheet(heading, images, captions, scale, guess)
        result.info["remarks"] = (*filter(None, [guess]), *remarks_of(own, truth))
    return result
