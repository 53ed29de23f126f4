"""Whether a camera file is read as it is meant: every single reading of it is tried on some scans.

Cameras that see one subject must agree: where one sees a surface, no other may see through it. A
template tells what they cannot. If a single camera has another pose, a template may have that pose
as well, so only one that lies where the points are tells anything of it.
"""

import contextlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .. import formats
from .._arrays import Floats, Positions
from .._checks import path_of
from .._errors import InputError
from .._report import Report
from ..alignment import find_alignment
from ..completion.start import template_of
from ..formats import PathLike
from ..scans import DepthScan, Rig, ScanCamera, open_scans, write_cameras
from ..scans.other_cameras import OPENGL
from ..scans.reader import DepthReader, ScanSource
from ..tracking.background import Background
from ..tracking.surface import Surface, subject_of, without_jumps
from ..tracking.units import units_of
from .rig_page import rig_page

_SCANS = 4
"""At most so many scans are compared, evenly over the sequence."""
_POINTS = 500
"""So many points of each camera are compared with what the others see."""
_NEAR = 0.02
"""What cameras measure may differ by this share of what each of them sees."""

_FAR, _FAR_EDGES = 0.01, 0.5
"""A point is far from the template beyond this share of its diagonal and of its mean edge."""
_COVERED = 0.3
"""If the points of no camera extend over this share of the template, all of them count as far:
with a depth that is far too small, they fall on one place, which may lie on the surface."""
_FEWEST = 60

_FIT = 0.12
"""Cameras fit if each has at most this share of points that others contradict, and of far ones: of
right ones, 10 % were with outliers or a room, and of one turned by 4 degrees about its axis, 14."""
_FEWER, _LESS, _AT_MOST = 0.5, 0.03, 0.4
"""A reading is better if it leaves at most this share of wrong points, this much less of all, and
at most this share of all, as a part of a room may be left; and worse if it leaves so much more."""


def _posed(change: Callable[[Floats], Any], camera: ScanCamera) -> ScanCamera:
    return replace(camera, camera_to_world=change(camera.camera_to_world))


def _scaled(positions: float, depths: float, camera: ScanCamera) -> ScanCamera:
    pose = camera.camera_to_world * np.array([[1, 1, 1, positions]] * 3 + [[1] * 4])
    return replace(camera, camera_to_world=pose, depth_scale=depths * (camera.depth_scale or 1.0))


def _resized(factor: float, camera: ScanCamera) -> ScanCamera:
    return replace(camera, intrinsics=np.diag([factor, factor, 1]) @ np.asarray(camera.intrinsics))


def _flipped(axes: str, camera: ScanCamera) -> ScanCamera:
    return replace(camera, flipped="".join(sorted({*camera.flipped} ^ {*axes})))


Reading: TypeAlias = Callable[[ScanCamera], ScanCamera]

READINGS: dict[str, Reading] = {
    "the poses are inverted: they lead from the world to the cameras, as extrinsics do": partial(
        _posed, np.linalg.inv
    ),
    "the cameras have the axes of OpenGL, x right, y up, z back, instead of those of OpenCV": (
        partial(_posed, lambda pose: pose @ OPENGL)
    ),
    "depth_scale is 1000 times too large": partial(_scaled, 1, 1e-3),
    "depth_scale is 1000 times too small": partial(_scaled, 1, 1e3),
    "the positions of the cameras are in millimetres and everything else in metres": partial(
        _scaled, 1e-3, 1
    ),
    "positions and depths of the cameras are in millimetres and the template in metres": partial(
        _scaled, 1e-3, 1e-3
    ),
    "positions and depths of the cameras are in metres and the template in millimetres": partial(
        _scaled, 1e3, 1e3
    ),
    "the intrinsics are those of images twice as large": partial(_resized, 0.5),
    "the intrinsics are those of images half as large": partial(_resized, 2),
    "depths are distances from the camera along the rays of the pixels, not along the axis": (
        lambda camera: replace(camera, along_ray=not camera.along_ray)
    ),
    "the images are mirrored: left and right are exchanged": partial(_flipped, "x"),
    "the images are flipped: top and bottom are exchanged": partial(_flipped, "y"),
}
"""What may be meant by a camera file, in a sentence, and what makes the camera that is meant."""


