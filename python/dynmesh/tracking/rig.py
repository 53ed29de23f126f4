"""Whether the cameras of depth images are read as they are meant, judged by the first scan.

Every usual misreading is undone in turn, and the scan compared with the template.
"""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import combinations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .. import formats
from .._arrays import Floats, Positions
from .._checks import path_of
from .._errors import InputError
from .._report import Report
from ..alignment import find_alignment
from ..completion.start import template_of
from ..draw.rig_page import rig_page
from ..formats import PathLike
from ..scans import DepthScan, Rig, open_scans, write_cameras
from ..scans.reader import DepthReader
from .background import Background
from .corrections import LEAST, MEASURED, wrong_camera
from .misreadings import READINGS, READINGS_OF_IMAGES, Reading, exchanged
from .quality import FARTHER_THAN_OTHERS, beyond
from .surface import Surface, subject_of, without_jumps
from .units import units_of

_FAR = 0.01
_FAR_EDGES = 0.5
"""A point is far from the template beyond this share of its diagonal and of its mean edge."""

_COVERED = 0.3
"""If the points of no camera extend over this share of the template, all of them count as far:
with a depth scale that is far too small, they fall on one place, which may lie on the surface."""

_FEWER = 0.5
_LESS = 0.03
_AT_MOST = 0.4
"""A reading is better if it leaves at most this share of the far points, this much less of all
points, and at most this share of all: a part of a room may be left."""

_FIT = 0.12
"""The cameras fit if of each at most so many points are far: of right ones, 10 % were with outliers
or a room, and of one turned by 4 degrees about its axis, 14 %."""


@dataclass(frozen=True)
class Fit:
    """How a scan lies on a template.

    Attributes:
        far: the share of the points that are far from it.
        in_place: the same without a rigid motion.
        by_camera: the same as `far` of each camera.
        distances: the median distance of the points of each camera, in mean edges.
    """

    far: float
    in_place: float
    by_camera: tuple[float, ...]
    distances: tuple[float, ...]

    @property
    def wrong(self) -> set[int]:
        """The cameras with many far points, or that are much farther from it than the others."""
        many = {number for number, far in enumerate(self.by_camera) if far > _FIT}
        return many | beyond(dict(enumerate(self.distances)), FARTHER_THAN_OTHERS, MEASURED)


def fit_of(scan: DepthScan, surface: Surface, *, moves: bool = True) -> Fit:
    """Compares a scan, in the unit of the template, also after the rigid motion of tracking."""
    clouds = [subject_of(cloud, surface) for cloud in without_jumps(scan).clouds]
    points = np.concatenate(clouds)
    extents = [np.linalg.norm(np.ptp(cloud, axis=0)) for cloud in clouds if len(cloud)]
    if len(points) < LEAST or max(extents) < _COVERED * surface.size:
        medians = _medians([surface.distances(cloud) for cloud in clouds], surface)
        return Fit(1.0, 1.0, (1.0,) * len(clouds), medians)
    result = find_alignment(surface.faces, surface.points, points)
    most = max(_FAR * surface.size, _FAR_EDGES * surface.mean_edge)
    placed = [points, (points - result.shift) @ result.rotation][: 1 + moves]
    distances = [surface.distances(positions) for positions in placed]
    shares = [float(np.mean(far > most)) for far in distances]
    away = distances[int(np.argmin(shares))]
    each = np.split(away, np.cumsum([len(cloud) for cloud in clouds])[:-1])
    far = tuple(float(np.mean(own > most)) if len(own) else 0.0 for own in each)
    return Fit(min(shares), shares[0], far, _medians(each, surface))


def _medians(each: list[Floats], surface: Surface) -> tuple[float, ...]:
    """The median of the distances of each camera, in mean edges; 0 without points."""
    return tuple(float(np.median(own)) / surface.mean_edge if len(own) else 0.0 for own in each)


