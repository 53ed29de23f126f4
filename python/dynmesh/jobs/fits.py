"""How well scans were tracked, frame by frame and camera by camera."""

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from .._core import Agreement, Tracker, TrackingReport

Quality = Literal["good", "doubtful", "ruined"]

_DOUBTFUL = 0.02
"""The share of far points of a sequence from which on a part of the mesh is probably wrong."""
_RUINED = 0.05
_BAD_FRAME = 0.05
_BAD_CAMERA = 0.05
_MOST_FRAMES = 5
_MORE_THAN_OTHERS = 2.0
"""A camera is suspected whose share is so many times the median of the others."""

_COLUMNS = ("frame", "camera", "points", "far", "disagreeing", "distance", "seen")


class Fits:
    """The agreements of the frames of one run, and the table of them.

    Attributes:
        path: of the table, or None.
    """

    def __init__(self, path: Path | None) -> None:
        """Writes nothing yet."""
        self.path = path
        self._frames: list[tuple[int, TrackingReport]] = []
        self._cameras: dict[str, list[Agreement]] = {}

    def begin(self, done: int) -> None:
        """Begins the table, or keeps its rows of the frames that an earlier run had done."""
        if self.path is None:
            return
        kept = []
        if done and self.path.exists():
            with self.path.open(newline="", encoding="utf-8") as file:
                for row in csv.reader(file):
                    if row and row[0].isdecimal() and int(row[0]) < done:
                        kept.append(row)
        with self.path.open("w", newline="", encoding="utf-8") as file:
            csv.writer(file).writerows([_COLUMNS, *kept])

    def add(self, frame: int, tracker: Tracker, cameras: Sequence[str]) -> None:
        """Adds the last frame of a tracker; `cameras` are the names of its sensors."""
        report, sensors = tracker.report, tracker.agreement_of_sensors
        if len(cameras) != len(sensors):
            cameras = [str(number) for number in range(len(sensors))]
        rows = [[frame, "", *_cells(report), f"{np.mean(tracker.observed):.6g}"]]
        rows += [[frame, c, *_cells(a), ""] for c, a in zip(cameras, sensors, strict=True)]
        if self.path is not None:  # row by row, so that a killed process leaves them
            with self.path.open("a", newline="", encoding="utf-8") as file:
                csv.writer(file).writerows(rows)
        if not report.points:
            return
        self._frames.append((frame, report))
        for camera, agreement in zip(cameras, sensors, strict=True):
            self._cameras.setdefault(camera, []).append(agreement)

    @property
    def far(self) -> float | None:
        """The share of the points of all frames that are far from the mesh; None without any."""
        return _share([report for _, report in self._frames])

    @property
    def quality(self) -> Quality:
        """What that share tells."""
        far = self.far or 0.0
        if far > _RUINED:
            return "ruined"
        return "doubtful" if far > _DOUBTFUL or self.suspects else "good"

    @property
    def worst(self) -> tuple[tuple[int, float], ...]:
        """The frames of which many points are far, and their shares, the worst one first."""
        bad = [(frame, report.far) for frame, report in self._frames if report.far > _BAD_FRAME]
        return tuple(sorted(bad, key=lambda one: -one[1])[:_MOST_FRAMES])

    @property
    def cameras(self) -> dict[str, float]:
        """The share of far points of each camera that has points."""
        shares = {camera: _share(found) for camera, found in self._cameras.items()}
        return {camera: share for camera, share in shares.items() if share is not None}

    @property
    def suspects(self) -> tuple[str, ...]:
        """The cameras with far more of them than the others."""
        found = []
        for camera, share in self.cameras.items():
            others = [one for name, one in self.cameras.items() if name != camera]
            if others and share > max(_BAD_CAMERA, _MORE_THAN_OTHERS * np.median(others)):
                found.append(camera)
        return tuple(found)


def _cells(one: Agreement | TrackingReport) -> list[str]:
    if not one.points:
        return ["0", "", "", ""]
    distance = "" if np.isnan(one.distance) else f"{one.distance:.6g}"
    return [str(one.points), f"{one.far:.6g}", f"{one.disagreeing:.6g}", distance]


def _share(found: Sequence[Agreement | TrackingReport]) -> float | None:
    points = sum(one.points for one in found)
    return sum(one.far * one.points for one in found if one.points) / points if points else None
