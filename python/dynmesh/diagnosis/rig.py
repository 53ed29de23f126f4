"""Whether scans fit a template, or else each other, and if not, what is wrong.

Mistakes are recognised by trial: the first scan is read in each way that users confuse, and
compared with the template after the rigid motion with which tracking begins, or, without one, with
what the other cameras see. A way is named only if it fits clearly better; nothing is changed.
"""

from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from .._errors import InputError
from ..files.scans import ScanReader
from ..sequence import Positions
from .odd_cameras import odd_cameras
from .rig_agreement import disagreements
from .rig_reading import NO_UNITS, Hypothesis, Reading, RigFinding, Units
from .rig_trial import LEAST_POINTS, Fit, RigTrial
from .rig_view import View, views_of


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


def diagnose_rig(
    reader: ScanReader,
    reading: Reading,
    units: Units = NO_UNITS,
    faces: NDArray[Any] | None = None,
    template: Positions | None = None,
) -> RigDiagnosis:
    """Looks for mistakes in the cameras and, if there is a template, in the units and in it.

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
    found = [
        RigFinding(f"camera {v.name!r} sees nothing in the first scan", {}, v.name)
        for v in views
        if not v.measured
    ]
    seeing = [view for view in views if view.measured]
    compared = tuple(view.name for view in seeing)
    stated = None if reader.cameras is None else reader.cameras.stated
    if faces is None or template is None:
        found += disagreements(seeing, stated, reading)
        return RigDiagnosis(tuple(views), compared, tuple(found), None, 0.0)
    trial = RigTrial(seeing, stated, faces, template, reading)
    better = trial.better(units)
    measured = sum(view.measured for view in seeing)
    if better is not None:
        found.append(_as_finding(trial, *better))
    elif trial.left < LEAST_POINTS <= measured - trial.left:
        left = f"{trial.left} points are left of the first scan: the room is empty"
        found.append(RigFinding(f"without floor and walls, {left}", {}))
    else:
        found += odd_cameras(trial)
    within = trial.surface(reading).unit
    return RigDiagnosis(tuple(views), compared, tuple(found), trial.fit, within)


def _as_finding(trial: RigTrial, hypothesis: Hypothesis, fit: Fit) -> RigFinding:
    surface = trial.surface(trial.reading)
    edges = surface.unit / surface.mean_edge
    within = "a mean edge" if round(edges, 1) == 1 else f"{edges:.2g} mean edges"
    return RigFinding(
        f"{100 * fit.near:.0f} % of the first scan lies within {within} of the template if "
        f"{hypothesis.condition}, but {100 * trial.fit.near:.0f} % as it is read now: "
        f"{hypothesis.remedy}",
        hypothesis.options,
        is_refused=True,
    )
