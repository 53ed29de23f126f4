"""Whether scans fit a template, and if not, what is wrong with cameras, units or template.

Mistakes are recognised by trial: the first scan is read in each way that users confuse, and
compared with the template after the rigid motion with which tracking begins. A way is named only if
it fits clearly better; nothing is changed.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._core import find_alignment
from .._errors import InputError
from ..files.scans import PointScan, Rig, ScanCamera, ScanReader
from ..files.scans.reader import DepthReader
from ..sequence import Positions
from .planes import planes_of_room
from .rig_reading import (
    NO_UNITS,
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
from .surface_distance import Surface

_Floats = NDArray[np.float64]

_POINTS = 400
"""Points of all views that are compared."""

_EXAMINED = 20_000
"""Points of a view before floor and walls are left out."""

_LEAST_POINTS = 60
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

_AGREE = 0.7
_LEAST_ODD = 0.25
"""Units of the surface: a camera is odd if its points are `_LEAST_ODD` more than twice as far from
the template as those of the camera that fits best, if these are at most `_AGREE` away, and if its
own are less than half as far with another pose or focal length."""

_ALIGNED = 0.1
"""What a motion of the template costs, as a share of the points."""

_SCALES = np.linspace(0.8, 1.25, 19)
"""Focal lengths that are tried, relative to those of the file."""


@dataclass(frozen=True)
class Fit:
    """How well scans lie on a template.

    Attributes:
        near: share of the points within :attr:`within` of the surface.
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


NOWHERE = Fit(0.0, (), ())


@dataclass(frozen=True)
class RigFinding:
    """Something that is wrong with a rig.

    Attributes:
        message: a sentence with the numbers, and what to do.
        options: those that repair it, by the names of the options of :func:`track_file`; empty if
            none does.
        camera: the name of the camera that it is about, or None.
        is_refused: whether tracking would be in vain.
    """

    message: str
    options: dict[str, Any]
    camera: str | None = None
    is_refused: bool = False


@dataclass(frozen=True, eq=False)
class View:
    """What one camera sees in the first scan; of a point cloud, all its points.

    Attributes:
        camera: as it is meant; None for a point cloud.
        measured: number of pixels or points.
        pixels: (n, 2) columns and rows of some of them.
        depths: (n,) of these.
        size: width and height of the image.
        points: (n, 3) of a point cloud.
    """

    camera: ScanCamera | None
    measured: int
    pixels: _Floats
    depths: _Floats
    size: tuple[int, int]
    points: _Floats | None = None

    @property
    def name(self) -> str:
        """Of the camera."""
        return "" if self.camera is None else self.camera.name

    def of(self, kept: Any) -> "View":
        """Returns some of the points."""
        points = None if self.points is None else self.points[kept]
        pixels = self.pixels if self.camera is None else self.pixels[kept]
        depths = self.depths if self.camera is None else self.depths[kept]
        return replace(self, pixels=pixels, depths=depths, points=points)

    @property
    def local(self) -> _Floats:
        """(n, 3) the points in the axes of the camera, or of a point cloud."""
        if self.points is not None or self.camera is None:
            return np.zeros((0, 3)) if self.points is None else self.points
        return _local(self.pixels, self.depths, np.asarray(self.camera.intrinsics))

    def cloud(self, camera: ScanCamera | None, focal: float = 1.0) -> _Floats:
        """Returns (n, 3) points, in the unit of the scans, seen by this camera instead."""
        if self.points is not None or camera is None or self.camera is None:
            return self.local
        scale = (camera.depth_scale or 1.0) / (self.camera.depth_scale or 1.0)
        local = _local(self.pixels, self.depths * scale, np.asarray(camera.intrinsics))
        local[:, :2] /= focal
        return np.asarray(local @ camera.camera_to_world[:3, :3].T + camera.camera_to_world[:3, 3])

    def without_room(self, size: float, thickness: float) -> "View":
        """Returns the view without floor and walls, planes that are larger than this size.

        They are sought in the axes of the camera, where no mistake in a pose moves them, and a
        mistake in intrinsics or units leaves them flat.
        """
        points = self.local
        planes = planes_of_room(points, thickness=thickness, size=size)
        on_one = [np.zeros(len(points), np.bool_), *(plane.holds(points) for plane in planes)]
        return self.of(~np.logical_or.reduce(on_one))


