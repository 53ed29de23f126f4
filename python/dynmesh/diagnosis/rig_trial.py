"""The first scan and a template, compared in each way that users confuse."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._core import find_alignment
from ..files.scans import Rig, ScanCamera
from ..sequence import Positions
from .rig_reading import (
    Hypothesis,
    Reading,
    Units,
    about_images,
    about_poses,
    about_swapped,
    about_turns,
    about_units,
    turned,
)
from .rig_view import View
from .surface_distance import Surface

_Floats = NDArray[np.float64]

_POINTS = 400
"""Points of all views that are compared."""

LEAST_POINTS = 60
"""Fewer points tell nothing."""

_HOPELESS = 4.0
"""Mean edges: a hypothesis that leaves the scan farther from the template is not looked at."""

_WELL = 0.9
"""Where this share of the points of every camera is near, nothing is wrong."""

_COVERED = 0.4
"""Where the near points extend over less than this share of the template, nothing fits: a scan that
is far too small is near everywhere."""

_FITS = 0.6
_FAR_LEFT = 0.5
_MORE = 0.15
_NEARER = 0.6
"""A hypothesis is named if at least `_FITS` of the points are near, `_MORE` more than without it,
and at most `_FAR_LEFT` as many are far; or if `_WELL` are near, and the distance is `_NEARER` of
that without it, as for shapes that are nearly symmetric."""

_OTHER_UNIT = 0.3
_FITS_IN_UNIT = 0.85
"""No unit is wrong where more than `_OTHER_UNIT` of the points are near, or after which less than
`_FITS_IN_UNIT` are: a room that shrinks to the size of the subject is near most of it."""

_ALIGNED = 0.1
"""What a motion of the template costs, as a share of the points."""


@dataclass(frozen=True)
class Fit:
    """How well scans lie on a template.

    Attributes:
        near: share of the points within the unit of the surface.
        by_camera: this share of each camera.
        points: of each camera, in the place of the template.
        typical: the mean distance of the nearest three quarters, in units of the surface.
        is_aligned: whether the template had to be moved there.
    """

    near: float
    by_camera: tuple[float, ...]
    points: tuple[_Floats, ...]
    typical: float = np.inf
    is_aligned: bool = False

    @property
    def score(self) -> float:
        """What hypotheses are compared by; of several that fit, one without a motion is right."""
        return self.near - _ALIGNED * self.is_aligned

    @property
    def is_good(self) -> bool:
        """Whether nothing is wrong."""
        return bool(self.by_camera) and min(self.by_camera) >= _WELL

    def is_clearly_better_than(self, now: "Fit") -> bool:
        """Whether a reading that fits so is probably meant, if scans and template fit as `now`."""
        if self.near >= _WELL and self.typical <= _NEARER * now.typical:
            return True
        less_far = 1 - self.near <= _FAR_LEFT * (1 - now.near)
        return self.near >= _FITS and self.near >= now.near + _MORE and less_far


NOWHERE = Fit(0.0, (), ())


class RigTrial:
    """The first scan of a rig and a template, compared in different readings.

    Attributes:
        reading: that which is asked for.
        fit: how well the scan lies on the template as it is read so.
    """

    def __init__(
        self,
        views: Iterable[View],
        stated: Rig | None,
        faces: NDArray[Any],
        template: Positions,
        reading: Reading,
    ) -> None:
        """Compares the first reading; `stated` are the cameras as their file describes them."""
        self._whole = tuple(views)
        self._without_room: dict[Any, tuple[View, ...]] = {}
        self._stated = stated
        self._template = template
        self._surface = Surface(faces, template)
        self.reading = reading
        self.fit = self._fit(reading)

    def surface(self, reading: Reading) -> Surface:
        """Returns the template as it is read."""
        if not reading.turns:
            return self._surface
        return Surface(self._surface.faces, turned(self._template, reading.turns))

    def views(self, reading: Reading) -> tuple[View, ...]:
        """Returns the views without the room, for which the size of the template counts."""
        scale = reading.factor
        if reading.corrections.depth_scale is not None and self._whole[0].camera is not None:
            scale *= reading.corrections.depth_scale / (self._whole[0].camera.depth_scale or 1.0)
        way = scale, reading.corrections.intrinsics_size
        if way not in self._without_room:
            cameras, each = self._cameras(reading), _POINTS // len(self._whole)
            size, edge = self._surface.size / scale, self._surface.mean_edge / scale
            self._without_room[way] = tuple(
                view.without_room(cameras.get(view.name), size, edge).some(each)
                for view in self._whole
            )
        return self._without_room[way]

    def _cameras(self, reading: Reading) -> dict[str, ScanCamera]:
        return reading.cameras_of(self._stated, {view.name: view.size for view in self._whole})

    def clouds(self, reading: Reading) -> list[_Floats]:
        """Returns the points of each view in the unit of the template."""
        cameras = self._cameras(reading)
        views = self.views(reading)
        return [view.cloud(cameras.get(view.name)) * reading.factor for view in views]

    @property
    def left(self) -> int:
        """The number of points that are compared."""
        return sum(map(len, self.clouds(self.reading)))

    def better(self, units: Units) -> tuple[Hypothesis, Fit] | None:
        """Returns the hypothesis that fits clearly better, and how well; or None."""
        now, reading, rig = self.fit, self.reading, self._stated
        if now.is_good or self.left < LEAST_POINTS:
            return None
        kinds: list[Callable[[], Iterable[Hypothesis]]] = [self._likely_turns]
        if rig is not None and self._whole[0].camera is not None:
            sizes = {view.name: view.size for view in self._whole}
            kinds = [
                lambda: about_poses(reading),
                lambda: about_swapped(reading, rig),
                lambda: about_images(reading, rig, sizes),
                *kinds,
            ]
        if now.near < _OTHER_UNIT:
            kinds.append(lambda: about_units(reading, rig, units))
        best: tuple[Hypothesis, Fit] | None = None
        for kind in kinds:
            for hypothesis in kind():
                fit = self._fit(hypothesis.reading, quick=True)
                if hypothesis.is_of_units and fit.near < _FITS_IN_UNIT:
                    continue
                if best is None or fit.score > best[1].score:
                    best = hypothesis, fit
            if best is not None and best[1].near >= _WELL and best[1].is_clearly_better_than(now):
                return best
        return best if best is not None and best[1].is_clearly_better_than(now) else None

    def _fit(self, reading: Reading, quick: bool = False) -> Fit:
        """Returns how well the scans lie on the template, after the rigid motion of tracking.

        If `quick`, what cannot fit well is left early.
        """
        clouds = self.clouds(reading)
        cloud = np.concatenate(clouds)
        if len(cloud) < LEAST_POINTS:
            return NOWHERE
        surface = self.surface(reading)
        found = find_alignment(surface.faces, surface.points, cloud)
        if found.other_unit or (quick and found.after > _HOPELESS):
            return NOWHERE
        moved = surface.drawn((cloud - found.shift) @ found.rotation)
        near = surface.distances(moved) <= surface.unit
        covered = np.linalg.norm(np.ptp(moved[near], axis=0)) if near.any() else 0.0
        if covered < _COVERED * surface.size:
            return NOWHERE
        ends = np.cumsum([len(one) for one in clouds])[:-1]
        shares = tuple(float(one.mean()) if len(one) else 1.0 for one in np.split(near, ends))
        points = tuple(np.split(moved, ends))
        is_aligned = not found.lies_in_scan
        return Fit(float(near.mean()), shares, points, surface.typical(moved), is_aligned)

    def _likely_turns(self) -> list[Hypothesis]:
        """Returns the three turns after which the scan is nearest, by a short trial of each."""
        cloud = np.concatenate([one[::3] for one in self.clouds(self.reading)])

        def distance(hypothesis: Hypothesis) -> float:
            surface = self.surface(hypothesis.reading)
            centred = cloud + np.median(surface.points, axis=0) - np.median(cloud, axis=0)
            distances = surface.distances(surface.drawn(centred, 5))
            return float(np.minimum(distances, 10 * surface.unit).mean())

        return sorted(about_turns(self.reading), key=distance)[:3]
