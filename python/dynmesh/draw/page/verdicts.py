"""How good each frame is, as a table says, for the line under the slider of a page."""

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Literal, NamedTuple, get_args

from ..._errors import InputError
from ...formats.times import called
from ...frame import Frames

_Quality = Literal["unknown", "good", "doubtful", "ruined"]
_QUALITIES: tuple[_Quality, ...] = get_args(_Quality)  # the worst one last
_COLUMNS = ("frame", "quality", "reason")


class Verdict(NamedTuple):
    """How good a frame is; "unknown" if nothing was measured.

    The sentence names the frame, and why it is not good.
    """

    quality: _Quality
    sentence: str


def _read(path: Path) -> dict[float, Verdict]:
    """Reads the verdicts of frames, by number."""
    verdicts = {}
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            table = csv.DictReader(file, strict=True)
            if lacking := [name for name in _COLUMNS if name not in (table.fieldnames or [])]:
                reason = f"has no column {lacking[0]!r}; tracking writes such a table by `csv`"
                raise InputError(reason, file=path)
            for row in table:
                number, verdict = _verdict(path, table.line_num, row)
                verdicts[number] = verdict
    except (csv.Error, UnicodeDecodeError) as error:
        raise InputError(f"is not a table of comma-separated values: {error}", file=path) from error
    return verdicts


def _verdict(path: Path, line: int, row: Mapping[str, str | None]) -> tuple[float, Verdict]:
    frame, stated, reason = (row[name] or "" for name in _COLUMNS)
    try:
        number = float(frame)
    except ValueError:
        raise InputError(
            f"must be a number, not {frame!r}", argument=f"line {line}: frame", file=path
        ) from None
    quality = next((one for one in _QUALITIES if one == stated), None)
    if quality is None:
        choice = ", ".join(_QUALITIES)
        raise InputError(
            f"must be one of {choice}, not {stated!r}", argument=f"line {line}: quality", file=path
        )
    return number, Verdict(quality, f"is {quality}{reason and ': '}{reason}")


def shown_verdicts(path: Path, reader: Frames, indices: range) -> list[Verdict]:
    """Returns the worst verdict of the frames for which each shown one stands.

    Args:
        path: the table that :func:`dynmesh.track` writes.
        reader: the sequence.
        indices: the frames that are shown, of which the first is 0.
    """
    verdicts = _read(path)
    numbers = [reader.header.number(index) for index in range(reader.n_frames)]
    if others := verdicts.keys() - {*numbers}:
        reason = f"is of frame {min(others):g}, which {reader.path} does not have"
        raise InputError(reason, file=path)
    none = Verdict("unknown", "is not judged")
    found = [(called(n, numbers), *verdicts.get(n, none)) for n in numbers]
    every = [Verdict(quality, f"{frame} {sentence}") for frame, quality, sentence in found]
    return [
        max(every[first : first + indices.step], key=lambda one: _QUALITIES.index(one.quality))
        for first in indices
    ]