@dataclass(frozen=True)
class Fit:
    """How far scans agree with one another and with a template.

    Attributes:
        cameras: the names of those of the first scan.
        apart: of the points of each camera, the share that another one contradicts, in whose image
            they are: it sees through them, or nothing there. Empty of a single camera.
        unsupported: the share of all points that are contradicted or outside of other images.
        far: of each camera, the share of its points in the first scan that are far from the
            template, moved rigidly if there are several cameras; of a single camera that moves, in
            all scans. Empty without one.
    """

    cameras: tuple[str, ...]
    apart: tuple[float, ...] = ()
    unsupported: float | None = None
    far: tuple[float, ...] = ()

    @property
    def agrees(self) -> bool:
        """Whether cameras contradict one another hardly, and see the same."""
        return not self.apart or max(self.apart) <= _FIT

    @property
    def is_good(self) -> bool:
        """Whether they also lie on the template."""
        return self.agrees and max(self.far, default=0.0) <= _FIT

    @property
    def measures(self) -> list[float]:
        """What is compared."""
        of_cameras = [] if self.unsupported is None else [self.unsupported]
        return [*of_cameras, *([float(np.mean(self.far))] if self.far else [])]

    def is_better_than(self, other: "Fit") -> bool:
        """Whether it leaves clearly less by one measure and not more by any."""
        if not self.agrees or (len(self.cameras) == 1 and not self.is_good):
            return False
        pairs = [*zip(self.measures, other.measures, strict=True)]
        better = (a <= min(_AT_MOST, _FEWER * b, b - _LESS) for a, b in pairs)
        return any(better) and all(a <= b + _LESS for a, b in pairs)

    @property
    def told(self) -> str:
        """The shares, in words."""
        facts = []
        if self.apart:
            facts.append(f"{np.mean(self.apart):.1%} contradict another camera")
        if self.far:
            facts.append(f"{np.mean(self.far):.1%} are far from the template")
        return f"of the points, {' and '.join(facts)}" if facts else ""

    @property
    def named(self) -> tuple[str, ...]:
        """The cameras with their shares."""
        rows = {"contradict another camera": self.apart, "are far from the template": self.far}
        shares = [[f"{share:.0%} {what}" for share in row] for what, row in rows.items() if row]
        each = zip(self.cameras, *shares, strict=True)
        return tuple(f"{name}: {', '.join(own)}" if own else name for name, *own in each)


def _far_from(surface: Surface, scan: DepthScan, *, moves: bool) -> tuple[float, ...]:
    """The share of far points of each camera; with `moves`, after the rigid motion of tracking."""
    clouds = [subject_of(cloud, surface) for cloud in without_jumps(scan).clouds]
    points = np.concatenate(clouds)
    extents = [np.linalg.norm(np.ptp(cloud, axis=0)) for cloud in clouds if len(cloud)]
    if len(points) < _FEWEST or max(extents) < _COVERED * surface.size:
        return (1.0,) * len(clouds)
    most = max(_FAR * surface.size, _FAR_EDGES * surface.mean_edge)
    far = surface.distances(points) > most
    if moves:
        result = find_alignment(surface.faces, surface.points, points)
        moved = surface.distances((points - result.shift) @ result.rotation) > most
        far = min(far, moved, key=np.mean)
    each = np.split(far, np.cumsum([len(cloud) for cloud in clouds])[:-1])
    return tuple(float(np.mean(own)) if len(own) else 0.0 for own in each)


