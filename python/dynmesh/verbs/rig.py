"""Whether the cameras of depth images are read as they are meant, and a file that corrects them."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .._checks import check_path
from .._command import Output, What
from .._errors import InputError
from .._report import Report
from ..draw.rig_page import rig_page
from ..files import PathLike
from ..files.new_output import check_output, new_output
from ..scans import DepthScan, Rig, write_cameras
from ..scans.reader import read_rig
from ..sequence import Positions
from ..tracking.rig import FIT, Fit, Reading, judge_rig


@dataclass(frozen=True, kw_only=True, eq=False)
class RigReport(Report):
    """What :func:`rig` has found.

    Attributes:
        quality: "doubtful" if the cameras do not fit as they are stated; "good" if nothing is
            judged.
        scan: the first one with points, in the unit of the template, as the cameras are stated.
        cameras: the names of those that have an image in it.
        template: its faces and vertices, or None if there is none.
        up: the up axis that the template states, else "y".
        stated: how the scan lies on the template; None without one.
        rig: the corrected cameras; None if no correction is known.
        reading: what is wrong with them, if it is known.
        meant: how the scan lies on the template then.
        output: the corrected file that was written, or None.
        page: the page that was written, or None.
    """

    scan: DepthScan = field(repr=False)
    cameras: tuple[str, ...]
    template: tuple[NDArray[np.integer], Positions] | None = field(default=None, repr=False)
    up: str = "y"
    stated: Fit | None = None
    rig: Rig | None = field(default=None, repr=False)
    reading: Reading | None = field(default=None, repr=False)
    meant: Fit | None = None
    output: Path | None = None
    page: Path | None = None

    def lines(self) -> list[str]:
        """Says what was found, and what was written."""
        told = [self.told]
        if self.output is not None:
            told.append("the corrected cameras are written")
        if self.page is not None:
            told.append(f"open {self.page} in a browser")
        return [*told, *self.remarks]

    @property
    def names(self) -> tuple[str, ...]:
        """The cameras with their shares of far points."""
        if self.stated is None:
            return self.cameras
        each = zip(self.cameras, self.stated.by_camera, strict=True)
        return tuple(f"{name}: {far:.0%} far" for name, far in each)

    @property
    def told(self) -> str:
        """What was found, in a sentence."""
        if self.stated is None:
            return "without a template, nothing is judged"
        far = f"{self.stated.far:.1%} of the first scan's points are far from the template"
        if self.reading is not None and self.meant is not None:
            return f"{self.reading.wrong}: {far}, but {self.meant.far:.1%} if that is corrected"
        if self.rig is not None:
            return f"the cameras fit: {far}"
        wrong = np.flatnonzero(np.array(self.stated.by_camera) > FIT)
        why = "the cameras or the template's pose, shape or unit are not those of the scan"
        if len(wrong) == 1 < len(self.cameras):
            why = f"the pose or the intrinsics of camera {self.cameras[wrong[0]]!r} are wrong"
        return (
            f"{far} (cameras {', '.join(self.names)}), and no usual misreading explains it: {why}"
        )


def rig(
    scans: PathLike,
    *,
    output: Output[PathLike | None] = None,
    template: What[PathLike | None] = None,
    cameras: What[PathLike | None] = None,
    scan_unit: What[float | str | None] = None,
    page: Output[PathLike | None] = None,
    overwrite: Output[bool] = False,
) -> RigReport:
    """Says what is wrong with the cameras of depth images, and corrects their file.

    The usual misreadings are tried on the first scan: inverted poses, axes of OpenGL, transposed
    rotations, exchanged cameras, millimetres. The result is doubtful if the cameras do not fit.

    Args:
        scans: depth images, as for tracking.
        output: a JSON file to write with the corrected cameras.
        template: the mesh, in about the pose of the first scan; without it, nothing is judged.
        cameras: the file of the cameras; else, `cameras.json` beside the scans.
        scan_unit: the unit of length of scans and cameras: m, cm, mm, km, inch, foot, yard, or a
            number of metres; else, as their files state it, or that of the template.
        page: an HTML file to write that shows the cameras, what they see, and the template.
        overwrite: whether to replace existing outputs.

    Raises:
        OSError, ImportError, ValueError: a file cannot be read or written, the scans are no depth
            images, or no frame has points.
    """
    check_path("scans", scans)
    if template is None and (page is None or output is not None):
        raise InputError("is needed; without it, a page shows the cameras", argument="template")
    path = Path(scans)
    stated = read_rig(path, cameras)
    for given, suffix in ((output, ".json"), (page, ".html")):
        if given is not None:
            inputs = [] if stated is None or stated.file is None else [stated.file]
            check_output(Path(given), overwrite, suffix, inputs=inputs)
    judged = judge_rig(path, stated, template, scan_unit)
    fits = template is None or judged.rig is stated
    found = RigReport(quality="good" if fits else "doubtful", **judged._asdict())
    if output is not None and found.rig is None:
        no_correction = f"{output} is not written, as no correction is known"
        found = replace(found, remarks=(no_correction,))
    elif output is not None and found.rig is not None:
        with new_output(Path(output), overwrite, ".json") as made:
            write_cameras(made, found.rig)
        found = replace(found, output=Path(output))
    if page is not None:
        shown = rig_page(
            found.scan,
            found.template,
            up=found.up,
            title=f"{path.name}, the first scan",
            told=found.told,
            names=found.names,
        )
        with new_output(Path(page), overwrite, ".html") as made:
            made.write_text(shown, encoding="utf-8")
        found = replace(found, page=Path(page))
    return found
