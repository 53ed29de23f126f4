"""The error of a whole completed sequence, measured in constant memory."""

import contextlib
import csv as table
import math
from collections.abc import Iterable, Iterator
from dataclasses import astuple, dataclass, field, fields
from itertools import islice, repeat
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .. import metrics
from .._checks import check_path
from .._command import Output, What
from .._errors import InputError
from .._progress import tracked
from .._report import Report, as_json
from ..calibration import Calibrating, Calibration, estimated
from ..files import Frame, OneSequence, PathLike, Reader, Source, opened_beside
from ..files.new_output import check_output, new_output
from ..files.reader import check_comparable
from ..files.times import frame_numbers, indices_of
from ..true_surface import TrueSurface

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


@dataclass(frozen=True, kw_only=True)
class Evaluation(Report):
    """Errors in bounding-box diagonals of frame 0 of the reference.

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
            "measured": f"{self.frames} frames, in bounding-box diagonals of the first, "
            f"{self.bounding_box_diagonal:g}",
        }
        if (found := self.calibration) is not None:
            rows |= {
                "standard errors": f"of {_ERRORS_OF[found.standard_error_of]}; error / standard "
                f"error is {found.rms_ratio:.3g}, by root mean squares",
                "50 % interval": f"holds {100 * found.coverage_50:.3g} % of the errors",
                "90 % interval": f"holds {100 * found.coverage_90:.3g} % of the errors",
                "rank correlation": f"{_shown(found.rank_correlation)} with standard errors, "
                f"{_shown(found.generation_correlation)} with generations",
            }
        return [f"{name:18}{value}" for name, value in rows.items()] + super().lines()

    def to_dict(self) -> dict[str, Any]:
        """Returns the errors of the whole sequence as values that JSON has."""
        summary = {name: getattr(self, name) for name in ("mean", "rms", "p99", "maximum")}
        return {
            "nmsve": self.nmsve,
            "summary": summary,
            "frames": self.frames,
            "bounding_box_diagonal": self.bounding_box_diagonal,
            "standard_error": as_json(self.calibration),
        }

    def write_csv(self, path: PathLike) -> None:
        """Writes a table with a row for each frame."""
        with Path(path).open("w", newline="", encoding="utf-8") as file:
            writer = table.writer(file)
            writer.writerow(field.name for field in fields(FrameErrors))
            writer.writerows(astuple(errors) for errors in self.each)


_ERRORS_OF = {"position": "positions", "surface": "distances from the true surface"}


def _shown(correlation: float | None) -> str:
    return "none" if correlation is None else f"{correlation:.3g}"


def evaluate(
    completed: OneSequence,
    reference: OneSequence,
    *,
    frames: What[slice | range | None] = None,
    only: What[Only] = "all",
    partial: What[OneSequence | None] = None,
    template: What[PathLike | None] = None,
    prim: What[str | None] = None,
    csv: Output[PathLike | None] = None,
    overwrite: Output[bool] = False,
    progress: bool = False,
) -> Evaluation:
    """Measures the error of a completed sequence, frame by frame.

    NMSVE is the normalised mean square visual error of the paper; printed, it is multiplied by 1e4,
    as in the documentation. The others are distances between vertices and their true positions:
    mean, root mean square and 99th percentile of a frame, averaged over the frames, and the overall
    maximum. All are in bounding-box diagonals of the first frame of the reference. Standard errors,
    if the completed sequence has them, are compared with the errors that they describe.

    Args:
        completed: the completed sequence.
        reference: the true sequence, with the same mesh and number of frames.
        frames: from the number of the first frame to measure to that after the last one, such as
            1001:1050, in the completed sequence; all after the first frame if it is not given.
        only: "missing" measures the distances of vertices that were not observed, as the sequence
            that was completed says, or else the generations of the completed one.
        partial: the sequence that was completed; only its missing vertices matter.
        template: a mesh file that provides the faces of those of the files that hold none.
        prim: the path of the mesh in those of the files that hold several (USD, Alembic).
        csv: a file to write with a row for each frame.
        overwrite: whether to replace it if it exists.
        progress: whether to show a bar on standard error.

    Raises:
        OSError, ImportError, TypeError: a file cannot be read or written.
        ValueError: the sequences do not have the same mesh and number of frames, no frame is to be
            measured, a position is missing or not finite, or nothing says which vertices were
            missing.
    """
    if only not in ("all", "missing"):
        raise InputError(f"must be 'all' or 'missing', not {only!r}", argument="only", value=only)
    if csv is not None:
        check_path("csv", csv)
        check_output(Path(csv), overwrite, ".csv")
    source: Source = {"faces": template, "prim": prim}
    with contextlib.ExitStack() as stack:
        ours, truth = (
            stack.enter_context(opened_beside(given, name, source))
            for given, name in ((completed, "completed"), (reference, "reference"))
        )
        observed: Reader | None = None
        if partial is not None:
            observed = stack.enter_context(opened_beside(partial, "partial", source))
            check_comparable(observed, truth)
        elif only == "missing" and not ours.has_provenance:
            raise InputError(
                "says of no vertex whether it was observed; give the sequence that was completed, "
                "or complete it with provenance",
                file=ours.path,
            )
        found = _evaluate(ours, truth, observed, only, frames, progress)
    if csv is not None:
        with new_output(Path(csv), overwrite, ".csv") as made:
            found.write_csv(made)
    return found


def _evaluate(
    completed: Reader,
    reference: Reader,
    partial: Reader | None,
    only: Only,
    frames: slice | range | None,
    progress: bool,
) -> Evaluation:
    check_comparable(completed, reference)
    if reference.n_frames < 2:
        raise InputError("has no frame after the first to measure", file=reference.path)
    numbers = range(1, reference.n_frames)
    if frames is not None:
        numbers = indices_of(frame_numbers(completed.header), frames)
    unit = _diagonal(reference)
    kind = completed.header.standard_error_of
    calibrating = Calibrating(kind)
    surface = TrueSurface(reference.faces, reference.n_vertices) if kind == "surface" else None
    each: list[FrameErrors] = []
    ours_read = tracked(_frames(completed, numbers), len(numbers), "measuring", progress)
    rows = zip(
        numbers,
        _whole(ours_read, numbers, completed),
        _whole(_frames(reference, numbers), numbers, reference),
        _observed(_frames(partial, numbers) if partial is not None else None, len(numbers)),
        strict=True,
    )
    while stretch := list(islice(rows, _FRAMES_AT_ONCE)):
        ours = np.stack([frame.points for _, frame, _, _ in stretch])
        truth = np.stack([true.points for _, _, true, _ in stretch])
        nmsve = metrics.nmsve(reference.faces, truth, ours)
        distances = metrics.vertex_error(truth, ours)
        for (number, frame, true, there), visual, error in zip(
            stretch, nmsve, distances, strict=True
        ):
            measured = error if only == "all" else error[_missing(frame, there)]
            each.append(_errors_of(completed.header.number(number), float(visual), measured, unit))
            if frame.standard_error is not None and frame.generation is not None:
                if surface is not None:
                    error = surface.distances(frame.points, true.points)
                calibrating.add(
                    error,
                    frame.standard_error,
                    filled=estimated(frame.generation, kind),
                    generation=frame.generation,
                )
    counted = [errors for errors in each if errors.vertices]
    if not counted:
        raise InputError("no vertex was missing in these frames", file=completed.path)
    return Evaluation(
        nmsve=float(np.mean([errors.nmsve for errors in each])),
        mean=float(np.mean([errors.mean for errors in counted])),
        rms=float(np.mean([errors.rms for errors in counted])),
        p99=float(np.mean([errors.p99 for errors in counted])),
        maximum=max(errors.maximum for errors in counted),
        frames=len(each),
        bounding_box_diagonal=unit,
        calibration=calibrating.result(),
        each=tuple(each),
    )


def _diagonal(reference: Reader) -> float:
    with contextlib.closing(reference.frames(0, 1)) as frames:
        first = next(frames)
    _check_whole(0, first, reference)
    unit = metrics.bounding_box_diagonal(first.points)
    if unit == 0:
        raise InputError(
            "all vertices are at one point", file=reference.path, frame=reference.header.number(0)
        )
    return unit


def _frames(reader: Reader, numbers: range) -> Iterator[Frame]:
    return reader.frames(numbers.start, numbers.stop, numbers.step)


def _observed(frames: Iterator[Frame] | None, n: int) -> Iterator[NDArray[np.bool_] | None]:
    """The vertices that were observed in each frame; None where nothing says so."""
    if frames is None:
        return repeat(None, n)
    return (frame.observed for frame in frames)


def _missing(frame: Frame, observed: NDArray[np.bool_] | None) -> NDArray[np.bool_]:
    if observed is not None:
        return ~observed
    assert frame.generation is not None
    return np.asarray(frame.generation != 0)


def _errors_of(
    number: float, visual: float, distances: NDArray[np.floating], unit: float
) -> FrameErrors:
    if not len(distances):
        return FrameErrors(number, 0, visual / unit, *[math.nan] * 4)
    found = metrics.summary(distances)
    measured = (found.mean, found.rms, found.p99, found.maximum)
    return FrameErrors(number, len(distances), visual / unit, *(x / unit for x in measured))


def _whole(frames: Iterable[Frame], numbers: range, reader: Reader) -> Iterator[Frame]:
    for number, frame in zip(numbers, frames, strict=True):
        _check_whole(number, frame, reader)
        yield frame


def _check_whole(number: int, frame: Frame, reader: Reader) -> None:
    missing = np.flatnonzero(~frame.observed)
    if len(missing):
        raise InputError(
            f"lacks vertex {missing[0]}; the error is measured between complete sequences",
            file=reader.path,
            frame=reader.header.number(number),
        )