@dataclass(frozen=True, eq=False)
class RigDiagnosis:
    """What is known of a rig from its first scan.

    Attributes:
        views: one of each camera that delivered an image.
        compared: the names of those that see something, in the order of the shares of `fit`.
        findings: what is wrong, in the order in which to repair it.
        fit: how well the scan lies on the template as it is read; None without a template.
        within: the distance that counts as near, in the unit of the template.
    """

    views: tuple[View, ...]
    compared: tuple[str, ...]
    findings: tuple[RigFinding, ...]
    fit: Fit | None
    within: float


class RigTrial:
    """The first scan of a rig and a template, compared in different readings."""

    def __init__(
        self, views: Iterable[View], stated: Rig | None, faces: NDArray[Any], template: Positions
    ) -> None:
        """Compares nothing yet; `stated` are the cameras as their file describes them."""
        self._whole = tuple(views)
        self._without_room: dict[float, tuple[View, ...]] = {}
        self.stated = stated
        self.template = template
        self.surface = Surface(faces, template)
        self.within = self.surface.unit

    def views(self, reading: Reading) -> tuple[View, ...]:
        """Returns the views without the room, for which the size of the template counts."""
        scale = reading.factor
        if reading.corrections.depth_scale is not None and self._whole[0].camera is not None:
            scale *= reading.corrections.depth_scale / (self._whole[0].camera.depth_scale or 1.0)
        if scale not in self._without_room:
            surface = self.surface
            each = _POINTS // len(self._whole)
            self._without_room[scale] = tuple(
                _some(
                    view.without_room(surface.size / scale, surface.mean_edge / scale),
                    each,
                )
                for view in self._whole
            )
        return self._without_room[scale]

    def clouds(self, reading: Reading) -> list[_Floats]:
        """Returns the points of each view in the unit of the template."""
        views = self.views(reading)
        if self.stated is None:
            return [view.cloud(None) * reading.factor for view in views]
        rig = {camera.name: camera for camera in reading.corrections.of(self.stated).cameras}
        found = []
        for view in views:
            camera = rig.get(view.name)
            if camera is not None and view.points is None:
                camera = reading.corrections.for_images(camera, *view.size)
            found.append(view.cloud(camera) * reading.factor)
        return found

    def fit(self, reading: Reading, quick: bool = False) -> Fit:
        """Returns how well the scans lie on the template, after the rigid motion of tracking.

        If `quick`, what cannot fit well is left early.
        """
        clouds = self.clouds(reading)
        cloud = np.concatenate(clouds)
        if len(cloud) < _LEAST_POINTS:
            return NOWHERE
        surface = self.surface
        if reading.turns:
            surface = Surface(surface.faces, turned(self.template, reading.turns))
        found = find_alignment(surface.faces, surface.points, cloud)
        if found.other_unit or (quick and found.after > _HOPELESS):
            return NOWHERE
        moved = surface.drawn((cloud - found.shift) @ found.rotation)
        judged = self._judged(surface, moved, [len(one) for one in clouds])
        return replace(judged, is_aligned=not found.lies_in_scan)

    def _judged(self, surface: Surface, moved: _Floats, counts: list[int]) -> Fit:
        near = surface.distances(moved) <= self.within
        if (
            np.linalg.norm(np.ptp(moved[near], axis=0) if near.any() else 0)
            < _COVERED * surface.size
        ):
            return NOWHERE
        ends = np.cumsum(counts)[:-1]
        shares = [float(one.mean()) if len(one) else 1.0 for one in np.split(near, ends)]
        points = tuple(np.split(moved, ends))
        return Fit(float(near.mean()), tuple(shares), points, surface.typical(moved))


def views_of(reader: ScanReader, number: int) -> list[View]:
    """Returns what each camera sees in a frame, counted from 0."""
    if isinstance(reader, DepthReader):
        return [_view(camera, depth) for camera, depth in reader.images(number)]
    (scan,) = reader.frames(number, number + 1)
    if not isinstance(scan, PointScan):
        return []
    points, nothing = scan.points.astype(np.float64), np.zeros(0)
    return [_some(View(None, len(points), nothing, nothing, (0, 0), points), _EXAMINED)]


