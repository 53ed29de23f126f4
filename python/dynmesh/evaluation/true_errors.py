"""The errors of a completed sequence, frame by frame, in constant memory."""

import math
from collections.abc import Iterator
from dataclasses import astuple, dataclass
from itertools import islice, repeat
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .. import metrics
from .._errors import InputError, locating
from .._progress import tracked
from ..formats.comparison import check_comparable, check_same_size
from ..formats.times import indices_of
from ..frame import Frame, Frames, check_whole
from .calibration import Calibrating, Calibration

_FRAMES_AT_ONCE = 32  # measured together, because each call builds the cells anew

Only: TypeAlias = Literal["all", "missing"]


@dataclass(frozen=True)
class FrameErrors:
    """Errors of a frame, in bounding-box diagonals of frame 0 of the reference.

    Attributes:
        frame: its number in the file of the completed sequence.
        vertices: the number of vertices that were measured.
        nmsve: the normalised mean square visual error (eq. 5), of all vertices.
        mean: the mean distance between vertices and their true positions; NaN if there are none.
        rms: the root mean square of the distances.
        p99: the 99th percentile of the distances.
        maximum: the largest distance.
    """

    frame: float
    vertices: int
    nmsve: float
    mean: float
    rms: float
    p99: float
    maximum: float


def measured(
    completed: Frames,
    reference: Frames,
    partial: Frames | None,
    only: Only,
    frames: slice | range | None,
    progress: bool | None,
) -> tuple[list[FrameErrors], float, Calibration | None]:
    """Returns the errors of each frame, their unit, and how well standard errors describe them.

    The arguments and errors are those of :func:`dynmesh.evaluate`.
    """
    check_comparable(completed, reference)
    check_same_size(completed, reference)
    numbers = range(1, reference.n_frames) or range(1)
    if frames is not None:
        numbers = indices_of(completed.header.numbers, frames)
    unit = _diagonal(reference)
    calibrating = Calibrating()
    of_positions = completed.header.standard_error_of == "position"
    each: list[FrameErrors] = []
    ours_read = tracked(_whole(completed, numbers), len(numbers), "measuring", progress)
    truths, observed = _whole(reference, numbers), _observed(partial, numbers)
    rows = zip(numbers, ours_read, truths, observed, strict=True)
    while stretch := list(islice(rows, _FRAMES_AT_ONCE)):
        ours = np.stack([frame.points for _, frame, _, _ in stretch])
        truth = np.stack([true.points for _, _, true, _ in stretch])
        nmsve = metrics.nmsve(reference.faces, truth, ours)
        distances = metrics.vertex_error(truth, ours)
        for (number, frame, _, there), visual, error in zip(stretch, nmsve, distances, strict=True):
            bars, generation = frame.standard_error, frame.generation
            missing = generation != 0 if there is None else ~there
            counted = error if only == "all" else error[missing]
            each.append(_errors_of(completed.header.number(number), float(visual), counted, unit))
            if of_positions and bars is not None and generation is not None:
                calibrating.add(error, bars, filled=generation > 0, generation=generation)
    if not any(errors.vertices for errors in each):
        raise InputError("no vertex was missing in these frames", file=completed.path)
    return each, unit, calibrating.result()


def suspicions(completed: Frames, reference: Frames) -> Iterator[str]:
    """Yields what is probably wrong with the choice of the sequences."""
    if reference.header.has_provenance and not completed.header.has_provenance:
        yield (
            "the reference holds generations, and the completed sequence holds none: were they "
            "exchanged? The completed one comes first"
        )
    ours, truth = completed.header, reference.header
    for frame in range(ours.n_frames):
        if ours.number(frame) != truth.number(frame):
            which = f"frame {frame} from the first on" if frame else "the first frame"
            yield (
                f"{which} of {completed.path.name} is number {ours.number(frame)}, and that of "
                f"{reference.path.name} is {truth.number(frame)}: frames are compared in their "
                "order"
            )
            return


def _diagonal(reference: Frames) -> float:
    (first,) = _whole(reference, range(1))
    unit = metrics.bounding_box_diagonal(first.points)
    if unit == 0:
        raise InputError(
            "all vertices are at one point", file=reference.path, frame=reference.header.number(0)
        )
    return unit


def _observed(partial: Frames | None, numbers: range) -> Iterator[NDArray[np.bool_] | None]:
    """The vertices that were observed in each frame; None where nothing says so."""
    if partial is None:
        return repeat(None, len(numbers))
    frames = partial.frames(numbers.start, numbers.stop, numbers.step)
    if partial.header.has_known:
        return (frame.observed for frame in frames)
    return (frame.observed & frame.points.any(axis=1) for frame in frames)


def _errors_of(
    number: float, visual: float, distances: NDArray[np.floating], unit: float
) -> FrameErrors:
    result = astuple(metrics.summary(distances)) if len(distances) else [math.nan] * 4
    return FrameErrors(number, len(distances), visual / unit, *(x / unit for x in result))


def _whole(reader: Frames, numbers: range) -> Iterator[Frame]:
    frames = reader.frames(numbers.start, numbers.stop, numbers.step)
    for number, frame in zip(numbers, frames, strict=True):
        with locating(file=reader.path, frame=reader.header.number(number)):
            check_whole(frame, "; the error is measured between complete sequences")
        yield frame
