"""Time against the size of the mesh, and against the number of unknown vertices."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .comparison import Measurement, compare
from .plan import Plan
from .rivals import ALL, DYNMESH, ON_ONE_THREAD, SHARED_FROM
from .scenes import Scene, grid, swept


@dataclass(frozen=True)
class PowerLaw:
    """seconds = factor * vertices ** exponent, fitted to the logarithms."""

    factor: float
    exponent: float


@dataclass(frozen=True)
class Line:
    """seconds = slope * unknown vertices + intercept."""

    slope: float
    intercept: float
    r_squared: float


def against_size(plan: Plan) -> Iterator[Measurement]:
    """Grids of a sea; the slow methods on the smaller ones."""
    for side in plan.grids:
        scene = grid(side, max(2, min(plan.frames // 2, 2_000_000 // side**2)))
        slow_frames = 2 if scene.n_vertices <= plan.slow_limit else 0
        methods = ALL if scene.n_vertices >= SHARED_FROM else ON_ONE_THREAD
        yield from compare(scene, 2, slow_frames, {}, methods=methods, with_error=False)


def against_unknown(scene: Scene, plan: Plan) -> Iterator[Measurement]:
    """One mesh, more and more of which is known."""
    laps = (plan.laps + 1) // 2
    yield from compare(swept(scene), laps, 0, {}, methods=[DYNMESH], with_error=False)


def fit_power_law(measurements: list[Measurement]) -> PowerLaw:
    """Of the medians of one method."""
    vertices = np.log([m.n_vertices for m in measurements])
    seconds = np.log([np.median(m.seconds) for m in measurements])
    exponent, factor = np.polyfit(vertices, seconds, 1)
    return PowerLaw(float(np.exp(factor)), float(exponent))


def fit_line(measurements: list[Measurement]) -> Line:
    """Of the medians."""
    unknown = np.array([unknown_vertices(m) for m in measurements])
    seconds = np.array([np.median(m.seconds) for m in measurements])
    slope, intercept = np.polyfit(unknown, seconds, 1)
    residual = seconds - (slope * unknown + intercept)
    spread = seconds - seconds.mean()
    r_squared = 1 - residual @ residual / (spread @ spread)
    return Line(float(slope), float(intercept), float(r_squared))


def unknown_vertices(measurement: Measurement) -> int:
    """In a frame, on the average."""
    return round((1 - measurement.known) * measurement.n_vertices)
