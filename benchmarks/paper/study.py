"""Everything that is measured on one sequence for the figures of the paper, and beyond."""

from dataclasses import dataclass

from ..methods import BASELINES, COMPARED, MOTION, ONCE, Method
from ..runner import Run, Runs, run_all
from ..subjects import PAPER_SHARES, SCENARIOS, Subject, losses_of, percent

SHARES = tuple(round(0.1 * step, 1) for step in range(1, 10))
"""The shares of known vertices at which the methods of the paper are compared."""

SWEEP = tuple(round(0.05 * step, 2) for step in range(1, 20))
"""The shares of known vertices at which motion is measured."""

QUICK_SWEEP = (0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 0.95)

FIGURE8, FIGURE11 = 0.63, 0.46
"""Where in the sequence the frames are that these figures show, as fractions."""

FIGURE10 = ((0.3, 0.86), (0.3, 0.46), (0.5, 0.31), (0.5, 0.69))
"""The share of known vertices of each row, and where in the sequence its frame is."""


@dataclass(frozen=True, eq=False)
class Study:
    """What was measured on one sequence: the runs by method and loss."""

    subject: Subject
    runs: Runs

    @property
    def methods(self) -> list[Method]:
        """The methods that were measured; those of libraries that are not installed were not."""
        return list(dict.fromkeys(method for method, _ in self.runs))

    @property
    def sweep(self) -> dict[float, Run]:
        """The runs of motion by share of known vertices."""
        return {share: self.at(MOTION, share) for share in self.shares(MOTION, SWEEP)}

    def at(self, method: Method, share: float) -> Run:
        """Return the run of a method at a share of known vertices."""
        return self.runs[method, percent(share)]

    def shares(self, method: Method, of: tuple[float, ...] = SHARES) -> list[float]:
        """Return the shares of known vertices at which a method was measured."""
        return [share for share in of if (method, percent(share)) in self.runs]


def study(subject: Subject, *, quick: bool) -> Study:
    """Measure everything on one sequence."""
    places = (FIGURE8, FIGURE11, *(place for _, place in FIGURE10))
    keep = [subject.frame_at(place) for place in places]
    masks = losses_of(subject, QUICK_SWEEP if quick else SWEEP)
    runs = run_all(subject, (MOTION,), masks, keep=keep)
    shares = [*map(percent, PAPER_SHARES if quick else SHARES), *SCENARIOS]
    compared = {loss: masks[loss] for loss in shares}
    runs |= run_all(subject, COMPARED[1:], compared, keep=keep)
    of_paper = {loss: masks[loss] for loss in map(percent, PAPER_SHARES)}
    scenarios = {loss: masks[loss] for loss in SCENARIOS}
    runs |= run_all(subject, BASELINES, of_paper | scenarios, keep=keep)
    runs |= run_all(subject, (ONCE,), of_paper)
    return Study(subject, runs)
