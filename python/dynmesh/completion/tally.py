"""What a completion has done so far."""

from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from ..calibration import Distances
from ..completer import Completer
from ..files import Frame
from ..sequence import Mask

_COUNTED = ("known", "filled", "disconnected", "rejected")


@dataclass
class Tally:
    """Adds up the reports of the frames that were completed."""

    seconds: list[float] = field(default_factory=list)
    counts: Counter[str] = field(default_factory=lambda: Counter(dict.fromkeys(_COUNTED, 0)))
    empty: int = 0
    prior_weight: list[float] = field(default_factory=list)
    prior_share: list[float] = field(default_factory=list)
    distances: Distances = field(default_factory=Distances)
    dropped: int = 0

    def add(self, completer: Completer) -> None:
        """Takes the last frame of the completer into account."""
        report = completer.report
        self.seconds.append(report.seconds)
        self.counts.update({name: getattr(report, name) for name in _COUNTED})
        self.empty += report.known == 0
        if report.known and report.filled:
            self.prior_weight.append(report.prior_weight)
            self.prior_share.append(report.prior_share)

    def add_written(self, frame: Frame, kept: Mask) -> None:
        """Takes the standard errors of the vertices of a frame that are kept into account."""
        self.dropped += int(np.count_nonzero(~kept))
        errors, generation = frame.standard_error, frame.generation
        if errors is None or generation is None:
            return
        self.distances.add(errors, kept & np.asarray(generation > 0))
