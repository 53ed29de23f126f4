"""How well scans were tracked, and whether that makes the result doubtful."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from typing import Literal, NamedTuple

import numpy as np

from .. import _core
from .._report import Quality, counted, runs_of, some_of
from ..formats.names import Number
from ..scans import ScanReader
from ..tracker import Agreement, Tracker, TrackingReport

_MOST_FRAMES = 5
_MORE_THAN_OTHERS = 2.0
"""A camera is suspected whose share is so many times the median of the others."""
_FARTHER_THAN_OTHERS = 3.0
_FAR = 0.3
"""So is one whose distance is so many times the median of the others, beyond a share of a mean edge
by which a template that is not quite in place is off."""
_NOISY = 0.2
"""Noise is told beyond this share of a mean edge,"""
_CROWDED = 0.02
"""and other things from this share of the points on."""


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

    def add(self, agreement: Agreement | TrackingReport) -> None:
        """Adds a frame."""
        if agreement.points:
            self.points += agreement.points
            self.far += agreement.far * agreement.points
            if agreement.far < 1:
                self.squares += agreement.distance**2 * (1 - agreement.far) * agreement.points

    @property
    def share(self) -> float:
        """The share of far points; 0 without points."""
        return self.far / self.points if self.points else 0.0

    @property
    def distance(self) -> float | None:
        """The root mean square distance of the points that are not far; None without any."""
        near = self.points - self.far
        return float(np.sqrt(self.squares / near)) if near > 0 else None


@dataclass(frozen=True)
class FrameQuality:
    """How good a frame is that was tracked; the attributes are those of its TrackingReport.

    Attributes:
        frame: its number, that of its file.
    """

    frame: Number
    quality: Literal["good", "doubtful", "ruined"]
    explained: float
    contradicted: float
    stretch: float
    growth: float
    doubt: float
    far: float
    others: float
    noise: float
    seen: float
    recovered: bool
    seconds: float
    reason: str

    @classmethod
    def of(cls, tracked: "Tracked") -> "FrameQuality":
        """Takes what a report says."""
        names = [attribute.name for attribute in fields(cls)][1:]
        return cls(tracked.number, *(getattr(tracked.report, name) for name in names))


class Tracked(NamedTuple):
    """A frame whose scan had points."""

    number: Number
    report: TrackingReport


@dataclass
class Fits:
    """What is known of the frames that were tracked.

    Attributes:
        mean_edge: of the template.
        advice: says what to do if the first frame is not good or a camera suspected.
        start: why the start is doubtful; empty if it is not.
        total: the points of all cameras.
        cameras: those of each one that has points.
        tracked: the frames with points.
        empty: number of frames without points.
        unmeasured: the numbers of the frames of which nothing or hardly anything was measured.
    """

    mean_edge: float = 1.0
    advice: Callable[[], str] = str
    start: str = ""
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
        tracked = Tracked(number, tracker.report)
        self.tracked.append(tracked)
        if tracked.report.cause == "unseen":
            self.unmeasured.append(number)
        self.total.add(tracked.report)
        sensors = tracker.agreement_of_sensors
        for name, agreement in zip(scans.cameras_of(frame), sensors, strict=True):
            if agreement.points:
                self.cameras.setdefault(name, Counts()).add(agreement)

    @property
    def quality(self) -> Quality:
        """What the frames, the cameras and the start tell."""
        frames = self._frames
        is_doubtful = self.suspects or self.start or self._mostly_empty
        return "doubtful" if frames == "good" and is_doubtful else frames

    @property
    def _frames(self) -> Quality:
        """How good the frames are together of which more than hardly anything was measured."""
        return _core.quality_of_frames([tracked.report.quality for tracked in self._measured])

    @property
    def _measured(self) -> list[Tracked]:
        return [tracked for tracked in self.tracked if tracked.report.cause != "unseen"]

    def _usual(self, name: str) -> float:
        """The median of a number of the reports; 0 without any."""
        numbers = [getattr(tracked.report, name) for tracked in self._measured]
        return float(np.median(numbers)) if numbers else 0.0

    @property
    def _mostly_empty(self) -> bool:
        return 2 * len(self.unmeasured) > len(self.tracked) + self.empty

    @property
    def suspects(self) -> tuple[str, ...]:
        """The cameras with far more of them than the others, or that are much farther away."""
        shares = {name: camera.share for name, camera in self.cameras.items()}
        each = ((name, camera.distance) for name, camera in self.cameras.items())
        known = {name: distance for name, distance in each if distance is not None}
        more = _beyond(shares, _MORE_THAN_OTHERS, _core.ruined_far)
        farther = _beyond(known, _FARTHER_THAN_OTHERS, _FAR * self.mean_edge)
        return tuple(name for name in self.cameras if name in more | farther)

    @property
    def reason(self) -> str:
        """What is wrong with the result, in a sentence; empty if nothing is."""
        messages = []
        if self.start:
            messages.append(self.start)
        if self._mostly_empty:
            messages.append("hardly anything was measured of most frames")
        if self._frames != "good":
            messages += self._told_of_frames()
        if self.suspects:
            messages.append(
                f"{self.total.share:.1%} of the points are farther than a mean edge from the mesh"
            )
            cameras = (
                f"{name!r} ({camera.share:.1%} far, the others {camera.distance or 0.0:.2g} away)"
                for name, camera in self.cameras.items()
                if name in self.suspects
            )
            messages.append(
                f"of cameras {', '.join(cameras)}, points are farther from the mesh than those of "
                "the others"
            )
        starts_badly = self.tracked and self.tracked[0].report.quality != "good"
        if (self.suspects or self.start or starts_badly) and (advice := self.advice()):
            messages.append(advice)
        how = {"good": "", "doubtful": "doubtful: ", "ruined": "probably ruined: "}[self.quality]
        return how + "; ".join(messages)

    def _told_of_frames(self) -> Iterator[str]:
        """Says how many frames are not good, and what is wrong with the worst one."""
        bad = [tracked for tracked in self._measured if tracked.report.quality != "good"]
        worst = max(bad, key=lambda one: (one.report.quality == "ruined", one.report.doubt))
        numbers = runs_of(tracked.number for tracked in bad)
        runs = [f"{run[0]} to {run[-1]}" if len(run) > 1 else str(run[0]) for run in numbers]
        yield (
            f"{len(bad)} of {counted(len(self._measured), 'frame')} "
            f"{'is' if len(bad) == 1 else 'are'} not good: {some_of(runs, _MOST_FRAMES)}"
        )
        yield f"of frame {worst.number}, which is {worst.report.quality}, {worst.report.reason}"

    @property
    def remarks(self) -> tuple[str, ...]:
        """What else the user should know."""
        messages = []
        if self.unmeasured:
            names = some_of([str(number) for number in self.unmeasured], _MOST_FRAMES)
            messages.append(f"hardly anything was measured of frames {names}")
        noise = self._usual("noise")
        if noise > _NOISY * self.mean_edge:
            messages.append(
                f"the points are noisy: they scatter by {noise:.2g} about their surface, "
                f"{noise / self.mean_edge:.2g} mean edges"
            )
        if (others := self._usual("others")) > _CROWDED:
            messages.append(
                f"{others:.0%} of the points belong to other things, mostly "
                f"{self._usual('others_distance'):.2g} from the mesh"
            )
        seen = [tracked.report.seen for tracked in self._measured]
        if (falls := _core.falling_sight(seen)) < len(seen):
            messages.append(
                f"of the vertices, {max(seen[:falls]):.0%} were seen until frame "
                f"{self._measured[falls - 1].number}, and {seen[falls]:.0%} in frame "
                f"{self._measured[falls].number}; what no camera sees is estimated, as standard "
                "errors tell"
            )
        return tuple(messages)


def _beyond(values: Mapping[str, float], times: float, least: float) -> set[str]:
    """Returns the names whose value is so many times the median of the others, and not small."""
    result = set()
    for name, value in values.items():
        others = [value for other, value in values.items() if other != name]
        if others and value > max(least, times * float(np.median(others))):
            result.add(name)
    return result
