"""Tables in Markdown, and what stands in their cells."""

import numpy as np

ABSENT = "-"

Line = tuple[str, ...]


def table(lines: list[Line]) -> str:
    """In Markdown; the first line is the head."""
    rows = [f"| {' | '.join(row)} |" for row in lines]
    rows.insert(1, f"|{'---|' * len(lines[0])}")
    return "\n".join(rows)


def median(values: list[float]) -> float:
    """NaN of none."""
    return float(np.median(values)) if values else float("nan")


def mean(values: list[float]) -> float:
    """NaN of none."""
    return float(np.mean(values)) if values else float("nan")


def milliseconds(seconds: float) -> str:
    """Three digits."""
    return number(1e3 * seconds)


def quartiles(seconds: list[float]) -> str:
    """In milliseconds."""
    if not seconds:
        return ABSENT
    first, third = 1e3 * np.percentile(seconds, [25, 75])
    return f"{number(first)} to {number(third)}"


def ratio(seconds: float, reference: float) -> str:
    """Three digits."""
    return number(seconds / reference)


def number(value: float) -> str:
    """Three digits, and no powers of ten; a dash for NaN."""
    if np.isnan(value):
        return ABSENT
    return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"


def bold_below_one(value: float) -> str:
    """A rival's figure over our own: bold where the rival is better."""
    return f"**{value:.2f}**" if value < 1 else number(value)
