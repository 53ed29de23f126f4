"""How well scans were tracked, and whether that makes the result doubtful."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from .._report import Quality, some_of
from ..files.numbered import Number
from ..scans import ScanReader
from ..tracker import Agreement, Tracker, TrackingReport

_DOUBTFUL = 0.02
"""The share of far points of a sequence from which on a part of the mesh is probably wrong."""
_RUINED = 0.05
_BAD_FRAME = 0.05
_BAD_CAMERA = 0.05
_MOST_FRAMES = 5
_MORE_THAN_OTHERS = 2.0
"""A camera is suspected whose share is so many times the median of the others."""
FARTHER_THAN_OTHERS = 3.0
_MEASURED = 0.01
"""So is one whose distance is so many times the median of the others, beyond a share of a mean edge
below which distances are those of rounding."""
_HARDLY = 0.01
"""Of a frame in which a smaller share of the vertices has a correspondence, hardly anything was
measured."""


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
    def share(self) -> float:
        """The share of far points; 0 without points."""
        return self.far / self.points if self.points else 0.0

    @property
    def distance(self) -> float | None:
        """The root mean square distance of the points that are not far; None without any."""
        near = self.points - self.far
        return float(np.sqrt(self.squares / near)) if near > 0 else None


class Tracked(NamedTuple):
    """A frame whose scan had points, and the share of its vertices that had a correspondence."""

    number: Number
    report: TrackingReport
    observed: float


@dataclass
class Fits:
    """What is known of the frames that were tracked.

    Attributes:
        mean_edge: of the template.
        advice: what to do if the first frame is ruined or a camera suspected.
        registered: why the registration of the template is doubtful; empty if it is not.
        total: the points of all cameras.
        cameras: those of each one that has points.
        tracked: the frames with points.
        empty: number of frames without points.
        unmeasured: the frames of which nothing or hardly anything was measured.
    """

    mean_edge: float = 1.0
    advice: str = ""
    registered: str = ""
    total: Counts = field(default_factory=Counts)
    cameras: dict[str, Counts] = field(default_factory=dict)
    tracked: list[Tracked] = field(default_factory=list)
    empty: int = 0
    unmeasured: list[Number] = field(default_factory=list)

    def add(self, scans: ScanReader, frame: int, tracker: Tracker, *, is_empty: bool) -> None:
        """Adds the last frame of a tracker, counted from 0."""
        number = scans.number(frame)
        if is_empty:
            self.empty += 1
            self.unmeasured.append(number)
            return
        one = Tracked(number, tracker.report, float(np.mean(tracker.observed)))
        self.tracked.append(one)
        if one.observed < _HARDLY:
            self.unmeasured.append(number)
        self.total.add(one.report)
        sensors = tracker.agreement_of_sensors
        for name, agreement in zip(scans.cameras_of(frame), sensors, strict=True):
            if agreement.points:
                self.cameras.setdefault(name, Counts()).add(agreement)

    @property
    def quality(self) -> Quality:
        """What the share of far points, the cameras and the start tell."""
        if self.total.share > _RUINED:
            return "ruined"
        is_doubtful = (
            self.total.share > _DOUBTFUL or self.suspects or self.registered or self._mostly_empty
        )
        return "doubtful" if is_doubtful else "good"

    @property
    def _mostly_empty(self) -> bool:
        return 2 * len(self.unmeasured) > len(self.tracked) + self.empty

    @property
    def worst(self) -> list[Tracked]:
        """The frames of which many points are far, the worst one first."""
        bad = [one for one in self.tracked if one.report.far > _BAD_FRAME]
        return sorted(bad, key=lambda one: -one.report.far)[:_MOST_FRAMES]

    @property
    def suspects(self) -> tuple[str, ...]:
        """The cameras with far more of them than the others, or that are much farther away."""
        shares = {name: one.share for name, one in self.cameras.items()}
        each = ((name, one.distance) for name, one in self.cameras.items())
        known = {name: distance for name, distance in each if distance is not None}
        more = beyond(shares, _MORE_THAN_OTHERS, _BAD_CAMERA)
        farther = beyond(known, FARTHER_THAN_OTHERS, _MEASURED * self.mean_edge)
        return tuple(name for name in self.cameras if name in more | farther)

    @property
    def reason(self) -> str:
        """What is wrong with the result, in a sentence; empty if nothing is."""
        told = []
        if self.registered:
            told.append(
                "the template was registered with the first scan, and "
                f"{self.registered}; the page of dynmesh register shows whether it is the right "
                "mesh"
            )
        if self.suspects or self.total.share > _DOUBTFUL:
            told.append(
                f"{self.total.share:.1%} of the points are farther than a mean edge from the mesh"
            )
        if self._mostly_empty:
            told.append("hardly anything was measured of most frames")
        if self.worst:
            named = ", ".join(f"{one.number} ({one.report.far:.1%})" for one in self.worst)
            told.append(f"the worst frames are {named}")
        if self.suspects:
            cameras = (
                f"{name!r} ({one.share:.1%} far, the others {one.distance or 0.0:.2g} away)"
                for name, one in self.cameras.items()
                if name in self.suspects
            )
            told.append(
                f"of cameras {', '.join(cameras)}, points are farther from the mesh than those of "
                "the others, so the poses or intrinsics of these, or of one that sees the same "
                "parts, may be wrong"
            )
        starts_badly = self.tracked and self.tracked[0].report.far > _BAD_FRAME
        if self.advice and (self.suspects or starts_badly):
            told.append(self.advice)
        how = {"good": "", "doubtful": "doubtful: ", "ruined": "probably ruined: "}[self.quality]
        return how + "; ".join(told)

    @property
    def remarks(self) -> tuple[str, ...]:
        """What else the user should know."""
        if not self.unmeasured:
            return ()
        names = some_of([str(number) for number in self.unmeasured], _MOST_FRAMES)
        told = f"hardly anything was measured of frames {names}: less than {_HARDLY:.0%} of the "
        return (told + "vertices were seen",)


def beyond(values: Mapping[Any, float], times: float, least: float) -> set[Any]:
    """Returns the names whose value is so many times the median of the others, and not small."""
    found = set()
    for name, value in values.items():
        others = [one for other, one in values.items() if other != name]
        if others and value > max(least, times * float(np.median(others))):
            found.add(name)
    return found
