"""How well scans were tracked, and whether that makes the result doubtful."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from .._report import Quality
from ..scans import Scan, ScanReader
from ..tracker import Agreement, Tracker, TrackingReport

_DOUBTFUL = 0.02
"""The share of far points of a sequence from which on a part of the mesh is probably wrong."""
_RUINED = 0.05
_BAD_FRAME = 0.05
_BAD_CAMERA = 0.05
_MOST_FRAMES = 5
_MORE_THAN_OTHERS = 2.0
"""A camera is suspected whose share is so many times the median of the others."""
_FARTHER_THAN_OTHERS = 3.0
_MEASURED = 0.01
"""So is one whose distance is so many times the median of the others, beyond a share of a mean edge
below which distances are those of rounding."""
_HARDLY = 0.01
"""Of a frame in which a smaller share of the vertices has a correspondence, hardly anything was
measured."""

_QUALITIES = {"doubtful": "doubtful", "ruined": "probably ruined"}


@dataclass
class Counts:
    """Numbers of points; they are fractions where shares of them were estimated.

    Attributes:
        points: those that were compared.
        far: those of them that are far from the mesh.
        squares: the sum of the squared distances of those that are not far.
    """

    points: float = 0.0
    far: float = 0.0
    squares: float = 0.0

    def add(self, one: Agreement | TrackingReport) -> None:
        """Adds a frame."""
        if one.points:
            self.points += one.points
            self.far += one.far * one.points
            if one.far < 1:
                self.squares += one.distance**2 * (1 - one.far) * one.points

    @property
    def share(self) -> float | None:
        """The share of far points; None without points."""
        return self.far / self.points if self.points else None

    @property
    def distance(self) -> float | None:
        """The root mean square distance of the points that are not far; None without any."""
        near = self.points - self.far
        return float(np.sqrt(self.squares / near)) if near > 0 else None


@dataclass
class Fits:
    """What is known of the frames that were tracked.

    Attributes:
        total: of all cameras.
        cameras: of each one that has points.
        worst: the frames of which many points are far, and their shares, the worst one first.
        frames: number of frames with points.
        first: the share of far points of the first of them.
        observed: the sum over these frames of the share of vertices with a correspondence.
        prior_weight: the sum of their prior weights.
        recovered: number of them in which the mesh was lost and found again.
        empty: number of frames without points.
        unmeasured: number of frames of which nothing or hardly anything was measured.
        first_unmeasured: the first of these.
        mean_edge: of the template.
        advice: what to do if the first frame is ruined or a camera suspected.
        registered: why the registration of the template is doubtful; empty if it is not.
    """

    total: Counts = field(default_factory=Counts)
    cameras: dict[str, Counts] = field(default_factory=dict)
    worst: list[tuple[int, float]] = field(default_factory=list)
    frames: int = 0
    first: float = 0.0
    observed: float = 0.0
    prior_weight: float = 0.0
    recovered: int = 0
    empty: int = 0
    unmeasured: int = 0
    first_unmeasured: list[int] = field(default_factory=list)
    mean_edge: float = 1.0
    advice: str = ""
    registered: str = ""

    def add(self, frame: int, tracker: Tracker, cameras: Sequence[str]) -> None:
        """Adds the last frame of a tracker.

        Args:
            frame: its number.
            tracker: whose last scan had points.
            cameras: the names of its sensors.
        """
        report = tracker.report
        observed = float(np.mean(tracker.observed))
        if observed < _HARDLY:
            self._add_unmeasured(frame)
        share = report.far if report.points else 0.0
        if not self.frames:
            self.first = share
        self.frames += 1
        self.observed += observed
        self.prior_weight += report.prior_weight
        self.recovered += report.recovered
        self.total.add(report)
        if share > _BAD_FRAME:
            self.worst = sorted([*self.worst, (frame, share)], key=lambda one: -one[1])
            self.worst = self.worst[:_MOST_FRAMES]
        sensors = tracker.agreement_of_sensors
        for camera, agreement in zip(cameras, sensors, strict=True):
            self.cameras.setdefault(camera, Counts()).add(agreement)

    def note(self, scans: ScanReader, frame: int, scan: Scan | None, tracker: Tracker) -> None:
        """Notes how well the last frame of a tracker fits, counted from 0."""
        number = scans.number(frame)
        if scan is None:
            self.add_empty(number)
            return
        n_sensors, cameras = len(tracker.agreement_of_sensors), scans.cameras_of(frame)
        if len(cameras) != n_sensors:
            cameras = [str(sensor) for sensor in range(n_sensors)]
        self.add(number, tracker, cameras)

    def add_empty(self, frame: int) -> None:
        """Adds a frame without points."""
        self.empty += 1
        self._add_unmeasured(frame)

    def _add_unmeasured(self, frame: int) -> None:
        self.unmeasured += 1
        self.first_unmeasured = [*self.first_unmeasured, frame][:_MOST_FRAMES]

    @property
    def far(self) -> float | None:
        """The share of the points that are far from the mesh; None without any."""
        return self.total.share

    @property
    def quality(self) -> Quality:
        """What that share, the cameras and the start tell."""
        far = self.far or 0.0
        if far > _RUINED:
            return "ruined"
        is_doubtful = far > _DOUBTFUL or self.suspects or self.registered
        return "doubtful" if is_doubtful else "good"

    @property
    def shares(self) -> dict[str, float]:
        """The share of far points of each camera that has points."""
        found = {camera: counts.share for camera, counts in self.cameras.items()}
        return {camera: share for camera, share in found.items() if share is not None}

    @property
    def suspects(self) -> tuple[str, ...]:
        """The cameras with far more of them than the others, or that are much farther away."""
        distances = {name: one.distance for name, one in self.cameras.items()}
        known = {name: one for name, one in distances.items() if one is not None}
        more = _beyond(self.shares, _MORE_THAN_OTHERS, _BAD_CAMERA)
        farther = _beyond(known, _FARTHER_THAN_OTHERS, _MEASURED * self.mean_edge)
        return tuple(name for name in self.cameras if name in more | farther)

    @property
    def reason(self) -> str:
        """What is wrong with the result, in a sentence; empty if nothing is."""
        told = []
        if self.registered:
            told.append(
                "doubtful: the template was registered with the first scan, and " + self.registered
            )
        if self.suspects or (self.far or 0.0) > _DOUBTFUL:
            told.append(
                f"{_QUALITIES[self.quality]}: {self.far:.1%} of the points are farther than a mean "
                "edge from the mesh"
            )
        if self.worst:
            told.append(
                "the worst frames are "
                + ", ".join(f"{frame} ({far:.1%})" for frame, far in self.worst)
            )
        if self.suspects:
            named = (
                f"{name!r} ({self.shares[name]:.1%} far, the others {one.distance:.2g} away)"
                for name, one in self.cameras.items()
                if name in self.suspects
            )
            told.append(
                f"of cameras {', '.join(named)}, points are farther from the mesh than those of "
                "the others, so the poses or intrinsics of these, or of one that sees the same "
                "parts, may be wrong"
            )
        if self.advice and (self.suspects or self.first > _BAD_FRAME):
            told.append(self.advice)
        return "; ".join(told)

    @property
    def remarks(self) -> tuple[str, ...]:
        """What else the user should know."""
        told = []
        if self.unmeasured:
            more = self.unmeasured - len(self.first_unmeasured)
            names = ", ".join(map(str, self.first_unmeasured)) + (
                f" and {more} more" if more else ""
            )
            told.append(
                f"hardly anything was measured of frames {names}: less than {_HARDLY:.0%} of the "
                "vertices were seen"
            )
        return tuple(told)


def _beyond(values: Mapping[str, float], times: float, least: float) -> set[str]:
    """Returns the names whose value is so many times the median of the others, and not small."""
    found = set()
    for name, value in values.items():
        others = [one for other, one in values.items() if other != name]
        if others and value > max(least, times * float(np.median(others))):
            found.add(name)
    return found
