"""What to do about a registration that is not good."""

import numpy as np

from ..files.scans import Scan
from ..frames.scan import PointScan
from ..registration import Landmarks, Registration
from ..sequence import Positions
from .register_options import RegisterOptions

_MISPLACED = 0.03
"""Farther from its position than this share of the diagonal, a landmark is named."""
_HOLE = 0.03
"""With more vertices that have no point, the sensors probably did not see them."""
_MANY_FAR = 0.05
"""With more far points, the scan probably shows other things as well."""
_OTHER_UNIT = 4
"""A scan of another unit is larger or smaller than the template by more than this."""


def advised(
    found: Registration,
    template: Positions,
    scan: Scan | None,
    landmarks: Landmarks | None,
    options: RegisterOptions,
) -> str:
    """The quality and its reason, and what to do about it."""
    if found.quality == "good":
        return ""
    advice = []
    if scan is not None and not options.scale:
        sizes = [float(np.linalg.norm(np.ptp(x, axis=0))) for x in (scan.cloud, template)]
        if not 1 / _OTHER_UNIT < sizes[0] / sizes[1] < _OTHER_UNIT:
            advice.append(
                f"the scan is {sizes[0] / sizes[1]:.2g} times as large as the template: "
                "--scale, if their units differ"
            )
    if found.quality == "ruined":
        advice.append(
            "template and scan must be in one unit, and dynmesh convert --to-unit or --scale "
            "changes that of a file"
        )
    if landmarks is None:
        advice.append("--landmarks FILE says where head, hands and feet, for example, belong")
    else:
        distances = np.linalg.norm(found.vertices[landmarks[0]] - landmarks[1], axis=1)
        worst = int(distances.argmax())
        if distances[worst] > _MISPLACED * np.linalg.norm(np.ptp(found.vertices, axis=0)):
            advice.append(
                f"look at the landmarks: vertex {landmarks[0][worst]} came to lie "
                f"{distances[worst]:.3g} from its position"
            )
    if isinstance(scan, PointScan) and scan.viewpoints is None and found.hole > _HOLE:
        advice.append("--cameras FILE says what the sensors could not see")
    if found.far > _MANY_FAR and not options.remove_planes:
        advice.append("--remove-planes leaves out floor and walls, --crop other things")
    if options.page is None:
        advice.append("--page FILE.html shows what is wrong")
    return "; ".join([f"{found.quality}: {found.reason}", *advice])
