"""Colour scales: the colours of values, and their labels."""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._extras import require
from .figures import HEATMAP, MISSING_COLOUR, SURFACE_COLOUR

Values = NDArray[np.number[Any]]

SINGLE_STEPS = 8  # counts with a colour each; larger ones share colours in ranges that double


class Tick(NamedTuple):
    """A mark on the colour bar."""

    position: float
    label: str


class Scale(ABC):
    """Maps values to places on a colour bar, from 0, its first colour, to 1, its last.

    Attributes:
        title: what is shown, with its unit.
        colours: equal steps along the bar, each as "#rrggbb".
        ticks: in ascending order of position.
    """

    def __init__(self, title: str, colours: Sequence[str], ticks: Sequence[Tick]) -> None:
        """Sets the attributes; called by the subclasses."""
        self.title = title
        self.colours = tuple(colours)
        self.ticks = tuple(ticks)

    @abstractmethod
    def position(self, values: Values) -> NDArray[np.float32]:
        """Returns the positions of values on the bar, in 0 to 1."""


class MeasureScale(Scale):
    """Measures such as lengths: logarithmic, or linear if the scale begins at 0."""

    def __init__(self, title: str, sign: str, low: float, high: float) -> None:
        """Creates a scale from `low`, not negative, to `high`; `sign` follows each number."""
        self._low, self._high = low, high
        quarters = np.linspace(low, high, 5)[1:-1].tolist()
        inner = _round_between(low, high) if low > 0 else quarters
        ends = [f"{plain(low)} {sign} or less", f"{plain(high)} {sign} or more"]
        if low == 0:
            ends[0] = f"0 {sign}"
        places = self.position(np.array(inner)).tolist()
        ticks = [
            Tick(position, f"{plain(value)} {sign}")
            for position, value in zip(places, inner, strict=True)
            if 0.05 < position < 0.95  # the ends have labels of their own
        ]
        colours = _colour_map(HEATMAP, 64)
        super().__init__(title, colours, [Tick(0.0, ends[0]), *ticks, Tick(1.0, ends[1])])

    def position(self, values: Values) -> NDArray[np.float32]:
        """Returns the positions of measures on the bar."""
        if self._low > 0:
            shares = np.log(np.maximum(values, self._low) / self._low)
            places = np.asarray(shares / math.log(self._high / self._low), np.float64)
        else:
            places = np.asarray(values / self._high, np.float64)
        return np.asarray(np.clip(places, 0, 1), np.float32)


class StepScale(Scale):
    """Whole numbers: a step for each range of them; values below all ranges are in the last."""

    def __init__(
        self, title: str, starts: Sequence[int], labels: Sequence[str], colours: Sequence[str]
    ) -> None:
        """Takes the first number of each range, and a label and a colour for each step."""
        self._starts, self._n_steps = np.array(starts), len(labels)
        ticks = [Tick((i + 0.5) / len(labels), label) for i, label in enumerate(labels)]
        super().__init__(title, colours, ticks)

    def position(self, values: Values) -> NDArray[np.float32]:
        """Returns the positions of numbers on the bar, each in the middle of its step."""
        step = np.searchsorted(self._starts, values, side="right") - 1
        step = np.where(step < 0, self._n_steps - 1, step)
        return np.asarray((step + 0.5) / self._n_steps, np.float32)


class CountScale(StepScale):
    """Counts: steps for 0, then for each number, then for growing ranges; -1 comes last."""

    def __init__(
        self, title: str, largest: int, *, zero: str, minus_one: str | None = None
    ) -> None:
        """Creates as many steps as needed up to the largest count, with labels for 0 and -1."""
        starts = [*range(largest + 1)]
        if largest > SINGLE_STEPS:
            spans = math.ceil(math.log2(largest))
            starts = [0, 1, *(1 + 2**i for i in range(spans))]
        ends = [start - 1 for start in starts[1:]] + [largest]
        labels = [
            str(start) if start == end else f"{start} to {end}"
            for start, end in zip(starts, ends, strict=True)
        ]
        labels[0] = f"0, {zero}"
        colours = [SURFACE_COLOUR, *_colour_map(HEATMAP, len(starts) - 1)]
        if minus_one is not None:
            labels.append(minus_one)
            colours.append(MISSING_COLOUR)
        super().__init__(title, starts, labels, colours)


def plain(value: float) -> str:
    """Formats a number with three digits and without an exponent, such as 0.0002."""
    return np.format_float_positional(value, 3, unique=False, fractional=False, trim="-")


def _round_between(low: float, high: float) -> list[float]:
    """Returns the powers of ten inside, or twice and five times such if there are none."""
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    for steps in ((1,), (1, 2, 5)):
        values = [step * 10.0**decade for decade in decades for step in steps]
        inside = [value for value in values if low * 1.1 < value < high / 1.1]
        if inside:
            break
    return inside


def _colour_map(name: str, n: int) -> list[str]:
    """Returns `n` colours from Matplotlib, which is installed with pyvista."""
    matplotlib = require("matplotlib", extra="view")
    colours = matplotlib.colormaps[name](np.linspace(0, 1, n), bytes=True)
    return [f"#{red:02x}{green:02x}{blue:02x}" for red, green, blue, _ in colours]
