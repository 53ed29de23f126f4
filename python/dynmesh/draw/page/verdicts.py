"""How good each frame is, as a table says, for the line under the slider of a page."""

import csv
from pathlib import Path
from typing import Literal, NamedTuple, get_args

from ..._checks import check_choice
from ..._errors import InputError, naming
from ...formats.times import called
from ...frame import Frames

_Quality = Literal["unknown", "good", "doubtful", "ruined"]  # the worst one last
_COLUMNS = ("frame", "quality", "reason")


class Verdict(NamedTuple):
    """How good a frame is; "unknown" if nothing was measured.

    The sentence names the frame, and why it is not good.
    """

    quality: str
    sentence: str


def _read(path: Path) -> dict[float, Verdict]:
    verdicts = {}
    with naming(path), path.open(newline="", encoding="utf-8-sig") as file:
        table = csv.DictReader(file, strict=True)
        try:
            lacking = [name for name in _COLUMNS if name not in (table.fieldnames or [])]
            rows = [(table.line_num, row) for row in table]
        except (csv.Error, UnicodeDecodeError) as error:
            raise InputError(f"is not a table of comma-separated values: {error}") from error
        if lacking:
            raise InputError(f"has no column {lacking[0]!r}; tracking writes such a table by `csv`")
        for line, row in rows:
            frame, quality, reason = (row[name] or "" for name in _COLUMNS)
            check_choice(f"line {line}: quality", quality, _Quality)
            try:
                number = float(frame)
            except ValueError:
                message = f"must be a number, not {frame!r}"
                raise InputError(message, argument=f"line {line}: frame") from None
            verdicts[number] = Verdict(quality, f"is {quality}{reason and ': '}{reason}")
    return verdicts


def shown_verdicts(path: Path, reader: Frames, indices: range) -> list[Verdict]:
    """Returns the worst verdict, in a table, of the frames for which each shown one stands."""
    verdicts = _read(path)
    numbers = [reader.header.number(index) for index in range(reader.n_frames)]
    if others := verdicts.keys() - {*numbers}:
        reason = f"is of frame {min(others):g}, which {reader.path} does not have"
        raise InputError(reason, file=path)
    none = Verdict("unknown", "is not judged")
    found = [(called(n, numbers), *verdicts.get(n, none)) for n in numbers]
    every = [Verdict(quality, f"{frame} {sentence}") for frame, quality, sentence in found]
    return [
        max(every[first : first + indices.step], key=lambda one: _ORDER.index(one.quality))
        for first in indices
    ]


_ORDER = get_args(_Quality)
