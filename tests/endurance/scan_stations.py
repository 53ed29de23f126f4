"""A tracker with random events, and checks of everything that is documented."""

from collections.abc import Callable
from typing import Any

import numpy as np
from bad_calls import BAD_SCANS
from numpy.typing import NDArray
from watched import Array, Watched

import dynmesh
from dynmesh import degrade
from dynmesh.scans import DepthScan, PointScan

# How often each event occurs in a thousand frames.
EVENTS = {
    "points": 360,
    "no normals": 40,
    "depth images": 300,
    "outliers": 60,
    "half missing": 60,
    "empty scan": 20,
    "no scan": 20,
    "scan far away": 10,
    "bad scan": 40,
    "tracker's state, restore": 20,
    "new template": 15,
    "new tracker": 5,
}

_SOUND = {"points", "depth images"}
_NEAR = 1.0  # mean edges


class ScanStation(Watched[dynmesh.Tracker]):
    """One tracker and its endless stream of scans.

    Attributes:
        sound: number of whole scans without outliers.
        lost: number of those after which the mesh was far from the scan. After other scans, it may
            take some frames to find the surface again.
    """

    def __init__(
        self, name: str, frames: Array, faces: NDArray[np.int32], seed: int, **settings: Any
    ) -> None:
        """The scans of `frames` are played forwards and backwards in turn."""
        cameras = degrade.orbit(frames[0], 3)(0)
        self._points: list[PointScan] = list(
            degrade.scan_points(frames, faces, cameras, points=3 * len(frames[0]), seed=seed)
        )
        self._images: list[DepthScan] = list(
            degrade.depth_images(frames, faces, cameras, width=48, height=36, seed=seed)
        )
        sides = frames[0][faces] - frames[0][np.roll(faces, 1, axis=1)]
        self._edge = float(np.linalg.norm(sides, axis=2).mean())
        self.sound = self.lost = 0
        super().__init__(name, frames, faces, seed, EVENTS, **settings)
        for tracker in (self._subject, self._twin):
            self._make_room(tracker)

    def _new(self) -> dynmesh.Tracker:
        return dynmesh.Tracker(self._faces, self._frames[self._place], **self._settings)

    def _make_room(self, tracker: dynmesh.Tracker) -> None:
        """Lets it measure the largest scans first, since memory grows with the largest so far."""
        largest = max(self._points, key=lambda scan: len(scan.points))
        scan = _with_outliers(largest, self._rng, 0.2)
        tracker.push(scan.points, viewpoints=scan.viewpoints)
        tracker.push_depth(*self._images[0])
        tracker.reset(self._frames[self._place])

    def _do(self, event: str) -> None:
        tracker, scan, images = self._subject, self._points[self._place], self._images[self._place]
        match event:
            case "points":
                self._push(event, lambda: _pushed(tracker, scan))
            case "no normals":
                self._push(event, lambda: tracker.push(scan.points, viewpoints=scan.viewpoints))
            case "depth images":
                self._push(event, lambda: tracker.push_depth(*images))
            case "outliers":
                given_points = _with_outliers(scan, self._rng, 0.2)
                self._push(event, lambda: _pushed(tracker, given_points))
            case "half missing":
                side = scan.points @ self._rng.normal(size=3)
                half = _of(scan, side > np.median(side))
                self._push(event, lambda: _pushed(tracker, half))
            case "empty scan":
                none = _of(scan, np.zeros(len(scan.points), bool))
                self._push(event, lambda: _pushed(tracker, none), nothing=True)
            case "no scan":
                self._push(event, tracker.skip, nothing=True)
            case "scan far away":
                away = scan._replace(points=scan.points + scan.points.dtype.type(1e4))
                self._push(event, lambda: _pushed(tracker, away), nothing=True)
            case "bad scan":
                kind = self._random.choice(list(BAD_SCANS))
                normals = scan.points if scan.normals is None else scan.normals
                self._check_refused(kind, BAD_SCANS[kind], scan.points, normals)
                self._move_on(kind, scan)
            case "tracker's state, restore":
                self._move_on(event, scan)
            case "new template":
                tracker.reset(self._frames[self._place])
                self._start(event, scan)
            case "new tracker":
                self._subject = self._new()
                self._start(event, scan)

    def _start(self, event: str, scan: PointScan) -> None:
        """Gives it a first scan, which must be where the template is, as later ones need not."""
        self._push(event, lambda: _pushed(self._subject, scan))

    def _push(self, event: str, call: Callable[[], Array], *, nothing: bool = False) -> Array:
        """Gives it a scan, from which `nothing` can be measured."""
        tracked = self._timed(event, call)
        tracker, k = self._subject, len(tracked)
        report = tracker.report
        if report.known + report.filled + report.disconnected != k:
            self._blame(event, "the report's numbers do not add up")
        if report.known != np.count_nonzero(tracker.observed):
            self._blame(event, f"reports {report.known} known vertices, but observed others")
        if nothing and report.known:
            self._blame(event, f"{report.known} vertices were observed in nothing")
        if self._settings.get("uncertainty") and not (tracker.standard_error >= 0).all():
            self._blame(event, "a standard error is not a number, or negative")
        if event in _SOUND:
            self.sound += 1
            self.lost += not self._is_found(tracked)
        return tracked

    def _is_found(self, tracked: Array) -> bool:
        """Whether the vertices are where the surface was measured."""
        some = self._points[self._place].points[::10]
        distances = np.linalg.norm(some[:, None] - tracked, axis=2).min(axis=1)
        return float(np.median(distances)) < _NEAR * self._edge

    def _move_on(self, event: str, scan: PointScan) -> None:
        self._check_restored(
            event,
            lambda tracker: _pushed(tracker, scan),
            lambda: self._push(event, lambda: _pushed(self._subject, scan)),
        )


def _pushed(tracker: dynmesh.Tracker, scan: PointScan) -> Array:
    return tracker.push(scan.points, scan.normals, viewpoints=scan.viewpoints)


def _of(scan: PointScan, kept: NDArray[np.bool_]) -> PointScan:
    normals = None if scan.normals is None else scan.normals[kept]
    return scan._replace(points=scan.points[kept], normals=normals)


def _with_outliers(scan: PointScan, rng: np.random.Generator, share: float) -> PointScan:
    """Moves some points anywhere within the bounding box, and a little beyond."""
    points = scan.points.copy()
    moved = rng.random(len(points)) < share
    low, high = points.min(axis=0), points.max(axis=0)
    points[moved] = low + (high - low) * rng.uniform(-0.2, 1.2, (np.count_nonzero(moved), 3))
    return scan._replace(points=points)
