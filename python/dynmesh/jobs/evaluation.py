"""The error of a whole completed sequence, measured in constant memory."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np

from .. import metrics
from ..calibration import Calibrating, Calibration, estimated
from ..files import Frame, Reader
from ..frames.reader import check_comparable
from .true_surface import TrueSurface

_FRAMES_AT_ONCE = 32  # measured together, because each call builds the cells anew


@dataclass(frozen=True)
class Evaluation:
    """Errors in bounding-box diagonals of frame 0 of the reference; frame 0 itself is left out.

    Attributes:
        nmsve: the normalised mean square visual error (eq. 5), mean over the frames.
        mean: the mean distance between vertices and their true positions.
        rms: the root mean square of the distances in a frame, mean over the frames.
        p99: the 99th percentile of the distances in a frame, mean over the frames.
        maximum: the largest distance.
        frames: the number of frames that were measured.
        bounding_box_diagonal: the diagonal, in the unit of the positions.
        calibration: how well the standard errors of the completed sequence describe its errors;
            None if it has none.
    """

    nmsve: float
    mean: float
    rms: float
    p99: float
    maximum: float
    frames: int
    bounding_box_diagonal: float
    calibration: Calibration | None


def evaluate(completed: Reader, reference: Reader, frames: Iterable[Frame]) -> Evaluation:
    """Compare two sequences frame by frame.

    Args:
        completed: the completed sequence.
        reference: the true sequence, with the same mesh and number of frames.
        frames: the frames of `completed`, which a caller may wrap to show progress.

    Raises:
        ValueError: the two do not have the same mesh and number of frames, have no frame after
            frame 0, or a position is missing or not finite. The message names the file.
    """
    check_comparable(completed, reference)
    pairs = zip(_whole(frames, completed), _whole(reference, reference), strict=True)
    kind = completed.header.standard_error_of
    calibrating = Calibrating(kind)
    surface = TrueSurface(reference.faces, reference.n_vertices) if kind == "surface" else None
    first = next(pairs)[1].points
    unit = metrics.bounding_box_diagonal(first)
    if unit == 0:
        raise ValueError(f"{reference.path}: all vertices of frame 0 are at one point")
    nmsve: list[float] = []
    errors: list[metrics.ErrorSummary] = []
    while stretch := list(islice(pairs, _FRAMES_AT_ONCE)):
        ours, truth = (
            np.stack([frame.points for frame in side]) for side in zip(*stretch, strict=True)
        )
        nmsve.extend(metrics.nmsve(reference.faces, truth, ours))
        of_vertices = metrics.vertex_error(truth, ours)
        errors.extend(metrics.summary(e) for e in of_vertices)
        for (frame, true), error in zip(stretch, of_vertices, strict=True):
            if frame.standard_error is not None and frame.generation is not None:
                if surface is not None:
                    error = surface.distances(frame.points, true.points)
                calibrating.add(
                    error,
                    frame.standard_error,
                    filled=estimated(frame.generation, kind),
                    generation=frame.generation,
                    age=frame.age,
                )
    return Evaluation(
        nmsve=float(np.mean(nmsve)) / unit,
        mean=float(np.mean([e.mean for e in errors])) / unit,
        rms=float(np.mean([e.rms for e in errors])) / unit,
        p99=float(np.mean([e.p99 for e in errors])) / unit,
        maximum=max(e.maximum for e in errors) / unit,
        frames=len(errors),
        bounding_box_diagonal=unit,
        calibration=calibrating.result(),
    )


def _whole(frames: Iterable[Frame], reader: Reader) -> Iterator[Frame]:
    for number, frame in enumerate(frames):
        missing = ~np.isfinite(frame.points).all(axis=1)
        if frame.known is not None:
            missing |= ~frame.known
        if missing.any():
            raise ValueError(
                f"{reader.path}: frame {number} lacks vertex {np.flatnonzero(missing)[0]}; "
                "the error is measured between complete sequences"
            )
        yield frame
