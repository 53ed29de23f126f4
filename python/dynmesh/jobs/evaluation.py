"""The error of a whole completed sequence, measured in constant memory."""

import contextlib
import csv
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import astuple, dataclass, fields
from itertools import islice, repeat
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .. import files, metrics
from .._errors import InputError
from ..calibration import Calibrating, Calibration, estimated
from ..diagnosis.presence import observed_in
from ..files import Frame, OneSequence, PathLike, Reader
from ..files.reader import check_comparable
from ..files.times import frame_numbers, indices_of
from .true_surface import TrueSurface

_FRAMES_AT_ONCE = 32  # measured together, because each call builds the cells anew

Watch: TypeAlias = Callable[[Iterable[Frame], int], Iterable[Frame]]
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


@dataclass(frozen=True)
class Evaluation:
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
    each: tuple[FrameErrors, ...] = ()

    def write_csv(self, path: PathLike) -> None:
        """Writes a table with a row for each frame."""
        with Path(path).open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(field.name for field in fields(FrameErrors))
            writer.writerows(astuple(errors) for errors in self.each)


def evaluate(
    completed: OneSequence,
    reference: OneSequence,
    *,
    frames: slice | range | None = None,
    only: Only = "all",
    partial: OneSequence | None = None,
    template: PathLike | None = None,
    watch: Watch = lambda frames, _: frames,
) -> Evaluation:
    """Compares two sequences frame by frame.

    Args:
        completed: the completed sequence: a file, a reader or a sequence in memory.
        reference: the true sequence, with the same mesh and number of frames.
        frames: a slice or range such as ``range(1001, 1050)``: the numbers, in the completed
            sequence, of the first frame to measure and of the one after the last; None means all
            after the first frame.
        only: "missing" measures the distances of vertices that were not observed in their frame, as
            `partial` says, or else the generations in `completed`. "all" measures all vertices.
        partial: the sequence that was completed; only its missing vertices matter.
        template: a mesh file that provides the faces of those of the files that hold none.
        watch: called with the frames of `completed` and their number, and must pass them on.

    Raises:
        OSError, ImportError, TypeError: a file cannot be read.
        ValueError: the sequences do not have the same mesh and number of frames, no frame is to be
            measured, a position is missing or not finite, or nothing says which vertices were
            missing. The message names the file.
    """
    if only not in ("all", "missing"):
        raise InputError(f"must be 'all' or 'missing', not {only!r}", argument="only")
    with contextlib.ExitStack() as stack:
        ours, truth = (
            stack.enter_context(files.opened(given, name, template))
            for given, name in ((completed, "completed"), (reference, "reference"))
        )
        observed: Reader | None = None
        if partial is not None:
            observed = stack.enter_context(files.opened(partial, "partial", template))
            check_comparable(observed, truth)
        elif only == "missing" and not ours.has_provenance:
            raise InputError(
                "says of no vertex whether it was observed; give the sequence that was completed "
                "(--input, in Python partial=), or complete it with --provenance",
                file=ours.path,
            )
        return _evaluate(ours, truth, observed, only, frames, watch)


def _evaluate(
    completed: Reader,
    reference: Reader,
    partial: Reader | None,
    only: Only,
    frames: slice | range | None,
    watch: Watch,
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
    rows = zip(
        numbers,
        _whole(watch(_frames(completed, numbers), len(numbers)), numbers, completed),
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
        raise ValueError(
            f"{reference.path}: all vertices of frame {reference.header.number(0)} are at one point"
        )
    return unit


def _frames(reader: Reader, numbers: range) -> Iterator[Frame]:
    return reader.frames(numbers.start, numbers.stop, numbers.step)


def _observed(frames: Iterator[Frame] | None, n: int) -> Iterator[NDArray[np.bool_] | None]:
    """The vertices that were observed in each frame; None where nothing says so."""
    if frames is None:
        return repeat(None, n)
    return map(observed_in, frames)


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
    missing = np.flatnonzero(~observed_in(frame))
    if len(missing):
        raise ValueError(
            f"{reader.path}: frame {reader.header.number(number)} lacks vertex {missing[0]}; "
            "the error is measured between complete sequences"
        )
