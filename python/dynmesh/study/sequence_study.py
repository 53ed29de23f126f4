"""Everything that is measured on one sequence."""

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace

from .. import metrics
from ..sequence import Mask
from .baselines import BEYOND, BIHARMONIC
from .completion import Method
from .losses import PAPER_SHARES, SCENARIOS, random_masks, scenario_masks
from .measure import Run, run
from .methods import COMPARED, DETAIL, MOTION, ONCE
from .plan import Plan
from .reliability import Reliability, reliability
from .subjects import Subject
from .tables import percent
from .training_study import TrainingStudy, halves, training_study
from .training_study import seconds_of_work as seconds_of_training

BAR_SHARES = (0.1, 0.3)
"""The shares of known vertices with which error bars are measured, beside the scenarios."""

_COST_OF_BARS = 1.5  # of the time of detail


@dataclass(frozen=True, eq=False)
class Study:
    """What was measured on one sequence.

    Attributes:
        subject: the sequence.
        sweep: the runs of motion by share of known vertices; only their time was measured.
        grid: the runs by method key and share of known vertices.
        once: the runs with the other reading of the weights, by share.
        scenarios: the runs by scenario and method key.
        missing: why methods of `BEYOND` were left out, by key.
        second_half: what was measured after training, or None if there are too few frames.
        bars: what the error bars of detail are worth, by loss.
    """

    subject: Subject
    sweep: dict[float, Run]
    grid: dict[tuple[str, float], Run]
    once: dict[float, Run]
    scenarios: dict[tuple[str, str], Run]
    missing: dict[str, str]
    second_half: TrainingStudy | None = None
    bars: dict[str, Reliability] = field(default_factory=dict)

    @property
    def beyond(self) -> list[Method]:
        """The methods of `BEYOND` that were measured."""
        return [method for method in BEYOND if method.key not in self.missing]

    def shares(self, method: Method) -> list[float]:
        """Return the shares of known vertices at which a method was measured."""
        return sorted(share for key, share in self.grid if key == method.key)


def pictured_frames(subject: Subject) -> dict[str, tuple[int, ...]]:
    """Return the numbers of the frames that the figures show."""
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
    """What a run of a few frames shows.

    Attributes:
        seconds: the time of a frame, by method key.
        missing: why methods of `BEYOND` cannot run, by key.
    """

    seconds: dict[str, float]
    missing: dict[str, str]


def trial(subject: Subject, seed: int) -> Trial:
    """Run each method on a few frames, to estimate the time of a study and what it leaves out."""
    few = replace(subject, vertices=subject.vertices[:4])
    start = time.perf_counter()
    metrics.nmsve(few.faces, few.vertices, few.vertices)
    measuring = (time.perf_counter() - start) / few.n_frames
    result = Trial({}, {})
    for method in (*COMPARED, ONCE, *BEYOND):
        masks = random_masks(few, 0.3, seed)
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
    """Estimate how long `study` will take."""
    costs = tried.seconds
    frame = (len(plan.shares) + len(SCENARIOS)) * sum(costs[method.key] for method in COMPARED)
    frame += len(plan.sweep) * costs[MOTION.key] + len(PAPER_SHARES) * costs[ONCE.key]
    beyond = sum(costs.get(method.key, 0.0) for method in BEYOND)
    frame += (len(PAPER_SHARES) + len(SCENARIOS)) * beyond
    frame += (len(BAR_SHARES) + len(SCENARIOS)) * _COST_OF_BARS * costs.get(DETAIL.key, 0.0)
    return frame * (subject.n_frames - 1) + _seconds_of_second_half(subject, plan, tried)


def _seconds_of_second_half(subject: Subject, plan: Plan, tried: Trial) -> float:
    if (parts := halves(subject)) is None:
        return 0.0
    costs = tried.seconds
    frame = costs[MOTION.key] + 5 * costs[DETAIL.key] + costs.get(BIHARMONIC.key, 0.0)
    n_losses = len(plan.second_half) + len(plan.second_scenarios)
    return seconds_of_training(parts[1], frame, n_losses)


def study(
    subject: Subject,
    plan: Plan,
    seed: int,
    tried: Trial,
    advance: Callable[[float], object],
    others: Iterable[Subject] = (),
) -> Study:
    """Measure everything on one sequence; call `advance` with the seconds of work done.

    `others` are other sequences; those with the same mesh are trained to show that it does no
    harm.
    """

    def masks(share: float) -> Iterator[Mask]:
        return random_masks(subject, share, seed)

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
        except RuntimeError as error:  # a baseline cannot solve the system of a frame
            result.missing[method.key] = str(error)
    losses = {percent(share): list(masks(share)) for share in BAR_SHARES} | hidden
    for name, known in losses.items():
        found = reliability(
            subject,
            known,
            advance=lambda frames: advance(frames * _COST_OF_BARS * tried.seconds[DETAIL.key]),
        )
        if found is not None:
            result.bars[name] = found
    if (parts := halves(subject)) is None:
        return result
    training, second = parts
    seconds = _seconds_of_second_half(subject, plan, tried)
    measured = training_study(
        second,
        training,
        others=others,
        shares=plan.second_half,
        scenarios=plan.second_scenarios,
        seed=seed,
        advance=lambda part: advance(part * seconds),
    )
    return replace(result, second_half=measured)
