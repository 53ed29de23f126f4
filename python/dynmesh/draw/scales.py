"""Colour scales: the colours of values, and their labels."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._errors import InputError
from .figures import DISCONNECTED_COLOUR, heatmap

Values = NDArray[np.number[Any]]

_SINGLE_STEPS = 8  # counts with a colour each; larger ones share colours in ranges that double


class Tick(NamedTuple):
    """A mark on the colour bar."""

    position: float
    label: str


@dataclass(frozen=True)
class Scale:
    """Maps values to places on a colour bar, from 0, its first colour, to 1, its last.

    Attributes:
        title: what is shown, with its unit.
        colours: equal steps along the bar, each as "#rrggbb".
        ticks: in ascending order of position.
        position: returns the places of values on the bar.
    """

    title: str
    colours: Sequence[str]
    ticks: Sequence[Tick]
    position: Callable[[Values], NDArray[np.float32]]


def measure_scale(title: str, sign: str, low: float, high: float) -> Scale:
    """Measures such as lengths, from `low` to `high`: logarithmic, or linear if `low` is 0.

    `sign` follows each number. A logarithmic scale is marked at powers of ten.
    """

    def position(values: Values) -> NDArray[np.float32]:
        shares = np.clip(values, low, high) / high
        if low > 0:
            shares = 1 - np.log(shares) / math.log(low / high)
        return np.asarray(shares, np.float32)

    marks = np.linspace(low, high, 5)
    if low > 0:
        marks = 10.0 ** np.arange(math.floor(math.log10(low)), math.log10(high))
    ticks = [
        Tick(place, f"{_plain(mark)} {sign}")
        for place, mark in zip(position(marks).tolist(), marks, strict=True)
        if 0.05 < place < 0.95  # the ends have labels of their own
    ]
    first = Tick(0.0, f"{_plain(low)} {sign} or less" if low > 0 else f"0 {sign}")
    last = Tick(1.0, f"{_plain(high)} {sign} or more")
    return Scale(title, heatmap(64), [first, *ticks, last], position)


def step_scale(
    title: str, starts: Sequence[int], labels: Sequence[str], colours: Sequence[str]
) -> Scale:
    """Whole numbers: a step for each range of them; values below all ranges are in the last.

    There are the first number of each range, and a label and a colour for each step.
    """
    count = len(labels)

    def position(values: Values) -> NDArray[np.float32]:
        step = np.searchsorted(starts, values, side="right") - 1
        return np.asarray((step % count + 0.5) / count, np.float32)

    ticks = [Tick((i + 0.5) / count, label) for i, label in enumerate(labels)]
    return Scale(title, colours, ticks, position)


def count_scale(title: str, largest: int, *, zero: str, minus_one: str | None = None) -> Scale:
    """Counts: steps for 0, then for each number, then for growing ranges; -1 comes last.

    There are as many steps as needed up to the largest count, with labels for 0 and -1.
    """
    starts = [*range(largest + 1)]
    if largest > _SINGLE_STEPS:
        starts = [0, 1, *(1 + 2**i for i in range(math.ceil(math.log2(largest))))]
    ends = [start - 1 for start in starts[1:]] + [largest]
    labels = [
        str(start) if start == end else f"{start} to {end}"
        for start, end in zip(starts, ends, strict=True)
    ]
    labels[0] = f"0, {zero}"
    colours = heatmap(len(starts))
    if minus_one is not None:
        labels.append(minus_one)
        colours.append(DISCONNECTED_COLOUR)
    return step_scale(title, starts, labels, colours)


def _plain(value: float) -> str:
    """Formats a number with three digits and without an exponent, such as 0.0002."""
    return np.format_float_positional(value, 3, unique=False, fractional=False, trim="-")


def range_of(given: str | tuple[float, float] | None) -> tuple[float, float] | None:
    """The least and the largest value of a range such as "0.1:10"; None if none is given."""
    if given is None:
        return None
    message, argument = "must be two numbers, as in 0.1:10, from 0 on and ascending", "colour_range"
    try:
        low, high = map(float, given.split(":") if isinstance(given, str) else given)
    except (TypeError, ValueError):
        raise InputError(f"{message}, not {given!r}", argument=argument, value=given) from None
    if not 0 <= low < high < math.inf:
        raise InputError(f"{message}, not {low:g}:{high:g}", argument=argument, value=given)
    return low, high
