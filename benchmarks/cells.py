"""The text of the cells of tables, and of figures."""

from collections.abc import Mapping

import numpy as np

NMSVE_UNIT = 1e-4
"""Tables and figures show NMSVE in this unit, as multiples of 10⁻⁴ bounding-box diagonals of frame
0. Values in the code are in diagonals."""

ABSENT = "-"
"""The cell of a value that could not be measured."""

Line = tuple[str, ...]


def by_row_and_column(corner: str, cells: Mapping[tuple[str, str], str]) -> list[Line]:
    """Return the lines of a table from its cells by row and column, both in order of appearance."""
    columns = list(dict.fromkeys(column for _, column in cells))
    lines: list[Line] = [(corner, *columns)]
    for row in dict.fromkeys(row for row, _ in cells):
        lines.append((row, *(cells.get((row, column), ABSENT) for column in columns)))
    return lines


def number(value: float) -> str:
    """Return a number with three significant digits, or all digits before the decimal point."""
    if np.isnan(value):
        return ABSENT
    return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"


def nmsve_cell(diagonals: float) -> str:
    """Return an NMSVE in the unit of all tables, with three significant digits."""
    return ABSENT if np.isnan(diagonals) else f"{diagonals / NMSVE_UNIT:.3g}"


def milliseconds(seconds: float) -> str:
    """Return a time in milliseconds, without the unit."""
    return number(1e3 * seconds)


def ratio(value: float, reference: float) -> str:
    """Return how many times as large as the reference a value is."""
    return number(value / reference)


def percent(share: float) -> str:
    """Return a share of 1 as a percentage."""
    return f"{100 * share:g} %"
