"""The table of how well each frame was tracked."""

import csv
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from ..diagnosis.surroundings import shares_in_planes
from ..files.new_output import new_output
from ..scans import PointScan, Scan, ScanReader
from ..sequence import Positions
from ..tracker import Agreement, Tracker, TrackingReport
from .fits import Fits

_MANY_FAR = 0.01
"""A frame of which fewer points are far is good, whatever these are."""

_COLUMNS = ("frame", "camera", "points", "far", "in_planes", "disagreeing", "distance", "seen")


class FitTable:
    """A CSV file with rows for each frame and for each camera of it."""

    def __init__(self, file: IO[str]) -> None:
        """Writes the heading."""
        self._rows = csv.writer(file)
        self._rows.writerow(_COLUMNS)

    def add(
        self, frame: int, tracker: Tracker, cameras: Sequence[str], in_planes: Sequence[float]
    ) -> None:
        """Adds the last frame of a tracker; the arguments are those of :meth:`Fits.add`."""
        seen = [f"{np.mean(tracker.observed):.6g}", *("" for _ in cameras)]
        agreements: list[Agreement | TrackingReport]
        agreements = [tracker.report, *tracker.agreement_of_sensors]
        self._rows.writerows(
            [frame, camera, *_cells(one, share), share_seen]
            for camera, one, share, share_seen in zip(
                ["", *cameras], agreements, in_planes, seen, strict=True
            )
        )


@contextmanager
def fit_table(path: Path | None, overwrite: bool) -> Iterator[FitTable | None]:
    """Yields a table that appears at this path at the end, or None if there is none."""
    if path is None:
        yield None
        return
    with (
        new_output(path, overwrite) as hidden,
        hidden.open("w", newline="", encoding="utf-8") as file,
    ):
        yield FitTable(file)


def _cells(one: Agreement | TrackingReport, in_planes: float) -> list[str]:
    if not one.points:
        return ["0", "", "", "", ""]
    distance = "" if np.isnan(one.distance) else f"{one.distance:.6g}"
    shares = [one.far, in_planes * one.far, one.disagreeing]
    return [str(one.points), *(f"{share:.6g}" for share in shares), distance]


def judge(
    fits: Fits,
    table: FitTable | None,
    scans: ScanReader,
    frame: int,
    scan: Scan | None,
    tracker: Tracker,
    faces: NDArray[np.integer[Any]],
    points: Positions,
) -> None:
    """Notes how well the last frame of a tracker fits, whose vertices are at `points`."""
    sensors = tracker.agreement_of_sensors
    cameras = scans.cameras_of(frame)
    if len(cameras) != len(sensors):
        cameras = [str(number) for number in range(len(sensors))]
    in_planes = [0.0] * (1 + len(sensors))
    if scan is not None and tracker.report.far > _MANY_FAR:
        clouds = [scan.cloud] if isinstance(scan, PointScan) else scan.clouds
        whole, *each = shares_in_planes(faces, points, clouds)
        in_planes = [whole, *(each if len(each) == len(sensors) else len(sensors) * [whole])]
    number = scans.number(frame)
    if table is not None:
        table.add(number, tracker, cameras, in_planes)
    if scan is None:
        fits.add_empty(number)
    else:
        fits.add(number, tracker, cameras, in_planes)
