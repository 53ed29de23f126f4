"""Everything that is measured on one sequence."""

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

from .. import degrade, metrics
from ..sequence import Mask
from .measure import Run, Subject, run
from .methods import COMPARED, MOTION, ONCE, Method

PAPER_SHARES = (0.1, 0.3, 0.5, 0.7)
SCENARIOS = {"camera": "seen by one camera", "patches": "30 % hidden by patches"}


@dataclass(frozen=True)
class Plan:
    """How much is measured.

    Attributes:
        sweep: shares of known vertices at which the time of motion is measured.
        shares: at which all methods are compared.
        frames: of each sequence at most, or None for all.
    """

    sweep: tuple[float, ...]
    shares: tuple[float, ...]
    frames: int | None

    @classmethod
    def full(cls) -> "Plan":
        """The whole evaluation."""
        sweep = tuple(round(0.05 * i, 2) for i in range(1, 20))
        return cls(sweep, tuple(round(0.1 * i, 1) for i in range(1, 10)), None)

    @classmethod
    def quick(cls) -> "Plan":
        """The same figures from fewer frames and shares."""
        return cls((0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 0.95), PAPER_SHARES, 50)


@dataclass(frozen=True, eq=False)
class Study:
    """What was measured on one sequence.

    Attributes:
        subject: the sequence.
        sweep: motion by share of known vertices, timed only.
        grid: by method key and share.
        once: the other reading of the weights, by share.
        scenarios: by name and method key.
    """

    subject: Subject
    sweep: dict[float, Run]
    grid: dict[tuple[str, float], Run]
    once: dict[float, Run]
    scenarios: dict[tuple[str, str], Run]


def pictured_frames(subject: Subject) -> dict[str, tuple[int, ...]]:
    """The numbers of the frames that the figures show."""
    return {
        "figure8": (subject.frame_at(0.63),),
        "figure10 30 %": (subject.frame_at(0.86), subject.frame_at(0.46)),
        "figure10 50 %": (subject.frame_at(0.31), subject.frame_at(0.69)),
        "figure11": (subject.frame_at(0.46),),
        "scenarios": (subject.frame_at(0.63),),
    }


def seconds_per_frame(subject: Subject, seed: int) -> dict[str, float]:
    """What a frame costs with each method, from a few of them: to tell how long a study takes."""
    few = replace(subject, vertices=subject.vertices[:4])
    start = time.perf_counter()
    metrics.nmsve(few.faces, few.vertices, few.vertices)
    measuring = (time.perf_counter() - start) / few.n_frames
    costs = {}
    for method in (*COMPARED, ONCE):
        masks = degrade.random_known(few.n_frames, few.n_vertices, 0.3, seed=seed)
        costs[method.key] = float(run(few, method, masks).seconds.mean()) + measuring
    return costs


def seconds_of_work(subject: Subject, plan: Plan, costs: dict[str, float]) -> float:
    """How long `study` will take, about."""
    comparisons = len(plan.shares) + len(SCENARIOS)
    frame = comparisons * sum(costs[method.key] for method in COMPARED)
    frame += len(plan.sweep) * costs[MOTION.key] + len(PAPER_SHARES) * costs[ONCE.key]
    return frame * (subject.n_frames - 1)


def scenario_masks(name: str, subject: Subject, seed: int) -> list[Mask]:
    """The masks of one way to lose vertices other than at random."""
    if name == "camera":
        everywhere = subject.vertices.reshape(-1, 3)  # so that nobody walks out of the picture
        cameras = degrade.orbit(everywhere, up=_unit(subject.up))
        return list(degrade.camera_known(subject.vertices, subject.faces, cameras))
    shape = (subject.n_frames, subject.n_vertices)
    return list(degrade.patch_known(subject.faces, *shape, 0.3, seed=seed))


def study(
    subject: Subject,
    plan: Plan,
    seed: int,
    costs: dict[str, float],
    advance: Callable[[float], object],
) -> Study:
    """Measures everything on one sequence, and tells `advance` of the seconds of work done."""

    def masks(share: float) -> Iterator[Mask]:
        return degrade.random_known(subject.n_frames, subject.n_vertices, share, seed=seed)

    def measure(method: Method, known: Iterable[Mask], *, with_error: bool = True) -> Run:
        return run(
            subject,
            method,
            known,
            keep=pictured,
            advance=lambda frames: advance(frames * costs[method.key]),
            with_error=with_error,
        )

    pictured = sorted({n for numbers in pictured_frames(subject).values() for n in numbers})
    sweep = {share: measure(MOTION, masks(share), with_error=False) for share in plan.sweep}
    grid = {
        (method.key, share): measure(method, masks(share))
        for share in plan.shares
        for method in COMPARED
    }
    once = {share: measure(ONCE, masks(share)) for share in PAPER_SHARES}
    scenarios = {}
    for name in SCENARIOS:
        hidden = scenario_masks(name, subject, seed)
        for method in COMPARED:
            scenarios[name, method.key] = measure(method, hidden)
    return Study(subject, sweep, grid, once, scenarios)


def _unit(axis: str) -> tuple[float, float, float]:
    return (float(axis == "x"), float(axis == "y"), float(axis == "z"))
