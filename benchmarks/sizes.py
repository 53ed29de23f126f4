"""Time over the size of the mesh, and over the number of unknown vertices."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dynmesh.study.fits import LinearFit
from dynmesh.study.methods import MOTION

from .comparison import Measurement, compare
from .methods import ALL, ON_ONE_THREAD, SHARED_FROM
from .plan import SpeedPlan
from .scenes import Scene, grid, swept


@dataclass(frozen=True)
class PowerLaw:
    """The law seconds = factor * vertices ** exponent, fitted to the logarithms."""

    factor: float
    exponent: float


def against_size(plan: SpeedPlan) -> Iterator[Measurement]:
    """Measure seas on grids of several sizes, the slow methods on the smaller ones."""
    for side in plan.grids:
        scene = grid(side, max(2, min((plan.frames - 1) // 2, 2_000_000 // side**2)))
        slow_frames = 2 if scene.n_vertices <= plan.slow_limit else 0
        methods = ALL if scene.n_vertices >= SHARED_FROM else ON_ONE_THREAD
        yield from compare(scene, 2, slow_frames, {}, methods=methods, with_error=False)


def against_unknown(scene: Scene, plan: SpeedPlan) -> Iterator[Measurement]:
    """Measure motion on one mesh, more and more of which is known."""
    laps = (plan.laps + 1) // 2
    yield from compare(swept(scene, plan), laps, 0, {}, methods=[MOTION], with_error=False)


def fit_power_law(measurements: list[Measurement]) -> PowerLaw:
    """Fit a power law to the medians of one method."""
    vertices = np.log([m.n_vertices for m in measurements])
    line = LinearFit.of(vertices, np.log([np.median(m.seconds) for m in measurements]))
    return PowerLaw(float(np.exp(line.intercept)), line.slope)


def fit_line(measurements: list[Measurement]) -> LinearFit:
    """Fit a line to the median seconds over the number of unknown vertices."""
    unknown = [unknown_vertices(m) for m in measurements]
    return LinearFit.of(unknown, [float(np.median(m.seconds)) for m in measurements])


def unknown_vertices(measurement: Measurement) -> int:
    """Return the mean number of unknown vertices of a frame."""
    return round((1 - measurement.known) * measurement.n_vertices)