@dataclass(frozen=True, kw_only=True, eq=False)
class RigReport(Report):
    """What the first scan with points says of the cameras.

    Attributes:
        quality: "doubtful" if the cameras do not fit as they are stated; "good" if nothing is
            judged.
        scan: in the unit of the template, as the cameras are stated.
        cameras: the names of those that have an image in it.
        template: its faces and vertices, or None if there is none.
        up: the up axis that the template states, else "y".
        stated: how the scan lies on the template; None without one.
        rig: the cameras if they fit, or corrected ones; None if no correction is known.
        wrong: what is wrong with them, in a sentence, if it is known.
        meant: how the scan lies on the template then.
        path: of the scans.
        files: those in which the cameras are stated.
        output: the file with the corrected cameras that was written, or None.
    """

    scan: DepthScan = field(repr=False)
    cameras: tuple[str, ...]
    template: tuple[NDArray[np.integer], Positions] | None = field(default=None, repr=False)
    up: str = "y"
    stated: Fit | None = None
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
            names=self.names,
        )
        path_of("path", path).write_text(shown, encoding="utf-8")

    @property
    def names(self) -> tuple[str, ...]:
        """The cameras with their shares of far points and the median of the distances."""
        if self.stated is None:
            return self.cameras
        each = zip(self.cameras, self.stated.by_camera, self.stated.distances, strict=True)
        return tuple(f"{name}: {far:.0%} far and {away:.3g} edges away" for name, far, away in each)

    @property
    def told(self) -> str:
        """What was found, in a sentence."""
        if self.stated is None:
            return "without a template, nothing is judged"
        far = f"{self.stated.far:.1%} of the first scan's points are far from the template"
        if self.meant is not None:
            return f"{self.wrong}: {far}, but {self.meant.far:.1%} if that is corrected"
        if self.rig is not None:
            blind = [camera.name for camera in self.rig.cameras if camera.name not in self.cameras]
            more = f"; those without an image in it are not judged: {', '.join(blind)}"
            return f"the cameras fit: {far}{more if blind else ''}"
        wrong = [self.cameras[number] for number in sorted(self.stated.wrong)]
        why = (
            "the cameras or the template's pose, shape or unit are not those of the scan, or it "
            "shows other things, which `crop` leaves out"
        )
        if len(wrong) == 1 < len(self.cameras):
            why = f"the pose or the intrinsics of camera {wrong[0]!r} are wrong"
        return (
            f"{far} (cameras {', '.join(self.names)}), and no usual misreading explains it: "
            f"{self.wrong or why}"
        )


def judge_rig(
    path: Path,
    rig: Rig | None,
    template: PathLike | None,
    scan_unit: float | str | None,
    template_unit: float | str | None,
    room: Background,
    show: Callable[[int, int], None],
) -> RigReport:
    """Judges cameras by the first scan with points, without the room.

    `show` is called with the number of misreadings that were tried and of all.
    """
    reader = open_scans(path, cameras=rig, gaps="lost")
    if rig is None or not isinstance(reader, DepthReader):
        raise InputError(
            "holds point clouds; of cameras, only those of depth images can be judged", file=path
        )
    number, scan = _first(reader)
    names = tuple(reader.cameras_of(number))
    if template is None:
        return RigReport(scan=room.without(scan), cameras=names)
    with formats.open(template) as mesh:
        factor = units_of(reader, mesh, scan_unit, template_unit).factor
        surface = Surface(mesh.faces, template_of(mesh))
        up = mesh.header.up_axis or "y"

    def subject(scan: DepthScan) -> DepthScan:
        """What a reading of the cameras leaves of the scan, in the unit of the template."""
        scan = scan.scaled(factor)
        room.find(scan, surface.faces, surface.points)
        return room.without(scan)

    scan = subject(scan)
    stated = fit_of(scan, surface)
    shown = (surface.faces, surface.points)
    judged = RigReport(scan=scan, cameras=names, template=shown, up=up, stated=stated, rig=rig)
    wrong = wrong_camera(scan, names, surface)
    if not stated.wrong and not wrong:
        return judged
    judged = replace(judged, quality="doubtful", rig=None, wrong=wrong)
    if not stated.wrong:
        return judged
    exchanges = (
        (
            f"cameras {one!r} and {other!r} are exchanged: each has the images of the other",
            partial(exchanged, one, other),
        )
        for one, other in combinations([camera.name for camera in rig.cameras], 2)
    )
    tried = []
    readings: tuple[Reading, ...] = (*READINGS, *exchanges, *READINGS_OF_IMAGES)
    for done, (reading, change) in enumerate(readings):
        show(done, len(readings))
        meant = replace(rig, cameras=tuple(map(change, rig.cameras)))
        # Exchanged cameras whose images have other sizes are refused: they are not exchanged.
        with contextlib.suppress(InputError):
            (other,) = open_scans(path, cameras=meant, gaps="lost").frames(number, number + 1)
            if isinstance(other, DepthScan):
                # Any wrong pose of a single camera becomes right by a rigid motion.
                fit = fit_of(subject(other), surface, moves=len(names) > 1)
                tried.append((fit, reading, meant))
    enough = min(_AT_MOST, _FEWER * stated.far, stated.far - _LESS)
    # Opposite cameras of a ring that are exchanged differ from the two others by a turn alone.
    best, reading, meant = min(
        tried, key=lambda fit: (fit[0].far > enough, fit[0].in_place > enough, fit[0].far)
    )
    if best.far > enough:
        return judged
    return replace(judged, rig=meant, wrong=reading, meant=best)


def _first(reader: DepthReader) -> tuple[int, DepthScan]:
    """Returns the first scan with points, and its number, counted from 0."""
    for number, scan in enumerate(reader):
        if isinstance(scan, DepthScan) and scan.has_points:
            return number, scan
    raise InputError("no frame has points", file=reader.path)
