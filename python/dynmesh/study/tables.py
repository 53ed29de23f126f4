"""Tables, and the text of their cells, for Markdown and for HTML."""

import re
from collections.abc import Mapping, Sequence
from html import escape

import numpy as np

NMSVE_UNIT = 1e-4
"""Tables, figures and reports show NMSVE in this unit, as multiples of 10⁻⁴ bounding-box diagonals
of frame 0. Values in the code and in JSON are in diagonals."""

NMSVE_NAME = "NMSVE x 1e4"
"""The name of an NMSVE in this unit, in tables and sentences."""

ABSENT = "-"
"""The cell of a value that could not be measured."""

Line = tuple[str, ...]


def markdown(lines: Sequence[Line]) -> str:
    """Return a table in Markdown; the first line is the head."""
    rows = [f"| {' | '.join(row)} |" for row in lines]
    rows.insert(1, f"|{'---|' * len(lines[0])}")
    return "\n".join(rows)


def by_row_and_column(corner: str, cells: Mapping[tuple[str, str], str]) -> list[Line]:
    """Return the lines of a table from its cells by row and column, both in order of appearance."""
    columns = list(dict.fromkeys(column for _, column in cells))
    lines: list[Line] = [(corner, *columns)]
    for row in dict.fromkeys(row for row, _ in cells):
        lines.append((row, *(cells.get((row, column), ABSENT) for column in columns)))
    return lines


def html(lines: Sequence[Line]) -> str:
    """Return the same table in HTML; `**` still marks bold text, and cells may have line breaks."""
    head, *rows = lines
    parts = ["<tr>", *(f"<th>{_cell(text)}</th>" for text in head), "</tr>"]
    for row in rows:
        parts += ["<tr>", *(f"<td>{_cell(text)}</td>" for text in row), "</tr>"]
    return f"<table>{''.join(parts)}</table>"


def _cell(text: str) -> str:
    return re.sub(r"\*\*(.*?)\*\*", r"<b>\1</b>", escape(text)).replace("\n", "<br>")


def mean(values: list[float]) -> float:
    """Return the mean, or NaN if there are no values."""
    return float(np.mean(values)) if values else float("nan")


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


def bold_below_one(value: float) -> str:
    """Return a baseline's value relative to ours, in bold if the baseline is better."""
    return f"**{value:.2f}**" if value < 1 else number(value)


def percent(share: float) -> str:
    """Return a share of 1 as a percentage."""
    return f"{100 * share:g} %"
