"""Whether the cameras of depth images are read as they are meant, and a file that corrects them."""

from dataclasses import replace
from typing import Any

from .._checks import path_of
from .._errors import InputError
from .._options import Input, Output
from .._progress import steps
from ..draw.rig_page import rig_page
from ..formats import PathLike
from ..formats.output import check_output, new_output
from ..scans import write_cameras
from ..scans.reader import read_rig
from ..tracking.background import Background, Crop
from ..tracking.rig import RigReport, judge_rig


def rig(
    scans: PathLike,
    *,
    output: Output[PathLike | None] = None,
    template: Input[PathLike | None] = None,
    cameras: Input[PathLike | None] = None,
    scan_unit: Input[float | str | None] = None,
    template_unit: Input[float | str | None] = None,
    crop: Input[Crop | str | None] = None,
    remove_planes: Input[bool] = False,
    page: Output[PathLike | None] = None,
    overwrite: Output[bool] = False,
    progress: bool = False,
) -> RigReport:
    """Says what is wrong with the cameras of depth images, and corrects their file.

    The usual misreadings are tried on the first scan: inverted poses, axes of OpenGL, transposed
    rotations, exchanged cameras, flipped images, depths along rays, millimetres. The result is
    doubtful if the cameras do not fit.

    Args:
        scans: depth images, as for tracking.
        output: a JSON file to write with the corrected cameras.
        template: the mesh, in about the pose of the first scan; without it, nothing is judged.
        cameras: the file of the cameras; else, `cameras.json` beside the scans.
        scan_unit: the unit of length of scans and cameras: m, cm, mm, km, inch, foot, yard, or a
            number of metres; else, as their files state it, or that of the template.
        template_unit: the unit of length of a template whose file states none.
        crop: leave out points outside the box x,y,z,x,y,z, or farther than this from that of the
            mesh, in the unit of the template.
        remove_planes: whether to leave out floor and walls: planes in the first scan that are
            larger than the mesh.
        page: an HTML file to write that shows the cameras, what they see, and the template.
        overwrite: whether to replace existing outputs.
        progress: whether to show on standard error how far it is.

    Raises:
        OSError, ImportError, ValueError: a file cannot be read or written, the scans are no depth
            images, or no frame has points.
    """
    path = path_of("scans", scans)
    if template is None and (page is None or output is not None):
        raise InputError("is needed; without it, a page shows the cameras", argument="template")
    # Without a crop, planes are found by themselves, but what it leaves of them may be too small.
    room = Background(crop, remove_planes or crop is not None)
    needs = {"crop": room.follows, "remove_planes": remove_planes}
    if template is None and (argument := next((name for name in needs if needs[name]), None)):
        raise InputError("needs a `template`", argument=argument)
    stated = read_rig(path, cameras)
    output = None if output is None else path_of("output", output)
    page = None if page is None else path_of("page", page)
    for given, suffix in ((output, ".json"), (page, ".html")):
        if given is not None:
            inputs = [] if stated is None or stated.file is None else [stated.file]
            check_output(given, overwrite, suffix, inputs=inputs)
    with steps("judging the cameras", progress) as show:
        result = judge_rig(path, stated, template, scan_unit, template_unit, room, show)
    made: dict[str, Any] = {"reason": "" if result.quality == "good" else result.told}
    if output is not None and result.rig is None:
        made["remarks"] = (f"{output} is not written, as no correction is known",)
    elif output is not None and result.rig is not None:
        made["output"] = output
        with new_output(output, overwrite, ".json") as hidden:
            write_cameras(hidden, result.rig)
    if page is not None:
        made["page"] = page
        shown = rig_page(
            result.scan,
            result.template,
            up=result.up,
            title=f"{path.name}, the first scan",
            told=result.told,
            names=result.names,
        )
        with new_output(page, overwrite, ".html") as hidden:
            hidden.write_text(shown, encoding="utf-8")
    return replace(result, **made)
