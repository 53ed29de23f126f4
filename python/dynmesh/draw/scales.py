"""Colour scales: the colours of values, and their labels."""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._extras import require
from .figures import HEATMAP, HEATMAP_RANGE, KNOWN_COLOUR, MISSING_COLOUR, SURFACE_COLOUR

Values = NDArray[np.number[Any]]

SINGLE_STEPS = 8  # counts with a colour each; larger ones share colours in ranges that double


class Tick(NamedTuple):
    """A mark on the colour bar."""

    place: float
    label: str


class Scale(ABC):
    """Maps values to places on a colour bar, from 0, its first colour, to 1, its last.

    Attributes:
        title: what is shown, with its unit.
        colours: equal steps along the bar, each as "#rrggbb".
        ticks: in ascending order of place.
    """

    def __init__(self, title: str, colours: Sequence[str], ticks: Sequence[Tick]) -> None:
        """Sets the attributes; called by the subclasses."""
        self.title = title
        self.colours = tuple(colours)
        self.ticks = tuple(ticks)

    @abstractmethod
    def place(self, values: Values) -> NDArray[np.float32]:
        """Returns the positions of values on the bar, in 0 to 1."""


class ErrorScale(Scale):
    """Errors, on a logarithmic scale, since those in one frame vary by decades."""

    def __init__(self, limit: float) -> None:
        """Creates a scale that ends at `limit`, which is in bounding-box diagonals."""
        self._last = math.log10(limit)
        self._decades = -math.log10(HEATMAP_RANGE)
        first = limit * HEATMAP_RANGE
        exponents = range(math.ceil(math.log10(first) - 1e-9), math.floor(self._last + 1e-9) + 1)
        ticks = [Tick(0.0, f"{_percent(first)} or less"), Tick(1.0, f"{_percent(limit)} or more")]
        for exponent in exponents:
            place = (exponent - self._last) / self._decades + 1
            if 0.05 < place < 0.95:  # the ends have labels of their own
                ticks.insert(-1, Tick(place, _percent(10.0**exponent)))
        title = "error in % of the bounding-box diagonal"
        super().__init__(title, _colour_map(HEATMAP, 64), ticks)

    def place(self, values: Values) -> NDArray[np.float32]:
        """Returns the positions of errors, in bounding-box diagonals, on the bar."""
        floor = 10.0 ** (self._last - self._decades)
        exponents = np.log10(np.maximum(values, floor))
        places = np.clip((exponents - self._last) / self._decades + 1, 0, 1)
        return np.asarray(places, np.float32)


class CountScale(Scale):
    """Counts: steps for 0, then for each number, then for growing ranges; -1 comes last."""

    def __init__(
        self, title: str, largest: int, *, zero: str, minus_one: str | None = None
    ) -> None:
        """Creates as many steps as needed.

        Args:
            title: names what is counted.
            largest: the largest count.
            zero: label of 0.
            minus_one: label of -1, if it occurs.
        """
        starts = list(range(largest + 1))
        if largest > SINGLE_STEPS:
            starts = [0, 1, *(2**i + 1 for i in range(math.ceil(math.log2(largest))))]
        self._starts = np.array(starts)
        ends = [start - 1 for start in starts[1:]] + [largest]
        labels = [
            str(start) if start == end else f"{start} to {end}"
            for start, end in zip(starts, ends, strict=True)
        ]
        labels[0] = f"0, {zero}"
        colours = [SURFACE_COLOUR, *_colour_map(f"{HEATMAP}_r", len(starts) - 1)]
        if minus_one is not None:
            labels.append(minus_one)
            colours.append(MISSING_COLOUR)
        self._n_steps = len(labels)
        super().__init__(title, colours, _middles(labels))

    def place(self, values: Values) -> NDArray[np.float32]:
        """Returns the positions of counts on the bar, each in the middle of its step."""
        step = np.searchsorted(self._starts, values, side="right") - 1
        return np.where(step < 0, 1 - 0.5 / self._n_steps, (step + 0.5) / self._n_steps).astype(
            np.float32
        )


class KnownScale(Scale):
    """Whether positions were observed."""

    def __init__(self, *, with_filled_in: bool) -> None:
        """Includes a step for positions that were filled in only if there can be any."""
        labels, colours = ["observed"], [KNOWN_COLOUR]
        if with_filled_in:
            labels, colours = ["filled in", "observed"], [MISSING_COLOUR, KNOWN_COLOUR]
        self._n_steps = len(labels)
        super().__init__("known vertices", colours, _middles(labels))

    def place(self, values: Values) -> NDArray[np.float32]:
        """Returns the positions of 0, filled in, and 1, observed, on the bar."""
        return np.where(values, 1 - 0.5 / self._n_steps, 0.5 / self._n_steps).astype(np.float32)


def round_up(value: float) -> float:
    """Returns the next of 1, 2 or 5 times a power of ten, for positive values."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(step * power for step in (1, 2, 5, 10) if step * power >= value * (1 - 1e-9))


def _middles(labels: Sequence[str]) -> list[Tick]:
    return [Tick((i + 0.5) / len(labels), label) for i, label in enumerate(labels)]


def _percent(share: float) -> str:
    return f"{100 * share:.3g} %"


def _colour_map(name: str, n: int) -> list[str]:
    """Returns `n` colours from Matplotlib, which is installed with pyvista."""
    matplotlib = require("matplotlib", extra="view")
    colours = matplotlib.colormaps[name](np.linspace(0, 1, n), bytes=True)
    return [f"#{red:02x}{green:02x}{blue:02x}" for red, green, blue, _ in colours]