def diagnose_rig(
    reader: ScanReader,
    reading: Reading,
    units: Units = NO_UNITS,
    faces: NDArray[Any] | None = None,
    template: Positions | None = None,
) -> RigDiagnosis:
    """Looks for mistakes in the cameras, the units and the template.

    Args:
        reader: of the scans.
        reading: how they are read.
        units: what is known of the units of length.
        faces: (m, 3) of the template; None if there is none.
        template: (k, 3) its first frame as it is in its file, complete.

    Raises:
        OSError, ValueError: the scans cannot be read, or no frame has points.
    """
    frames = (views_of(reader, number) for number in range(reader.n_frames))
    views = next((found for found in frames if any(view.measured for view in found)), None)
    if views is None:
        raise InputError("no frame has points", file=reader.path)
    blind = tuple(
        RigFinding(f"camera {v.name!r} sees nothing in the first scan", {}, v.name)
        for v in views
        if not v.measured
    )
    if faces is None or template is None:
        return RigDiagnosis(tuple(views), (), blind, None, 0.0)
    seeing = [view for view in views if view.measured]
    stated = None if reader.cameras is None else reader.cameras.stated
    trial = RigTrial(seeing, stated, faces, template)
    fit = trial.fit(reading)
    found: list[RigFinding] = []
    if not fit.by_camera or min(fit.by_camera) < _WELL:
        better = _best(trial, fit, reading, units)
        found = [] if better is None else [better]
    left = sum(map(len, trial.clouds(reading)))
    if not found and left < _LEAST_POINTS <= sum(view.measured for view in seeing) - left:
        told = (
            f"without floor and walls, {left} points are left of the first scan: the room is empty"
        )
        found = [RigFinding(told, {})]
    if not found and fit.by_camera:
        found = list(_odd_cameras(trial, fit, reading))
    compared = tuple(view.name for view in seeing)
    return RigDiagnosis(tuple(views), compared, (*blind, *found), fit, trial.within)


def _best(trial: RigTrial, now: Fit, reading: Reading, units: Units) -> RigFinding | None:
    """Returns the hypothesis that fits clearly better, or None."""
    if sum(map(len, trial.clouds(reading))) < _LEAST_POINTS:
        return None
    rig = trial.stated
    kinds: list[Callable[[], Iterable[Hypothesis]]] = [lambda: _likely_turns(trial, reading)]
    if rig is not None and trial.views(reading)[0].points is None:
        sizes = {view.name: view.size for view in trial.views(reading)}
        kinds = [
            lambda: about_poses(reading),
            lambda: about_swapped(reading, rig),
            lambda: about_images(reading, rig, sizes),
            *kinds,
        ]
    best: tuple[Fit, Hypothesis] | None = None
    if now.near < _OTHER_UNIT:
        kinds.append(lambda: about_units(reading, rig, units))
    for kind in kinds:
        for hypothesis in kind():
            fit = trial.fit(hypothesis.reading, quick=True)
            if hypothesis.is_of_units and fit.near < _FITS_IN_UNIT:
                continue
            if best is None or fit.score > best[0].score:
                best = fit, hypothesis
        if best is not None and best[0].near >= _WELL and _is_clear(best[0], now):
            break
    if best is None or not _is_clear(best[0], now):
        return None
    fit, hypothesis = best
    edges = trial.within / trial.surface.mean_edge
    within = "a mean edge" if round(edges, 1) == 1 else f"{edges:.2g} mean edges"
    return RigFinding(
        f"{_percent(fit.near)} of the first scan lies within {within} of the template if "
        f"{hypothesis.condition}, but {_percent(now.near)} as it is read now: "
        f"{hypothesis.remedy}",
        hypothesis.options,
        is_refused=True,
    )


def _is_clear(fit: Fit, now: Fit) -> bool:
    if fit.near >= _WELL and fit.typical <= _NEARER * now.typical:
        return True
    less_far = 1 - fit.near <= _FAR_LEFT * (1 - now.near)
    return fit.near >= _FITS and fit.near >= now.near + _MORE and less_far


def _likely_turns(trial: RigTrial, reading: Reading) -> list[Hypothesis]:
    """Returns the three turns after which the scan is nearest, by a short trial of each."""
    cloud = np.concatenate([one[::3] for one in trial.clouds(reading)])
    tried = []
    for hypothesis in about_turns(reading):
        surface = Surface(trial.surface.faces, turned(trial.template, hypothesis.reading.turns))
        centred = cloud + np.median(surface.points, axis=0) - np.median(cloud, axis=0)
        distances = surface.distances(surface.drawn(centred, 5))
        tried.append((float(np.minimum(distances, 10 * trial.within).mean()), hypothesis))
    tried.sort(key=lambda pair: pair[0])
    return [hypothesis for _, hypothesis in tried[:3]]


