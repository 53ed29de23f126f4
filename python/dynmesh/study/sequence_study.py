"""Everything that is measured on one sequence."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from ..sequence import Mask
from .completion import Method
from .losses import PAPER_SHARES, SCENARIOS, random_masks, scenario_masks
from .measure import Run, run
from .methods import COMPARED, MOTION
from .subjects import Subject
from .tables import percent

Advance = Callable[[], object]
"""A function that is called after each run."""


@dataclass(frozen=True)
class Plan:
    """How much is measured. The defaults are the whole evaluation.

    Attributes:
        frames: the largest number of frames of each sequence, frame 0 included; None means all.
        shares: the shares of known vertices at which the methods are compared.
        sweep: the shares of known vertices at which the time of motion is measured.
    """

    frames: int | None = None
    shares: tuple[float, ...] = tuple(round(0.1 * step, 1) for step in range(1, 10))
    sweep: tuple[float, ...] = tuple(round(0.05 * step, 2) for step in range(1, 20))

    def n_runs(self, n_methods: int = len(COMPARED)) -> int:
        """The number of runs of so many methods over a sequence."""
        return len(self.sweep) + n_methods * (len(self.shares) + len(SCENARIOS))

    @classmethod
    def quick(cls) -> "Plan":
        """Return a plan for the same figures from fewer frames and shares."""
        return cls(30, PAPER_SHARES, (0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 0.95))


@dataclass(frozen=True, eq=False)
class Study:
    """What was measured on one sequence.

    Attributes:
        subject: the sequence.
        seed: the seed of the known masks.
        sweep: the runs of motion by share of known vertices; only their time was measured.
        grid: the runs by method key and share of known vertices.
        scenarios: the runs by scenario and method key.
        hidden: the known masks by scenario.
        methods: those that are compared, in the order of tables.
    """

    subject: Subject
    seed: int = 0
    sweep: dict[float, Run] = field(default_factory=dict)
    grid: dict[tuple[str, float], Run] = field(default_factory=dict)
    scenarios: dict[tuple[str, str], Run] = field(default_factory=dict)
    hidden: dict[str, list[Mask]] = field(default_factory=dict)
    methods: tuple[Method, ...] = COMPARED

    def shares(self, method: Method) -> list[float]:
        """Return the shares of known vertices at which a method was measured."""
        return sorted(share for key, share in self.grid if key == method.key)

    def losses(self, method: Method) -> dict[str, Run]:
        """Return all runs of a method but those of the sweep, by what is known."""
        random = {f"{percent(s)} known": self.grid[method.key, s] for s in self.shares(method)}
        hidden = {
            words: self.scenarios[name, method.key]
            for name, words in SCENARIOS.items()
            if (name, method.key) in self.scenarios
        }
        return random | hidden

    def measure(
        self,
        method: Method,
        shares: Iterable[float],
        scenarios: Iterable[str] = tuple(SCENARIOS),
        advance: Advance = lambda: None,
    ) -> None:
        """Add the runs of a method; nothing is added if one of them fails.

        Args:
            method: the method.
            shares: the shares of known vertices.
            scenarios: names of `SCENARIOS`.
            advance: called after each run.

        Raises:
            ImportError, ValueError, RuntimeError: the method cannot complete the sequence.
        """

        def measured(masks: Iterable[Mask]) -> Run:
            found = run(self.subject, method, masks, keep=pictured_frames(self.subject).values())
            advance()
            return found

        for name in scenarios:
            if name not in self.hidden:
                self.hidden[name] = scenario_masks(name, self.subject, self.seed)
        random = {
            (method.key, share): measured(random_masks(self.subject, share, self.seed))
            for share in shares
        }
        hidden = {(name, method.key): measured(self.hidden[name]) for name in scenarios}
        self.grid.update(random)
        self.scenarios.update(hidden)


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


def study(
    subject: Subject, plan: Plan, seed: int, advance: Advance, own: tuple[Method, ...] = ()
) -> Study:
    """Measure everything on one sequence; the methods of a user come first, as they may fail."""
    result = Study(subject, seed, methods=(*COMPARED, *own))
    for method in own:
        result.measure(method, plan.shares, advance=advance)
    for share in plan.sweep:
        masks = random_masks(subject, share, seed)
        result.sweep[share] = run(subject, MOTION, masks, with_error=False)
        advance()
    for method in COMPARED:
        result.measure(method, plan.shares, advance=advance)
    return result
