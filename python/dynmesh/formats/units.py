"""Units of length."""

import math
from itertools import permutations
from pathlib import Path

from .._errors import InputError

UNITS = {
    "m": 1.0, "cm": 0.01, "mm": 0.001, "km": 1000.0,
    "inch": 0.0254, "foot": 0.3048, "yard": 0.9144,
}  # fmt: skip
"""The names of units, in metres."""


def metres_of(value: object, argument: str = "unit") -> float:
    """Returns the metres of a unit: a name, or a number of metres."""
    if isinstance(value, str) and value in UNITS:
        return UNITS[value]
    if isinstance(value, int | float) and not isinstance(value, bool) and 0 < value < math.inf:
        return float(value)
    raise InputError(
        f"must be one of {', '.join(UNITS)}, or a number of metres above 0, not {value!r}",
        argument=argument,
        value=value,
    )


def agreed(
    stated: float | None, given: object, argument: str, file: Path | None = None
) -> float | None:
    """Returns the metres of a unit that a file states, or that is given of one that states none."""
    if given is None:
        return stated
    said = metres_of(given, argument)
    if stated is not None and not math.isclose(stated, said):
        message = f"the file states units of {stated:g} m, not {said:g} m"
        raise InputError(message, argument=argument, value=given, file=file)
    return said


def explaining(ratio: float, tolerance: float) -> list[tuple[str, str]]:
    """Returns pairs of units that differ by about a ratio of sizes, the usual ones first.

    Args:
        ratio: how many times as large, in numbers, something in the second unit is as the same in
            the first.
        tolerance: the largest factor by which it may be off.
    """
    usual = list(UNITS)
    pairs = permutations(usual, 2)
    off = {pair: abs(math.log(ratio * UNITS[pair[1]] / UNITS[pair[0]])) for pair in pairs}
    near = [pair for pair in off if off[pair] < math.log(tolerance)]
    return sorted(near, key=lambda pair: sorted(map(usual.index, pair)))
