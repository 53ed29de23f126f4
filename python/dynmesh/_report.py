"""What all reports have in common."""

import csv
import dataclasses
import math
import sys
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

Quality = Literal["good", "doubtful", "ruined", "failed"]


class DoubtfulWarning(UserWarning):
    """A result is doubtful or probably ruined, by its own measure."""


def warn(message: str, kind: type[Warning] = UserWarning) -> None:
    """Warns at the line outside of this package that asked for what was done."""
    package, level, frame = str(Path(__file__).parent), 1, sys._getframe()
    while frame.f_back is not None and frame.f_code.co_filename.startswith(package):
        frame, level = frame.f_back, level + 1
    warnings.warn(message, kind, stacklevel=level)


@dataclass(frozen=True, kw_only=True)
class Report:
    """What was done. Printed, it is :meth:`lines`.

    Attributes:
        quality: "good"; "doubtful" or "ruined", of a result that was written but is probably wrong,
            by its own measure; "failed" if something was not done.
        reason: why the quality is not good, in a sentence; empty if it is.
        remarks: remarks for the user, one line each.
    """

    quality: Quality = "good"
    reason: str = ""
    remarks: tuple[str, ...] = ()

    def lines(self) -> list[str]:
        """Says what was done, and how well, in sentences."""
        return [*([self.reason] if self.reason else []), *self.remarks]

    def to_dict(self) -> dict[str, Any]:
        """Returns the attributes as values that JSON has; None where a number is not finite."""
        return {
            one.name: as_json(getattr(self, one.name))
            for one in dataclasses.fields(self)
            if one.repr
        }

    def __str__(self) -> str:
        return "\n".join(self.lines())


@dataclass(frozen=True, kw_only=True)
class OutputReport(Report):
    """What was done to make frames in a file or folder.

    Attributes:
        output: the file or folder that was written.
        frames: number of frames in it.
    """

    output: Path
    frames: int


def write_csv(path: Path, kind: type, rows: Iterable[Any]) -> None:
    """Writes a table with a row for each object of a dataclass."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(field.name for field in dataclasses.fields(kind))
        writer.writerows(dataclasses.astuple(one) for one in rows)


def as_json(value: Any) -> Any:
    """Returns a value as JSON has it."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {one.name: as_json(getattr(value, one.name)) for one in dataclasses.fields(value)}
    if hasattr(value, "tolist"):  # an array or number of numpy, which takes long to load
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(name): as_json(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [as_json(one) for one in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return str(value) if isinstance(value, Path) else value


def listed(names: Iterable[object], last: str = "and") -> str:
    """Joins names to a list such as "a, b and c"."""
    *most, end = map(str, names)
    return f"{', '.join(most)} {last} {end}" if most else end


def some_of(names: list[str], most: int = 10) -> str:
    """Joins names to a list, which is cut off if it is long."""
    rest = [f"and {len(names) - most} more"] if len(names) > most else []
    return ", ".join(names[:most] + rest)


def counted(count: int, what: str) -> str:
    """Returns a number with its noun, such as "1 vertex" or "2 vertices"."""
    plural = "vertices" if what == "vertex" else f"{what}s"
    return f"{count} {what if count == 1 else plural}"
