"""A rig before tracking: what is wrong with it, and a page that shows it."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import files
from .._errors import InputError
from ..diagnosis.rig import RigDiagnosis, diagnose_rig
from ..diagnosis.rig_reading import Units, turned
from ..diagnosis.rig_view import View
from ..draw.rig_page import ShownCamera, rig_page
from ..files import PathLike
from ..files.scans import PointScan
from ..sequence import Positions
from .rig_options import RigOptions
from .room import Room
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
        for name in ("crop", "remove_planes"):
            if isinstance(value := getattr(options, name), float | bool) and value:
                told = f"is measured by the template, but there is none: {value!r} needs --template"
                raise InputError(told, argument=name)
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
    cameras = [_shown(view, reading.factor) for view in diagnosis.views]
    table = _table(diagnosis, reading.factor)
    if options.crop is not None or options.remove_planes:
        cameras = _without(options.room, cameras, shown)
        left = [f"{100 * share:.0f} %" for share in _left(cameras, diagnosis)]
        table = tuple((*row, cell) for row, cell in zip(table, ["left", *left], strict=True))
    right = _otherwise(diagnosis)
    page = rig_page(
        cameras,
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
        told = "Only cameras that see the same are compared; with a template, all are."
        return (told,)
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
        depths = view.rays[:, 2] * factor if pixels else np.zeros(0)
        ends = [f"{x:.3g}" for x in np.quantile(depths, (0.01, 0.99))] if len(depths) else ["", ""]
        on = f"{100 * near[view.name]:.0f} %" if view.name in near else ""
        rows.append((view.name or "all", str(view.measured), share, *ends, on))
    return tuple(rows)


def _without(
    room: Room, cameras: list[ShownCamera], template: tuple[NDArray[Any], Positions] | None
) -> list[ShownCamera]:
    """Returns the cameras without the points that tracking would leave out."""
    whole = PointScan(np.concatenate([camera.points for camera in cameras]), None, None)
    if template is not None:
        room.look(whole, *template)
    return [replace(camera, points=camera.points[room.leaves(camera.points)]) for camera in cameras]


def _left(cameras: list[ShownCamera], diagnosis: RigDiagnosis) -> Iterator[float]:
    for camera, view in zip(cameras, diagnosis.views, strict=True):
        yield len(camera.points) / max(1, len(view.rays))


def _shown(view: View, factor: float) -> ShownCamera:
    camera = view.camera
    points = view.cloud(camera) * factor
    if camera is None:
        return ShownCamera("", points, None, None, view.size)
    pose = camera.camera_to_world.copy()
    pose[:3, 3] *= factor
    return ShownCamera(camera.name, points, pose, camera.intrinsics, view.size)
