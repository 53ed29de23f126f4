"""A rig before tracking: what is wrong with it, and a page that shows it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .. import files
from ..diagnosis.rig import RigDiagnosis, View, diagnose_rig
from ..diagnosis.rig_reading import Units, turned
from ..draw.rig_page import ShownCamera, rig_page
from ..files import PathLike
from .rig_options import RigOptions
from .start import template_of


@dataclass(frozen=True, eq=False)
class RigReport:
    """What `dynmesh rig` says and shows.

    Attributes:
        diagnosis: of the first scan with points.
        wrong: what is wrong, in sentences.
        right: what else is said.
        table: rows of words, the first of which is the head; what each camera sees.
        page: an HTML document.
    """

    diagnosis: RigDiagnosis
    wrong: tuple[str, ...]
    right: tuple[str, ...]
    table: tuple[tuple[str, ...], ...]
    page: str


def report_rig(
    scans: PathLike, template: PathLike | None, options: RigOptions, up: str | None = None
) -> RigReport:
    """Looks at the first scan of a rig and, if there is one, at the template.

    Args:
        scans: as for :func:`dynmesh.track_file`.
        template: a mesh file; None to show the cameras and what they see only.
        options: what is said about the cameras, the units and the template.
        up: "x", "y" or "z"; None means as the template states it, or else y.

    Raises:
        OSError, ImportError, TypeError, ValueError: a file cannot be read, or no frame has points.
    """
    options = options.checked()
    reader = options.open(scans)
    if template is None:
        units, shown = Units(scans=reader.metres_per_unit), None
        reading = options.reading(Units(), Path())
        diagnosis = diagnose_rig(reader, reading)
    else:
        with files.open(template) as mesh:
            units = options.units(reader, mesh.header.metres_per_unit)
            reading = options.reading(units, mesh.path)
            first = template_of(mesh)
            diagnosis = diagnose_rig(reader, reading, units, mesh.faces, first)
            shown = mesh.faces, turned(first, reading.turns)
            up = up or mesh.header.up_axis
    wrong = tuple(f"{finding.message}" for finding in diagnosis.findings)
    table = _table(diagnosis, reading.factor)
    right = _otherwise(diagnosis)
    page = rig_page(
        [_shown(view, reading.factor) for view in diagnosis.views],
        shown,
        up=up or "y",
        title=f"{Path(scans).name}, the first scan",
        wrong=wrong,
        right=right,
        table=table,
    )
    return RigReport(diagnosis, wrong, right, table, page)


def _otherwise(diagnosis: RigDiagnosis) -> tuple[str, ...]:
    """Says how well the scan fits, if nothing is wrong."""
    if diagnosis.fit is None:
        return ("Only cameras and scans are shown; with a template they are compared with it.",)
    if diagnosis.findings:
        return ()
    share = f"{100 * diagnosis.fit.near:.0f} %"
    sentence = f"{share} of the subject's points lie within {diagnosis.within:.2g} of the template."
    if diagnosis.fit.near < 0.5:
        more = "No mistake in cameras or units was recognised; the pose or the mesh may differ."
        return sentence, more
    return (sentence,)


def _table(diagnosis: RigDiagnosis, factor: float) -> tuple[tuple[str, ...], ...]:
    """Returns what each camera sees, in rows of words."""
    rows: list[tuple[str, ...]] = [
        ("camera", "points", "image", "nearest", "farthest", "on template")
    ]
    near = dict(
        zip(diagnosis.compared, diagnosis.fit.by_camera if diagnosis.fit else (), strict=False)
    )
    for view in diagnosis.views:
        pixels = view.size[0] * view.size[1]
        share = f"{100 * view.measured / pixels:.0f} %" if pixels else ""
        depths = view.depths * factor
        ends = [f"{x:.3g}" for x in np.quantile(depths, (0.01, 0.99))] if len(depths) else ["", ""]
        on = f"{100 * near[view.name]:.0f} %" if view.name in near else ""
        rows.append((view.name or "all", str(view.measured), share, *ends, on))
    return tuple(rows)


def _shown(view: View, factor: float) -> ShownCamera:
    camera = view.camera
    points = view.cloud(camera) * factor
    if camera is None:
        return ShownCamera("", points, None, None, view.size)
    pose = camera.camera_to_world.copy()
    pose[:3, 3] *= factor
    return ShownCamera(camera.name, points, pose, camera.intrinsics, view.size)
