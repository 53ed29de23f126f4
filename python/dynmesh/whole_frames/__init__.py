"""Whole frames, put together from frames none of which need be whole.

The steps are those of docs/method.md, "A whole frame out of incomplete ones". The constants were
chosen by trials on recorded and simulated sequences.
"""

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from .. import _arrays
from .._arrays import Mask, Positions
from .._checks import check_flags, check_integer, check_positive
from .._errors import DynmeshError, InputError
from .._report import steps
from ..frame import Frames, check_any
from ..polygons import Faces
from ..sequence import Sequence
from .trips import completed_base, standard_errors
from .window import Mesh, best_frame, survey, usual_lengths, window_around, without_outliers

__all__ = ["WholeFrame", "whole_frame"]


@dataclass(frozen=True, eq=False)
class WholeFrame:
    """What :func:`dynmesh.whole_frames.whole_frame` returns.

    Attributes:
        positions: (k, 3), with the dtype of the frames.
        known: (k,) bool, whether the frame itself knows the vertex; with `outliers`, false for
            those that were left out.
        seen: (k,) bool, whether the vertex is known in at least one frame, this one included.
        standard_error: (k,) of a coordinate, in the unit of the positions, as
            :attr:`dynmesh.Completer.standard_error`: 0 where the frame knows the vertex exactly,
            infinity where no chain of edges ties it to a vertex that the frame knows.
        frame: the frame that was made whole, counted from 0.
        doubtful: whether the result is probably wrong, because its edges are far from the lengths
            that they have where frames know both ends. The frames may not belong together.
    """

    positions: Positions
    known: Mask
    seen: Mask
    standard_error: NDArray[np.floating[Any]]
    frame: int
    doubtful: bool


def whole_frame(
    faces: Faces,
    frames: Positions | Frames,
    known: NDArray[np.bool_] | None = None,
    *,
    frame: int | Literal["best"] = "best",
    noise: float | None = None,
    outliers: bool = False,
    threads: int = 1,
    progress: bool | None = None,
) -> WholeFrame:
    """Puts a whole frame together out of frames of which none need be whole.

    A completer is sent out from a smooth surface through the known vertices of the frame to both
    ends of the sequence and back, five times or more, each time from a frame that the last trip has
    made better. A :class:`dynmesh.Completer` can then start from the result. The time is about that
    of completing the sequence five to ten times with `learn` and `uncertainty`. Of more than 250
    frames, the nearest thirty on each side are used, and then fewer and fewer. At most 300 frames
    are kept in memory, and the frames are read twice.

    Args:
        faces: (m, 3) integers, or other polygons; see :data:`dynmesh.polygons.Faces`.
        frames: an array (n, k, 3), a :class:`dynmesh.Sequence`, or a file as :func:`dynmesh.open`
            returns it. Rows that are not finite are missing.
        known: (n, k) bool; None for the masks of the sequence or of the file, if it has any.
        frame: the frame that is made whole, counted from 0, or "best" for the one that knows most
            vertices; of several, that nearest to the middle.
        noise: the standard deviation of the noise of known positions, in their unit. With it, known
            vertices are smoothed by what other frames know of them; otherwise, they are exact.
        outliers: whether known positions that contradict the lengths of the edges around them, as
            other frames know them, count as missing.
        threads: the number of threads that may work; more than one helps from 23 553 vertices on.
        progress: whether to show on standard error how far it is.
    """
    number = None if isinstance(frame, str) and frame == "best" else frame
    if number is not None:
        check_integer("frame", number, 0)
    if noise is not None:
        check_positive("noise", noise)
    check_flags(outliers=outliers)
    check_integer("threads", threads, 1, 256)
    reader = _frames_of(faces, frames, known)
    check_any(reader)
    if number is not None and number >= reader.n_frames:
        message = f"must be less than the number of frames, which is {reader.n_frames}"
        raise InputError(f"{message}, not {number}", argument="frame", value=number)
    mesh = Mesh(_arrays.triangles(faces, reader.n_vertices), reader.n_vertices)
    with steps("putting a whole frame together", progress) as show:
        counts, seen = survey(reader)
        window = window_around(reader, best_frame(counts) if number is None else number)
        if outliers:
            before = window.seen()
            window.known = without_outliers(mesh, window)
            # Vertices of which only outliers were known in these frames do not count as seen.
            seen &= window.seen() | ~before
        if not window.known.any():
            raise InputError("no vertex is known in any of them", argument="frames")
        here, usual = window.known[window.base], usual_lengths(window, mesh.edges)
        settings = {"noise": noise, "threads": threads}
        made = completed_base(mesh, window, usual, settings, show)
        errors = standard_errors(mesh, here, usual, made, noise is not None)
    return WholeFrame(
        _arrays.packed(made.positions, reader.dtype),
        here,
        seen,
        _arrays.packed(errors, reader.dtype),
        window.numbers[window.base],
        made.is_doubtful,
    )


def _frames_of(faces: Faces, frames: Positions | Frames, known: NDArray[np.bool_] | None) -> Frames:
    if isinstance(frames, Sequence):
        own = frames if known is None else replace(frames, known=known)
        return own.named("frames")
    if isinstance(frames, Frames):
        if known is not None:
            raise InputError("is that of the file; open it with masks", argument="known")
        return frames
    try:
        of_any_kind: Any = faces
        return Sequence(frames, of_any_kind, known).named("frames")
    except DynmeshError as error:
        error.argument = "frames" if error.argument == "vertices" else error.argument
        raise
