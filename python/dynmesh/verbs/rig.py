"""Whether the cameras of depth images are read as they are meant, and a file that corrects them."""

from dataclasses import replace
from typing import Unpack

from .._checks import path_of
from .._errors import InputError
from .._options import Input
from .._progress import steps
from ..advice.cameras import RigReport, judge_rig
from ..formats import PathLike
from ..scans.reader import ScanSource, read_rig
from ..tracking.background import Background, Crop


def rig(
    scans: PathLike,
    *,
    template: Input[PathLike | None] = None,
    scan_unit: Input[float | str | None] = None,
    template_unit: Input[float | str | None] = None,
    crop: Input[Crop | str | None] = None,
    remove_planes: Input[bool] = False,
    progress: bool | None = None,
    **of_scans: Unpack[ScanSource],
) -> RigReport:
    """Says what is wrong with the cameras of depth images, and how their file is corrected.

    Some scans are compared with one another, and the first one with the template. If they disagree,
    every single reading of the file is tried: inverted poses, axes of OpenGL, millimetres, images
    of another size, depths along rays, mirrored images. The result is doubtful if the cameras do
    not fit. A single camera cannot be judged, unless the template lies where its points are.

    Args:
        scans: depth images, as for tracking.
        template: the mesh, in about the pose of the first scan; of a single camera, also in its
            place.
        scan_unit: the unit of length of scans and cameras: m, cm, mm, km, inch, foot, yard, or a
            number of metres; else, as their files state it, or that of the template.
        template_unit: the unit of length of a template whose file states none.
        crop: leave out points outside the box x,y,z,x,y,z, or farther than this from that of the
            mesh, in the unit of the template.
        remove_planes: whether to leave out floor and walls: planes in the first scan that are
            larger than the mesh.
        progress: whether to show on standard error how far it is.
        of_scans: how the scans are read: `cameras`, `poses`, `gaps`, `subject` and
            `least_confidence` of :func:`dynmesh.scans.open_scans`.

    Raises:
        OSError, ImportError, ValueError: a file cannot be read, the scans are no depth images, or
            no frame has points.
    """
    path = path_of("scans", scans)
    # Without a crop, planes are found by themselves, but what it leaves of them may be too small.
    room = Background(crop, remove_planes or crop is not None)
    needs = {"crop": room.follows, "remove_planes": remove_planes}
    if template is None and (argument := next((name for name in needs if needs[name]), None)):
        raise InputError("needs a `template`", argument=argument)
    reading: ScanSource = {"gaps": "lost", **of_scans}
    stated = read_rig(path, reading.pop("cameras", None), reading.pop("poses", None))
    with steps("judging the cameras", progress) as show:
        result = judge_rig(path, stated, reading, template, scan_unit, template_unit, room, show)
    files = () if stated is None or stated.file is None else (stated.file,)
    reason = "" if result.quality == "good" else result.told
    return replace(result, reason=reason, path=path, files=files)
