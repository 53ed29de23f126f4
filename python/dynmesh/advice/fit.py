"""What is told where a template does not fit a scan: what is there, and what can be done."""

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._arrays import Positions
from ..registration import Landmarks
from ..scan import Scan, inside_out
from ..tracking.background import Background, planes_around
from ..tracking.inputs import Units

LANDMARKS = "`landmarks` say where ends and corners, for example, belong"
CAMERAS = (
    "dynmesh rig, with the same scans, cameras and template, tells whether the cameras are read as "
    "they are meant"
)


def sizes(of_scan: float, of_template: float, units: Units, *, ratio_is_told: bool = False) -> str:
    """States the diagonals of a scan and a template in their units; empty if they are alike.

    Their ratio is stated, too, unless it `ratio_is_told` already, perhaps as another one, of sizes
    that are measured in another way.
    """
    ratio = of_scan * units.factor / of_template
    if 1 / _core.other_size < ratio < _core.other_size:
        return ""
    ours, theirs = ("no unit stated" if unit is None else f"in {unit:g} m" for unit in units)
    advice = "; `template_unit` and `scan_unit` state units" if None in units else ""
    stated = f"the scan is {ratio:.3g} times as large as the template: its diagonal is"
    if ratio_is_told:
        stated = "the diagonal of the scan is"
    return (
        f"{stated} {of_scan:.3g} ({theirs}), that of the template "
        f"{of_template:.3g} ({ours}){advice}"
    )


def contents(scan: Scan, template: Positions, faces: NDArray[np.integer], room: Background) -> str:
    """Says that a scan shows floor or walls, or the inside of a body; empty if it does not.

    Floor and walls are sought in what each camera sees, since cameras that are misread scatter the
    parts of the subject. The walls of a room face its middle.
    """
    if not any(planes_around(template, faces, cloud) for cloud in scan.clouds):
        return inside_out(scan)
    options = "`crop`" if room.removes_planes else "`remove_planes` or `crop`"
    return (
        f"the scan shows a plane larger than the template, such as a floor; {options} leaves it out"
    )


def farthest(vertices: Positions, landmarks: Landmarks) -> str:
    """Names the landmark that is farthest from its vertex, as registered."""
    marked, positions = landmarks
    distances = np.linalg.norm(vertices[marked] - positions, axis=1)
    worst = int(distances.argmax())
    return f"vertex {marked[worst]} lies {distances[worst]:.3g} from its landmark"