def _odd_cameras(trial: RigTrial, fit: Fit, reading: Reading) -> Iterable[RigFinding]:
    """Yields cameras that disagree with the others or, if there is one, with the template."""
    left = [n for n, points in enumerate(fit.points) if len(points) >= _LEAST_POINTS]
    while left:
        found = [one for n in left if (one := _odd(trial, fit, reading, n, left)) is not None]
        if not found:
            return
        worst = max(found, key=lambda one: one.gain)
        yield RigFinding(worst.message, {}, trial.views(reading)[worst.number].name)
        left.remove(worst.number)


class _Odd(NamedTuple):
    """A camera that fits better in another way, and how much."""

    number: int
    gain: float
    message: str


def _odd(trial: RigTrial, fit: Fit, reading: Reading, number: int, among: list[int]) -> _Odd | None:
    """Returns what is wrong with a camera, judged by the others among these, or None."""
    surface = trial.surface
    if reading.turns:
        surface = Surface(surface.faces, turned(trial.template, reading.turns))
    clouds, view = trial.clouds(reading), trial.views(reading)[number]
    others = [n for n in among if n != number]
    # Without what this camera says of where the template is.
    known = others or [number]
    after = surface.drawn(np.concatenate([fit.points[n] for n in known]))
    rotation, shift = _motion_between(np.concatenate([clouds[n] for n in known]), after)
    own = clouds[number] @ rotation.T + shift
    now = surface.typical(own)
    rest = min((surface.typical(clouds[n] @ rotation.T + shift) for n in others), default=0.0)
    if rest > _AGREE or now < _LEAST_ODD + 2 * rest:
        return None
    moved = surface.drawn(surface.drawn(own))
    off = float(np.linalg.norm((moved - own).mean(axis=0)))
    ways = {f"when moved by {off:.2g}: check its pose": surface.typical(moved)}
    for scale in _SCALES if view.points is None else ():
        points = view.cloud(view.camera, scale) * reading.factor @ rotation.T + shift
        points = points if others else surface.drawn(points)
        words = f"with a focal length {scale:.3g} times that of its file: check its intrinsics"
        ways[words] = surface.typical(points)
    best = min(ways, key=lambda words: ways[words])
    if ways[best] > 0.5 * now or ways[best] > 2 * rest + _LEAST_ODD:
        return None
    unit = surface.unit
    seen = f"what camera {view.name!r} sees is {now * unit:.2g} from the template"
    if others:
        seen += f" (of another camera: {rest * unit:.2g})"
    return _Odd(number, now - ways[best], f"{seen}, but {ways[best] * unit:.2g} {best}")


def _motion_between(before: _Floats, after: _Floats) -> tuple[_Floats, _Floats]:
    """Returns the rotation and the shift that lead from one to the other (Kabsch 1976)."""
    start, end = before.mean(axis=0), after.mean(axis=0)
    u, _, v = np.linalg.svd((before - start).T @ (after - end))
    rotation = v.T @ np.diag([1, 1, np.sign(np.linalg.det(v.T @ u.T))]) @ u.T
    return rotation, end - rotation @ start


def _view(camera: ScanCamera, depth: NDArray[np.float32]) -> View:
    row, column = np.nonzero(depth > 0)
    pixels = np.stack([column, row], axis=1).astype(np.float64)
    depths = depth[row, column].astype(np.float64)
    size = depth.shape[1], depth.shape[0]
    return _some(View(camera, len(row), pixels, depths, size), _EXAMINED)


def _local(pixels: _Floats, depths: _Floats, intrinsics: _Floats) -> _Floats:
    whole = np.concatenate([pixels, np.ones((len(pixels), 1))], axis=1)
    return np.asarray(whole @ np.linalg.inv(intrinsics).T * depths[:, None])


def _some(view: View, wanted: int) -> View:
    """Returns about so many of the points, evenly by their numbers."""
    n = len(view.depths if view.points is None else view.points)
    return view if n <= wanted else view.of(np.linspace(0, n - 1, wanted).astype(np.int64))


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"
