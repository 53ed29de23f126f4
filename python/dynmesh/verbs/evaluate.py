"""The error of a whole completed sequence."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import islice, repeat
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .. import metrics
from .._checks import check_choice, path_of
from .._errors import InputError, locating
from .._options import Input
from .._report import Report, counted, tracked, write_csv
from ..formats import OneSequence, PathLike, Source, opened_together
from ..formats.conversion import check_same_size, comparable, remarks_of
from ..formats.times import indices_of
from ..frame import Frame, Frames, Indices, check_whole
from ..polygons import Faces

Floats = NDArray[np.floating[Any]]


WITHIN_50, WITHIN_90 = 1.538, 2.5
"""The standard errors of a coordinate within which these shares of the distances lie: the roots of
the quantiles of a chi-squared distribution with three degrees of freedom."""


@dataclass(frozen=True)
class Calibration:
    """How well standard errors describe true errors, over the filled-in vertices of all frames.

    Attributes:
        vertices: the number of filled-in vertices with a finite standard error, over all frames.
        coverage_50: the share of them whose error is at most 1.538 standard errors: 0.5 if the
            standard errors are right.
        coverage_90: the same for 2.5 standard errors: 0.9.
        rms_ratio: the root mean square error over the root mean square standard error of a
            position, which is that of a coordinate times the root of 3: 1, and more if the standard
            errors are too small. NaN if all of them are 0.
    """

    vertices: int
    coverage_50: float
    coverage_90: float
    rms_ratio: float


class Calibrating:
    """Gathers a :class:`Calibration`, one frame at a time."""

    def __init__(self) -> None:
        self._vertices = 0
        self._within = dict.fromkeys((WITHIN_50, WITHIN_90), 0)
        self._errors = self._expected = 0.0

    def add(self, error: Floats, standard_error: Floats, *, filled: NDArray[np.bool_]) -> None:
        """Adds the (k,) distances of a frame from the true positions, where they were filled in.

        Vertices without a finite standard error, in the same unit, are left out.
        """
        counted = filled & np.isfinite(standard_error)
        off = error[counted].astype(np.float64)
        bars = standard_error[counted].astype(np.float64)
        self._vertices += len(off)
        for factor in self._within:
            self._within[factor] += int(np.count_nonzero(off <= factor * bars))
        self._errors += float(off @ off)
        self._expected += 3 * float(bars @ bars)

    def result(self) -> Calibration | None:
        """Returns what was found, or None if no vertex was filled in."""
        if self._vertices == 0:
            return None
        ratio = math.sqrt(self._errors / self._expected) if self._expected > 0 else math.nan
        half, most = (within / self._vertices for within in self._within.values())
        return Calibration(self._vertices, half, most, ratio)


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
    places = comparable(completed, reference)
    check_same_size(completed, reference)
    numbers: Indices = [index for index, place in enumerate(places) if place > 0] or [0]
    if frames is not None:
        numbers = indices_of(completed.header.numbers, frames)
    unit = _diagonal(reference)
    calibrating = Calibrating()
    of_positions = completed.header.standard_error_of == "position"
    each: list[FrameErrors] = []
    ours_read = tracked(_whole(completed, numbers), len(numbers), "measuring", progress)
    truths = _whole(reference, [places[number] for number in numbers])
    observed = _observed(partial, completed, numbers)
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
                calibrating.add(error, bars, filled=generation > 0)
    if not any(errors.vertices for errors in each):
        raise InputError("no vertex was missing in these frames", file=completed.path)
    return each, unit, calibrating.result()


def other_numbers(completed: Frames, reference: Frames) -> Iterator[str]:
    """Yields how the numbers of the frames differ."""
    ours, truth = completed.header, reference.header
    if ours.n_frames < truth.n_frames:
        yield (
            f"of the {truth.n_frames} frames of {reference.path.name}, those are compared that "
            f"have the numbers of the {ours.n_frames} of {completed.path.name}"
        )
        return
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
    (first,) = _whole(reference, [0])
    unit = metrics.bounding_box_diagonal(first.points)
    if unit == 0:
        raise InputError(
            "all vertices are at one point", file=reference.path, frame=reference.header.number(0)
        )
    return unit


def _observed(
    partial: Frames | None, completed: Frames, numbers: Indices
) -> Iterator[NDArray[np.bool_] | None]:
    """The vertices that were observed in each frame; None where nothing says so."""
    if partial is None:
        return repeat(None, len(numbers))
    places = comparable(completed, partial)
    frames = partial.frames_at([places[number] for number in numbers])
    if partial.header.has_known:
        return (frame.observed for frame in frames)
    return (frame.observed & frame.points.any(axis=1) for frame in frames)


def _errors_of(
    number: float, visual: float, distances: NDArray[np.floating], unit: float
) -> FrameErrors:
    result = [math.nan] * 4
    if len(distances):
        rms, p99 = np.sqrt(np.mean(distances**2)), np.percentile(distances, 99)
        result = [float(one) for one in (distances.mean(), rms, p99, distances.max())]
    return FrameErrors(number, len(distances), visual / unit, *(one / unit for one in result))


def _whole(reader: Frames, numbers: Indices) -> Iterator[Frame]:
    for number, frame in zip(numbers, reader.frames_at(numbers), strict=True):
        with locating(file=reader.path, frame=reader.header.number(number)):
            check_whole(frame, "; the error is measured between complete sequences")
        yield frame


@dataclass(frozen=True, kw_only=True)
class Evaluation(Report):
    """Errors in bounding-box diagonals of frame 0 of the reference.

    Attributes:
        nmsve: the normalised mean square visual error (eq. 5), mean over the frames.
        mean: the mean distance between vertices and their true positions.
        rms: the root mean square of the distances in a frame, mean over the frames.
        p99: the 99th percentile of the distances in a frame, mean over the frames.
        maximum: the largest distance.
        frames: the number of frames in which vertices were measured.
        bounding_box_diagonal: the diagonal, in the unit of the positions.
        calibration: how well the standard errors of the completed sequence describe its errors;
            None if it has none of positions.
        each: the errors of each frame.
    """

    nmsve: float
    mean: float
    rms: float
    p99: float
    maximum: float
    frames: int
    bounding_box_diagonal: float
    calibration: Calibration | None
    each: tuple[FrameErrors, ...] = field(default=(), repr=False)

    def lines(self) -> list[str]:
        """Says how large the errors are."""
        rows = {
            "NMSVE x 1e4": f"{1e4 * self.nmsve:.4g}",
            "mean error": f"{self.mean:.4g}, root mean square {self.rms:.4g}",
            "99th percentile": f"{self.p99:.4g}",
            "maximum": f"{self.maximum:.4g}",
            "measured": f"{counted(self.frames, 'frame')}, in bounding-box diagonals of the first, "
            f"{self.bounding_box_diagonal:g}",
        }
        if (result := self.calibration) is not None:
            rows["standard errors"] = (
                f"the 90 % interval holds {100 * result.coverage_90:.3g} % of the errors, the 50 % "
                f"interval {100 * result.coverage_50:.3g} %"
            )
        return [f"{name:18}{value}" for name, value in rows.items()] + super().lines()

    def write_csv(self, path: PathLike) -> None:
        """Writes a table with a row for each frame."""
        write_csv(path_of("path", path), FrameErrors, self.each)


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
        reference: the true sequence of the same mesh. Equally many frames are compared in their
            order; if it has more, the frames with the same numbers are.
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
    with opened_together(source, completed=completed, reference=reference, input=input) as (
        ours,
        truth,
        observed,
    ):
        if observed is None and only == "missing" and not ours.header.has_provenance:
            raise InputError(
                f"is needed, as {ours.path} says of no vertex whether it was observed; or complete "
                "that with `provenance`",
                argument="input",
            )
        each, unit, calibration = measured(ours, truth, observed, only, frames, progress)
        remarks = (*other_numbers(ours, truth), *remarks_of(ours, truth, observed))
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
