"""The error of a whole completed sequence."""

import contextlib
from collections.abc import Iterable

import numpy as np

from .._checks import check_choice
from .._errors import InputError
from .._options import Input
from ..evaluation import Evaluation, Only, measured, suspicions
from ..formats import OneSequence, PathLike, Source, opened
from ..formats.comparison import check_comparable, remarks_of
from ..frame import Frames
from ..polygons import Faces


def evaluate(
    completed: OneSequence,
    reference: OneSequence,
    *,
    faces: Input[Faces | PathLike | None] = None,
    frames: Input[slice | range | None] = None,
    only: Input[Only] = "all",
    input: Input[OneSequence | None] = None,
    prim: Input[str | Iterable[str] | None] = None,
    progress: bool | None = None,
) -> Evaluation:
    """Measures the error of a completed sequence, frame by frame.

    NMSVE is the normalised mean square visual error of the paper; printed, it is multiplied by 1e4,
    as in the documentation. The others are distances between vertices and their true positions:
    mean, root mean square and 99th percentile of a frame, averaged over the frames, and the overall
    maximum. All are in bounding-box diagonals of the first frame of the reference. Standard errors
    of positions, if the completed sequence has them, are compared with the errors.

    Args:
        completed: the completed sequence.
        reference: the true sequence, with the same mesh and number of frames.
        frames: from the number of the first frame to measure to that after the last one, such as
            1001:1050, in the completed sequence; else, all after the first frame, or the only one.
        only: "missing" measures the distances of vertices that were not observed, as the sequence
            that was completed says, or else the generations of the completed one.
        input: the sequence that was completed; only its missing vertices matter. Without masks,
            they are those that are not finite or at exactly (0, 0, 0).
        faces: of positions alone; or a mesh file that provides the faces of those of the files that
            hold none.
        prim: the path of the mesh in those of the files that hold several (USD, Alembic), or of
            several, or "all".
        progress: whether to show on standard error how far it is.
    """
    check_choice("only", only, Only)
    source: Source = {"faces": faces, "prim": prim}
    with contextlib.ExitStack() as stack:
        ours, truth = (
            stack.enter_context(opened(sequence, name, source))
            for sequence, name in ((completed, "completed"), (reference, "reference"))
        )
        observed: Frames | None = None
        if input is not None:
            observed = stack.enter_context(opened(input, "input", source))
            check_comparable(observed, truth)
        elif only == "missing" and not ours.header.has_provenance:
            raise InputError(
                f"is needed, as {ours.path} says of no vertex whether it was observed; or complete "
                "that with `provenance`",
                argument="input",
            )
        each, unit, calibration = measured(ours, truth, observed, only, frames, progress)
        remarks = (*suspicions(ours, truth), *remarks_of(ours, truth, observed))
    counted = [errors for errors in each if errors.vertices]
    mean, rms, p99 = np.mean(
        [(errors.mean, errors.rms, errors.p99) for errors in counted], axis=0
    ).tolist()
    return Evaluation(
        nmsve=float(np.mean([errors.nmsve for errors in each])),
        mean=mean,
        rms=rms,
        p99=p99,
        maximum=max(errors.maximum for errors in counted),
        frames=len(counted),
        bounding_box_diagonal=unit,
        calibration=calibration,
        each=tuple(each),
        remarks=remarks,
    )