def _seen_by_others(scan: DepthScan) -> tuple[NDArray[np.int64], int]:
    """Counts how the points of each camera appear to the others.

    Returns:
        (c, 2) how many times a point of each is in the image of another one, and contradicted
        there, and how often it might have been.
    """
    scan = without_jumps(scan)
    counts, n_pairs = np.zeros((len(scan.depth), 2), np.int64), 0
    nearest = [_nearest_around(depth) for depth in scan.depth]
    for one, cloud in enumerate(scan.clouds):
        some = cloud[:: 1 + len(cloud) // _POINTS]
        if not len(some):
            continue
        near = _NEAR * float(np.linalg.norm(np.ptp(np.quantile(some, (0.05, 0.95), 0), axis=0)))
        for other, depth in enumerate(nearest):
            if other == one:
                continue
            n_pairs += len(some)
            pose = scan.poses[other]
            local = (some - pose[:3, 3]) @ np.linalg.inv(pose[:3, :3]).T
            local = local[local[:, 2] > 0]
            pixels = local @ np.asarray(scan.intrinsics[other]).T
            column, row = np.rint(pixels[:, :2] / pixels[:, 2:]).T
            inside = (row >= 0) & (row < depth.shape[0]) & (column >= 0) & (column < depth.shape[1])
            there = depth[row[inside].astype(int), column[inside].astype(int)]
            counts[one] += len(there), np.count_nonzero(local[inside, 2] < there - near)
    return counts, n_pairs


def _nearest_around(depth: NDArray[np.float32]) -> Floats:
    """The least depth around each pixel; infinite where nothing is measured."""
    padded = np.pad(np.where(depth > 0, depth, np.inf), 2, constant_values=np.inf)
    around = np.lib.stride_tricks.sliding_window_view(padded, (5, 5))
    return np.asarray(around.min(axis=(2, 3)))


def fit_of(
    scans: Sequence[DepthScan], cameras: Sequence[str], surface: Surface | None, *, moves: bool
) -> Fit:
    """Compares scans, in the unit of the template, with one another and with the template.

    `moves` tells whether cameras do.
    """
    fit, is_single = Fit(tuple(cameras)), len(cameras) == 1
    if not is_single:
        counts = [_seen_by_others(scan) for scan in scans if len(scan.depth) == len(cameras)]
        seen, against = np.sum([each for each, _ in counts], axis=0).T
        apart = np.where(seen > 0, against / np.maximum(seen, 1), 1.0)
        agreed = float((seen - against).sum()) / max(1, sum(n for _, n in counts))
        fit = replace(fit, apart=tuple(apart.tolist()), unsupported=1 - agreed)
    if surface is not None:
        compared = scans if is_single and moves else scans[:1]
        each = [_far_from(surface, scan, moves=not is_single) for scan in compared]
        fit = replace(fit, far=tuple(np.mean(each, axis=0).tolist()))
    return fit


@dataclass(frozen=True, kw_only=True, eq=False)
class RigReport(Report):
    """What some scans say of the cameras.

    Attributes:
        quality: "doubtful" if the cameras do not fit as they are stated; "good" if nothing is
            judged.
        scan: the first one, in the unit of the template, as the cameras are stated.
        template: its faces and vertices, or None if there is none.
        up: the up axis that the template states, else "y".
        stated: how the scans fit as the cameras are stated.
        rig: the cameras if they fit, or corrected ones; None if neither is known.
        wrong: what is wrong with them, in a sentence, if it is known.
        meant: how the scans fit then.
        path: of the scans.
        files: those in which the cameras are stated.
        output: the file with the corrected cameras that was written, or None.
    """

    scan: DepthScan = field(repr=False)
    template: tuple[NDArray[np.integer], Positions] | None = field(default=None, repr=False)
    up: str = "y"
    stated: Fit
    rig: Rig | None = field(default=None, repr=False)
    wrong: str = ""
    meant: Fit | None = None
    path: Path = field(default=Path("scans"), repr=False)
    files: tuple[Path, ...] = field(default=(), repr=False)
    output: Path | None = None

    def lines(self) -> list[str]:
        """Says what was found."""
        kind = "corrected" if self.wrong else "same"
        written = [] if self.output is None else [f"the {kind} cameras are written"]
        return [self.told, *written, *self.remarks]

    def write_cameras(self, path: PathLike) -> None:
        """Writes a JSON file with the corrected cameras.

        Raises:
            ValueError: no correction is known.
            OSError: it cannot be written.
        """
        if self.rig is None:
            raise InputError("no correction of the cameras is known")
        write_cameras(path_of("path", path), self.rig)

    def page(self, path: PathLike) -> None:
        """Writes an HTML file that shows the cameras, what they see, and the template."""
        shown = rig_page(
            self.scan,
            self.template,
            up=self.up,
            title=f"{self.path.name}, the first scan",
            told=self.told,
            names=self.stated.named,
        )
        path_of("path", path).write_text(shown, encoding="utf-8")

    @property
    def told(self) -> str:
        """What was found, in a sentence."""
        facts = self.stated.told
        if self.meant is not None:
            return f"{self.wrong}: {facts}, but {self.meant.told} if that is corrected"
        if self.rig is not None:
            blind = [camera.name for camera in self.rig.cameras]
            blind = [name for name in blind if name not in self.stated.cameras]
            more = f"; those without an image in it are not judged: {', '.join(blind)}"
            if self.template is None:
                facts += "; a template tells whether images are mirrored or depths along rays"
            return f"the cameras fit: {facts}{more if blind else ''}"
        if len(self.stated.cameras) == 1:
            why = "a single camera cannot be judged, unless a template lies where its points are"
            return f"{why}{facts and f': {facts}'}; `page` shows them"
        if self.stated.agrees:
            return f"the cameras agree, but the template has another pose, shape or unit: {facts}"
        named = "; ".join(self.stated.named)
        return f"the cameras contradict one another, and no single reading explains it: {named}"


def judge_rig(
    path: Path,
    rig: Rig | None,
    reading: ScanSource,
    template: PathLike | None,
    scan_unit: float | str | None,
    template_unit: float | str | None,
    room: Background,
    show: Callable[[int, int], None],
) -> RigReport:
    """Judges cameras by some scans, without the room.

    `reading` is how scans are read; `show` is called with the number of readings of the cameras
    that were tried and of all.
    """
    of_rig: ScanSource = {**reading, "cameras": rig}
    reader = open_scans(path, **of_rig)
    if rig is None or not isinstance(reader, DepthReader):
        raise InputError(
            "holds point clouds; of cameras, only those of depth images can be judged", file=path
        )
    numbers = _with_points(reader)
    names = reader.cameras_of(numbers[0])
    surface, up, factor = None, "y", 1.0
    if template is not None:
        with formats.open(template) as mesh:
            factor = units_of(reader, mesh, scan_unit, template_unit).factor
            surface = Surface(mesh.faces, template_of(mesh))
            up = mesh.header.up_axis or "y"

    def read(meant: Rig) -> Iterator[DepthScan]:
        """What cameras leave of the scans, in the unit of the template."""
        of_meant: ScanSource = {**reading, "cameras": meant}
        opened = open_scans(path, **of_meant)
        for count, number in enumerate(numbers):
            (scan,) = opened.frames(number, number + 1)
            if isinstance(scan, DepthScan):
                scan = scan.scaled(factor)
                if count == 0 and surface is not None:
                    room.find(scan, surface.faces, surface.points)
                yield room.without(scan)

    scans = [*read(rig)]
    stated = fit_of(scans, names, surface, moves=rig.moves)
    shown = None if surface is None else (surface.faces, surface.points)
    judged = RigReport(scan=scans[0], template=shown, up=up, stated=stated, rig=rig)
    if not stated.measures:
        return replace(judged, rig=None)
    if stated.is_good:
        return judged
    tried = []
    for done, (said, change) in enumerate(READINGS.items()):
        show(done, len(READINGS))
        meant = replace(rig, cameras=tuple(map(change, rig.cameras)))
        # Some readings are refused, as mirrored images with a distortion are.
        with contextlib.suppress(InputError):
            fit = fit_of([*read(meant)], names, surface, moves=rig.moves)
            tried.append((fit, said, meant))
    better = [one for one in tried if one[0].is_better_than(stated)]
    if better:
        fit, said, meant = min(better, key=lambda one: sum(one[0].measures))
        return replace(judged, quality="doubtful", rig=meant, wrong=said, meant=fit)
    return replace(judged, quality="good" if len(names) == 1 else "doubtful", rig=None)


def _with_points(reader: DepthReader) -> list[int]:
    """Returns the numbers, counted from 0, of the first scan with points and of some others."""
    first = None
    for number, scan in enumerate(reader):
        if isinstance(scan, DepthScan) and scan.has_points:
            first = number
            break
    if first is None:
        raise InputError("no frame has points", file=reader.path)
    return [*dict.fromkeys(np.linspace(first, reader.n_frames - 1, _SCANS).astype(int).tolist())]
