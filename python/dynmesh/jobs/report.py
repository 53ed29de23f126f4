"""What the completion of a file has done."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .._core import Completer
from ..calibration import Distances, in_words
from ..frames.frame import Frame
from ..sequence import Mask

_COUNTED = ("known", "filled", "disconnected", "rejected")

LONG = 20
"""Frames after which a hidden part has lost its shape with method motion."""


@dataclass(frozen=True)
class FileReport:
    """What :func:`complete_file` has done.

    Attributes:
        frames: number of frames of the sequence, before they are resampled.
        seconds_per_frame: median time of :meth:`dynmesh.Completer.push`, without reading and
            writing; None if there was nothing to complete.
        known: number of known vertices, summed over the frames that this call completed. A whole
            frame from which completion starts is not among them.
        filled: number of vertices that were filled in.
        disconnected: number of vertices that no edges connected to a known one.
        rejected: number of vertices that were observed but treated as missing: see
            `reject_outliers`.
        remarks: remarks about the output for the user, one line each.
        completed: number of frames that this call completed.
        empty: number of them in which nothing was observed.
        hidden_long: number of vertices that were hidden for 20 frames or more; 0 with method
            detail, which keeps their shape.
        start: the number, in its file, of the whole frame from which completion started; None for a
            template.
        doubtful: whether that frame was put together from others and is probably wrong.
        prior_weight: with training, how far its poses were used, from 0 to 1, on average over the
            frames in which some vertices were known and others missing; None if there are none.
        prior_share: the share of the residual that the poses prior_share, over the same frames.
        within_90: with `uncertainty`, the distance within which 90 % of the vertices that were
            filled in are expected to be, in the unit of the positions; None if there are none.
        dropped: the number of vertices that were left missing, since their standard error exceeds
            `drop_above`.
    """

    frames: int
    seconds_per_frame: float | None
    known: int
    filled: int
    disconnected: int
    rejected: int
    remarks: tuple[str, ...] = ()
    completed: int = 0
    empty: int = 0
    hidden_long: int = 0
    start: float | None = None
    doubtful: bool = False
    prior_weight: float | None = None
    prior_share: float | None = None
    within_90: float | None = None
    dropped: int = 0


@dataclass
class Tally:
    """Adds up the reports of the frames that a method completed."""

    method: str
    trained: bool = False
    seconds: list[float] = field(default_factory=list)
    counts: Counter[str] = field(default_factory=lambda: Counter(dict.fromkeys(_COUNTED, 0)))
    empty: int = 0
    prior_weight: list[float] = field(default_factory=list)
    prior_share: list[float] = field(default_factory=list)
    distances: Distances = field(default_factory=Distances)
    dropped: int = 0
    hidden_long: Mask = field(default_factory=lambda: np.zeros(0, np.bool_))

    def add(self, completer: Completer) -> None:
        """Takes the last frame of the completer into account."""
        report = completer.report
        self.seconds.append(report.seconds)
        self.counts.update({name: getattr(report, name) for name in _COUNTED})
        self.empty += report.known == 0
        if self.trained and report.known and report.filled:
            self.prior_weight.append(report.prior_weight)
            self.prior_share.append(report.prior_share)
        if self.method == "motion" and report.known < completer.n_vertices:
            long = completer.age >= LONG
            self.hidden_long = long | self.hidden_long if len(self.hidden_long) else long

    def add_written(self, frame: Frame, drop_above: float | None) -> None:
        """Takes the standard errors of a frame into account, in which some may be left missing.

        Vertices whose standard error exceeds `drop_above` do not count among the distances.
        """
        errors, generation = frame.standard_error, frame.generation
        if errors is None or generation is None:
            return
        kept = np.asarray(generation > 0)
        if drop_above is not None:
            self.dropped += int(np.count_nonzero(errors > drop_above))
            kept &= errors <= drop_above
        self.distances.add(errors, kept)

    def remarks(self, metres_per_unit: float | None) -> Iterator[str]:
        """Yields what the standard errors say, in words."""
        words = in_words(self.distances, metres_per_unit)
        if words is not None:
            yield words
        if self.dropped:
            share = 100 * self.dropped / (self.counts["filled"] + self.counts["disconnected"])
            yield (
                f"{self.dropped} vertices were left missing, {share:.3g} % of those that were not "
                "observed, all frames together: their standard error is too large"
            )

    def report(
        self,
        frames: int,
        remarks: tuple[str, ...],
        start: float | None,
        doubtful: bool,
    ) -> FileReport:
        """Returns what was done to a file with that many frames."""
        counts: dict[str, Any] = dict(self.counts)
        return FileReport(
            frames,
            float(np.median(self.seconds)) if self.seconds else None,
            **counts,
            remarks=remarks,
            completed=len(self.seconds),
            empty=self.empty,
            hidden_long=int(np.count_nonzero(self.hidden_long)),
            start=start,
            doubtful=doubtful,
            prior_weight=float(np.mean(self.prior_weight)) if self.prior_weight else None,
            prior_share=float(np.mean(self.prior_share)) if self.prior_share else None,
            within_90=self.distances.within(0.9),
            dropped=self.dropped,
        )
