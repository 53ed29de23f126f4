"""Everything that is measured on one sequence."""

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

from .. import degrade, metrics
from ..sequence import Mask
from .measure import Run, Subject, run
from .methods import BEYOND, COMPARED, MOTION, ONCE, Method

PAPER_SHARES = (0.1, 0.3, 0.5, 0.7)
SCENARIOS = {"camera": "seen by one camera", "patches": "30 % hidden by patches"}


@dataclass(frozen=True)
class Plan:
    """How much is measured.

    Attributes:
        sweep: shares of known vertices at which the time of motion is measured.
        shares: at which the paper's methods are compared; the others at those of the paper.
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
        return cls((0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 0.95), PAPER_SHARES, 30)


@dataclass(frozen=True, eq=False)
class Study:
    """What was measured on one sequence.

    Attributes:
        subject: the sequence.
        sweep: motion by share of known vertices, timed only.
        grid: by method key and share.
        once: the other reading of the weights, by share.
        scenarios: by name and method key.
        missing: why methods of `BEYOND` were left out, by key.
    """

    subject: Subject
    sweep: dict[float, Run]
    grid: dict[tuple[str, float], Run]
    once: dict[float, Run]
    scenarios: dict[tuple[str, str], Run]
    missing: dict[str, str]

    @property
    def beyond(self) -> list[Method]:
        """Those of `BEYOND` that were measured."""
        return [method for method in BEYOND if method.key not in self.missing]

    def shares(self, method: Method) -> list[float]:
        """At which a method was measured."""
        return sorted(share for key, share in self.grid if key == method.key)


def pictured_frames(subject: Subject) -> dict[str, tuple[int, ...]]:
    """The numbers of the frames that the figures show."""
    return {
        "figure8": (subject.frame_at(0.63),),
        "figure10 30 %": (subject.frame_at(0.86), subject.frame_at(0.46)),
        "figure10 50 %": (subject.frame_at(0.31), subject.frame_at(0.69)),
        "figure11": (subject.frame_at(0.46),),
        "figure15": (subject.frame_at(0.63),),
        "scenarios": (subject.frame_at(0.63),),
    }


@dataclass(frozen=True)
class Trial:
    """What a few frames tell.

    Attributes:
        seconds: of a frame, by method key.
        missing: why methods of `BEYOND` cannot run, by key.
    """

    seconds: dict[str, float]
    missing: dict[str, str]


def trial(subject: Subject, seed: int) -> Trial:
    """Tries each method on a few frames, to tell how long a study takes and what it leaves out."""
    few = replace(subject, vertices=subject.vertices[:4])
    start = time.perf_counter()
    metrics.nmsve(few.faces, few.vertices, few.vertices)
    measuring = (time.perf_counter() - start) / few.n_frames
    result = Trial({}, {})
    for method in (*COMPARED, ONCE, *BEYOND):
        masks = degrade.random_known(few.n_frames, few.n_vertices, 0.3, seed=seed)
        try:
            seconds = float(run(few, method, masks).seconds.mean())
        except (ImportError, RuntimeError) as error:
            if method not in BEYOND:
                raise
            result.missing[method.key] = str(error)
        else:
            result.seconds[method.key] = seconds + measuring
    return result


def seconds_of_work(subject: Subject, plan: Plan, tried: Trial) -> float:
    """How long `study` will take, about."""
    costs = tried.seconds
    frame = (len(plan.shares) + len(SCENARIOS)) * sum(costs[method.key] for method in COMPARED)
    frame += len(plan.sweep) * costs[MOTION.key] + len(PAPER_SHARES) * costs[ONCE.key]
    beyond = sum(costs.get(method.key, 0.0) for method in BEYOND)
    frame += (len(PAPER_SHARES) + len(SCENARIOS)) * beyond
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
    tried: Trial,
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
            advance=lambda frames: advance(frames * tried.seconds[method.key]),
            with_error=with_error,
        )

    def measure_everywhere(method: Method, shares: Iterable[float]) -> None:
        random = {(method.key, share): measure(method, masks(share)) for share in shares}
        others = {(name, method.key): measure(method, hidden[name]) for name in SCENARIOS}
        result.grid.update(random)
        result.scenarios.update(others)

    pictured = sorted({n for numbers in pictured_frames(subject).values() for n in numbers})
    hidden = {name: scenario_masks(name, subject, seed) for name in SCENARIOS}
    sweep = {share: measure(MOTION, masks(share), with_error=False) for share in plan.sweep}
    once = {share: measure(ONCE, masks(share)) for share in PAPER_SHARES}
    result = Study(subject, sweep, {}, once, {}, dict(tried.missing))
    for method in COMPARED:
        measure_everywhere(method, plan.shares)
    for method in result.beyond:
        try:
            measure_everywhere(method, PAPER_SHARES)
        except RuntimeError as error:  # libigl's, on what it cannot solve
            result.missing[method.key] = str(error)
    return result


def _unit(axis: str) -> tuple[float, float, float]:
    return (float(axis == "x"), float(axis == "y"), float(axis == "z"))
