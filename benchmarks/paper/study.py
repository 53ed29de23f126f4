"""Everything that is measured on one sequence for the figures of the paper, and beyond."""

from dataclasses import dataclass

from ..harness import progress
from ..methods import BASELINES, COMPARED, MOTION, ONCE, Method
from ..runner import Run, Runs, run, run_all
from ..subjects import PAPER_SHARES, SCENARIOS, Subject, losses, percent, random_masks

SHARES = tuple(round(0.1 * step, 1) for step in range(1, 10))
"""The shares of known vertices at which the methods of the paper are compared."""

SWEEP = tuple(round(0.05 * step, 2) for step in range(1, 20))
"""The shares of known vertices at which the time of motion is measured."""

QUICK_SWEEP = (0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 0.95)


@dataclass(frozen=True, eq=False)
class Study:
    """What was measured on one sequence.

    Attributes:
        subject: the sequence.
        runs: the runs by method and loss.
        sweep: the runs of motion by share of known vertices; only their time was measured.
    """

    subject: Subject
    runs: Runs
    sweep: dict[float, Run]

    @property
    def methods(self) -> list[Method]:
        """The methods that were measured; those of libraries that are not installed were not."""
        return list(dict.fromkeys(method for method, _ in self.runs))

    def at(self, method: Method, share: float) -> Run:
        """Return the run of a method at a share of known vertices."""
        return self.runs[method, percent(share)]

    def shares(self, method: Method) -> list[float]:
        """Return the shares of known vertices at which a method was measured."""
        return [share for share in SHARES if (method, percent(share)) in self.runs]

    def losses(self, method: Method) -> dict[str, Run]:
        """Return all runs of a method but those of the sweep, by loss."""
        return {loss: run for (of, loss), run in self.runs.items() if of is method}


def pictured_frames(subject: Subject) -> dict[str, int]:
    """Return the numbers of the frames that the figures show."""
    places = {
        "figure8": 0.63,
        "figure10 30 %, first": 0.86,
        "figure10 30 %, second": 0.46,
        "figure10 50 %, first": 0.31,
        "figure10 50 %, second": 0.69,
        "figure11": 0.46,
    }
    return {figure: subject.frame_at(place) for figure, place in places.items()}


def study(subject: Subject, *, quick: bool) -> Study:
    """Measure everything on one sequence."""
    sweep = {
        share: run(subject, MOTION, random_masks(subject, share), with_error=False)
        for share in progress(QUICK_SWEEP if quick else SWEEP, f"{subject.name}, time of motion")
    }
    keep = pictured_frames(subject).values()
    masks = losses(subject, PAPER_SHARES if quick else SHARES)
    runs = run_all(subject, COMPARED, masks, keep=keep)
    of_paper = {name: masks[name] for name in (*map(percent, PAPER_SHARES), *SCENARIOS)}
    runs |= run_all(subject, BASELINES, of_paper, keep=keep)
    runs |= run_all(subject, (ONCE,), losses(subject, PAPER_SHARES, ()))
    return Study(subject, runs, sweep)
