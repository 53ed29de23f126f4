"""The table of how well each frame was tracked, written while that is done."""

import csv
from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np

from .._core import Agreement, Tracker, TrackingReport

_COLUMNS = ("frame", "camera", "points", "far", "in_planes", "disagreeing", "distance", "seen")


class FitTable:
    """A CSV file with rows for each frame and for each camera of it.

    Attributes:
        path: of the file, or None if nothing is to be written.
    """

    def __init__(self, path: Path | None) -> None:
        """Writes nothing yet."""
        self.path = path

    def begin(self, done: Collection[int]) -> None:
        """Begins the table, or keeps its rows of the frames that an earlier run had done."""
        if self.path is None:
            return
        self.path.parent.mkdir(parents=True, exist_ok=True)
        kept = []
        if done and self.path.exists():
            with self.path.open(newline="", encoding="utf-8") as file:
                for row in csv.reader(file):
                    if row and row[0].isdecimal() and int(row[0]) in done:
                        kept.append(row)
        with self.path.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([_COLUMNS, *kept])

    def add(
        self, frame: int, tracker: Tracker, cameras: Sequence[str], in_planes: Sequence[float]
    ) -> None:
        """Adds the last frame of a tracker; the arguments are those of :meth:`Fits.add`."""
        if self.path is None:
            return
        seen = [f"{np.mean(tracker.observed):.6g}", *("" for _ in cameras)]
        agreements: list[Agreement | TrackingReport]
        agreements = [tracker.report, *tracker.agreement_of_sensors]
        rows = [
            [frame, camera, *_cells(one, share), share_seen]
            for camera, one, share, share_seen in zip(
                ["", *cameras], agreements, in_planes, seen, strict=True
            )
        ]
        # Row by row, so that a killed process leaves them.
        with self.path.open("a", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows(rows)


def _cells(one: Agreement | TrackingReport, in_planes: float) -> list[str]:
    if not one.points:
        return ["0", "", "", "", ""]
    distance = "" if np.isnan(one.distance) else f"{one.distance:.6g}"
    shares = [one.far, in_planes * one.far, one.disagreeing]
    return [str(one.points), *(f"{share:.6g}" for share in shares), distance]
