"""Samples of attributes of a USD stage, and the frames that they are."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._errors import InputError
from .format import OTHER_MESHES
from .times import Timing, frame_number, spacing


def frame_times(points: Any) -> list[float]:
    """Returns the times of the samples and of gaps between equal ones; 0 if there is no sample."""
    samples = np.array(points.GetTimeSamples())
    if len(samples) < 2:
        return [*samples, 0.0][:1]
    gaps = np.diff(samples)
    steps = np.rint(gaps / gaps.min())
    even = np.allclose(gaps, steps * gaps.min(), rtol=1e-6, atol=0)
    if even and all(_held(points, *samples[i : i + 2]) for i in np.flatnonzero(steps > 1)):
        samples = np.linspace(samples[0], samples[-1], int(steps.sum()) + 1)
    return [float(time) for time in samples]


def axis_and_unit(stage: Any) -> tuple[str | None, float | None]:
    """Returns the up axis and the metres per unit, as far as the stage states them."""
    axis, metres = (
        stage.GetMetadata(name) if stage.HasAuthoredMetadata(name) else None
        for name in ("upAxis", "metersPerUnit")
    )
    return axis and axis.lower(), metres


def timing(stage: Any, times: Sequence[float]) -> Timing:
    """Returns the frames per second, if the stage states them, and the numbers of the frames.

    If the stage states its rate and frames are n time codes apart, the first number is the first
    time code divided by n, so that a stage written from it, with one time code per frame, starts at
    the same second. Otherwise the numbers are time codes.
    """
    metadata = any(map(stage.HasAuthoredMetadata, ("timeCodesPerSecond", "framesPerSecond")))
    rate = float(stage.GetTimeCodesPerSecond()) if metadata else None
    step = 1.0 if len(times) == 1 else spacing(times)
    if step is None or (rate is None and step != 1):
        return Timing(rate, times[0], np.array(times))
    # Over its original, a sample must have exactly the time of the original one.
    start = frame_number(times[0], 1 / step, tolerance=1e-15)
    return Timing(None if rate is None else rate / step, start)


def value_at(attribute: Any, time: float, shape: tuple[int, ...]) -> NDArray[Any] | str:
    """Returns the value of a sample, of equal ones before and after, or the only value.

    If there is none, or it is blocked or empty, it returns that in words.
    """
    times, name = attribute.GetBracketingTimeSamples(time) or (time,), attribute.GetName()
    nearest = min(times, key=lambda sample: abs(sample - time))
    if not math.isclose(nearest, time, abs_tol=1e-9) and not _held(attribute, *times):
        return f"{name} has no sample"
    value = attribute.Get(nearest)
    if value is None or (len(value) == 0 < shape[0]):
        return f"{name} is {'blocked' if value is None else 'empty'}"
    array = np.array(value)
    if array.shape != shape:
        raise InputError(
            f"time {time:g}: {name} has {len(array)} values, "
            f"but the mesh has {shape[0]} vertices in its first frame; {OTHER_MESHES}"
        )
    return array


def _held(attribute: Any, before: float, after: float) -> bool:
    """Whether the values of two samples are equal."""
    first, second = (attribute.Get(time) for time in (before, after))
    if first is None or second is None:
        return first is second
    are_equal = np.array_equal(np.asarray(first), np.asarray(second), equal_nan=True)
    return before < after and are_equal
