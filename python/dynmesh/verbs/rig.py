"""Whether the cameras of depth images are read as they are meant, and a file that corrects them."""

import contextlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Unpack

import numpy as np

from .. import formats
from .._checks import path_of
from .._errors import InputError
from .._options import Input
from .._report import Report, steps
from ..advice.cameras import Fit, Surface, fit_of
from ..advice.readings import READINGS
from ..advice.rig_page import rig_page
from ..completion.start import template_of
from ..formats import PathLike
from ..formats.format import Gaps
from ..scans import DepthScan, Rig, ScanReader, open_scans
from ..scans.opening import BesideScans, ScanSource, read_rig
from ..scans.reader import DepthReader
from ..tracking.background import Background, Crop
from ..tracking.inputs import units_of

_SCANS = 4
"""At most so many scans are compared, evenly over the sequence."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RigReport(Report):
    """What some scans say of the cameras.

    Attributes:
        quality: "doubtful" if the cameras do not fit as they are stated; "good" if nothing is
            judged.
        stated: how the scans fit as the cameras are stated.
        rig: the cameras if they fit, or corrected ones; None if neither is known.
        wrong: what is wrong with them, in a sentence, if it is known.
        meant: how the scans fit then.
        output: the file with the corrected cameras that was written, or None.
    """

    stated: Fit
    rig: Rig | None = field(default=None, repr=False)
    wrong: str = ""
    meant: Fit | None = None
    output: Path | None = None
    _html: Callable[[str], str] = field(repr=False)

    def lines(self) -> list[str]:
        """Says what was found, with the shares of the points of each camera."""
        meant = [] if self.meant is None else ["if that is corrected:", *self.meant.each]
        kind = "corrected" if self.wrong else "same"
        written = [] if self.output is None else [f"the {kind} cameras are written"]
        return [self.told, *self.stated.each, *meant, *written, *self.remarks]

    def page(self, path: PathLike) -> None:
        """Writes an HTML file that shows the cameras, what they see, and the template."""
        path_of("path", path).write_text(self._html(self.told), encoding="utf-8")

    @property
    def told(self) -> str:
        """What was found, in a sentence."""
        if self.rig is not None:
            return self.wrong or "the cameras fit"
        if len(self.stated.cameras) == 1:
            return "a single camera is judged only by a template that lies where its points are"
        return "the cameras do not fit, and no single reading of their file does"


def rig(
    scans: PathLike,
    *,
    template: Input[PathLike | None] = None,
    scan_unit: Input[float | str | None] = None,
    template_unit: Input[float | str | None] = None,
    crop: Input[Crop | str | None] = None,
    gaps: Input[Gaps] = "lost",
    progress: bool | None = None,
    **of_scans: Unpack[BesideScans],
) -> RigReport:
    """Says what is wrong with the cameras of depth images, and how their file is corrected.

    Some scans are compared with one another, and the first one with the template. If they disagree,
    every single reading of the file is tried: inverted poses, axes of OpenGL, millimetres, images
    of another size, depths along rays, mirrored images, of which a template alone can tell the last
    two. The result is doubtful if the cameras do not fit. A single camera is judged only by a
    template that lies where its points are. Floor and walls, planes that are larger than the
    template, are left out.

    Args:
        scans: depth images, as for tracking.
        template: the mesh, in about the pose of the first scan; of a single camera, also in its
            place.
        scan_unit: the unit of length of scans and cameras: m, cm, mm, km, inch, foot, yard, or a
            number of metres; else, as their files state it, or that of the template.
        template_unit: the unit of length of a template whose file states none.
        crop: leave out points outside the box x,y,z,x,y,z, or farther than this from that of the
            mesh, in the unit of the scans.
        gaps: what images are whose file or pose is missing: "refuse" makes them an error, "lost"
            what was not observed.
        progress: whether to show on standard error how far it is.
        of_scans: how the scans are read: `cameras`, `poses`, `subject` and `least_confidence` of
            :func:`dynmesh.scans.open_scans`.
    """
    path = path_of("scans", scans)
    # Without a crop, planes are found by themselves, but what it leaves of them may be too small.
    room = Background(crop, crop is not None)
    if template is None and room.follows:
        raise InputError("needs a `template`", argument="crop")
    reading: ScanSource = {"gaps": gaps, **of_scans}
    stated = read_rig(path, reading.pop("cameras", None), reading.pop("poses", None))

    def opened(cameras: Rig | None) -> ScanReader:
        of_cameras: ScanSource = {**reading, "cameras": cameras}
        return open_scans(path, **of_cameras)

    reader = opened(stated)
    if stated is None or not isinstance(reader, DepthReader):
        message = "holds point clouds; of cameras, only those of depth images can be judged"
        raise InputError(message, file=path)
    with_points = (n for n, scan in enumerate(reader) if scan is not None and scan.has_points)
    if (number := next(with_points, None)) is None:
        raise InputError("no frame has points", file=path)
    evenly = np.linspace(number, reader.n_frames - 1, _SCANS).astype(int)
    numbers = [*dict.fromkeys(evenly.tolist())]
    names = reader.cameras_of(numbers[0])
    surface = up = None
    if template is not None:
        with formats.open(template) as mesh:
            room.factor = units_of(reader, mesh, scan_unit, template_unit).factor
            surface = Surface(mesh.faces, template_of(mesh))
            up = mesh.header.up_axis

    def left(cameras: Rig) -> Iterator[DepthScan]:
        """What cameras leave of the scans, in the unit of the template."""
        reader = opened(cameras)
        for number in numbers:
            (scan,) = reader.frames(number, number + 1)
            if isinstance(scan, DepthScan):
                scan = scan.scaled(room.factor)
                if number == numbers[0] and surface is not None:
                    room.find(scan, surface.faces, surface.points)
                yield room.without(scan)

    def fit(scans: list[DepthScan]) -> Fit:
        return fit_of(scans, names, surface, moves=stated.moves)

    with steps("judging the cameras", progress) as show:
        compared = [*left(stated)]
        first = fit(compared)
        body = None if surface is None else (surface.faces, surface.points / room.factor)
        page_of = partial(
            rig_page, compared[0].scaled(1 / room.factor), body, up, path.name, first.each
        )
        blind = [camera.name for camera in stated.cameras if camera.name not in names]
        remark = f"without an image in the first scan, these are not judged: {', '.join(blind)}"
        result = RigReport(stated=first, remarks=(remark,) * bool(blind), _html=page_of)
        if first.is_good:
            return replace(result, rig=stated)
        better = list[tuple[str, Rig, Fit]]()
        for done, (wrong, change) in enumerate(READINGS.items() if first.wrong else ()):
            show(done, len(READINGS))
            meant = replace(stated, cameras=tuple(map(change, stated.cameras)))
            # Some readings are refused, as mirrored images with a distortion are.
            with contextlib.suppress(InputError):
                if (other := fit([*left(meant)])).is_better_than(first):
                    better.append((wrong, meant, other))
    if better:
        wrong, meant, other = min(better, key=lambda one: one[2].wrong)
        result = replace(result, rig=meant, wrong=wrong, meant=other)
    elif len(names) == 1:
        return result
    return replace(result, quality="doubtful", reason=result.told)
