"""The error of a whole completed sequence, measured in constant memory."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np

from .. import metrics
from ..files import Frame, Reader
from ..files.reader import check_comparable
from ..sequence import Positions

_frames_at_once = 32  # the cells are made anew for every stretch of frames


@dataclass(frozen=True)
class Evaluation:
    """Errors in bounding-box diagonals of the reference's frame 0, which itself is left out.

    Attributes:
        nmsve: mean over the frames of the normalised mean square visual error (eq. 5).
        mean: of the distances between vertices and their true positions.
        rms: root mean square of the distances in a frame, mean over the frames.
        p99: 99th percentile of the distances in a frame, mean over the frames.
        maximum: the largest distance of all.
        frames: how many were measured.
        bounding_box_diagonal: in the unit of the positions.
    """

    nmsve: float
    mean: float
    rms: float
    p99: float
    maximum: float
    frames: int
    bounding_box_diagonal: float


def evaluate(completed: Reader, reference: Reader, frames: Iterable[Frame]) -> Evaluation:
    """Compares two sequences frame by frame.

    Args:
        completed: what was filled in.
        reference: the truth, of the same mesh and number of frames.
        frames: those of `completed`, so that a caller can watch them go by.

    Raises:
        ValueError: the two do not fit together, have no frame but the first, or a position is
            missing or not finite; the message names the file.
    """
    check_comparable(completed, reference)
    pairs = zip(_whole(frames, completed), _whole(reference, reference), strict=True)
    _, first = next(pairs)
    unit = metrics.bounding_box_diagonal(first)
    if unit == 0:
        raise ValueError(f"{reference.path}: all vertices of frame 0 are at one point")
    nmsve: list[float] = []
    errors: list[metrics.ErrorSummary] = []
    while stretch := list(islice(pairs, _frames_at_once)):
        ours, truth = (np.stack(side) for side in zip(*stretch, strict=True))
        nmsve.extend(metrics.nmsve(reference.faces, truth, ours))
        errors.extend(metrics.summary(e) for e in metrics.vertex_error(truth, ours))
    return Evaluation(
        nmsve=float(np.mean(nmsve)) / unit,
        mean=float(np.mean([e.mean for e in errors])) / unit,
        rms=float(np.mean([e.rms for e in errors])) / unit,
        p99=float(np.mean([e.p99 for e in errors])) / unit,
        maximum=max(e.maximum for e in errors) / unit,
        frames=len(errors),
        bounding_box_diagonal=unit,
    )


def _whole(frames: Iterable[Frame], reader: Reader) -> Iterator[Positions]:
    for number, frame in enumerate(frames):
        missing = ~np.isfinite(frame.points).all(axis=1)
        if frame.known is not None:
            missing |= ~frame.known
        if missing.any():
            raise ValueError(
                f"{reader.path}: frame {number} lacks vertex {np.flatnonzero(missing)[0]}; "
                "errors are measured between whole sequences"
            )
        yield frame.points
