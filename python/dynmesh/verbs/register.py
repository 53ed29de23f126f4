"""Registration of a template with the file of a scan."""

import contextlib
import os
from collections.abc import Callable, Generator
from dataclasses import dataclass, field, replace
from typing import Any, Unpack, overload

import numpy as np

from .. import formats, registration
from .._arrays import Positions
from .._checks import check_choice, check_integer, path_of
from .._errors import InputError
from .._options import Input, Method
from .._report import Report, as_json, steps
from ..advice.fit import LANDMARKS, contents, farthest, sizes
from ..completion.start import template_of
from ..draw.page import Page
from ..draw.page import page as scan_page
from ..formats import OneSequence, PathLike
from ..formats.format import Gaps
from ..frame import Frame, Frames
from ..polygons import Faces, Mesh
from ..registration import Landmarks, Registration
from ..run import Run
from ..scan import Scan
from ..scans import ScanReader
from ..scans.opening import BesideScans
from ..sequence import Sequence
from ..topology import size_of, size_of_surface
from ..tracking.background import Background, Crop
from ..tracking.inputs import open_single, read_landmarks, units_of

_LONG = ("vertices", "standard_error")
"""What :meth:`RegisterReport.to_dict` does not say of a result."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RegisterReport(Report):
    """What :func:`registered` has done.

    Attributes:
        quality: that of the registration.
        registration: the result.
    """

    registration: Registration = field(repr=False)
    _show: Callable[[], Page] = field(repr=False)

    def lines(self) -> list[str]:
        """Says how well the scan fits."""
        result = self.registration
        how = "good; " if self.quality == "good" else ""
        fit = (
            f"{how}{result.far:.2%} of the points are far from the mesh; "
            f"{100 * result.observed.mean():.3g} % of the vertices were seen"
        )
        return [fit, *super().lines()]

    def page(self, path: PathLike) -> None:
        """Writes an HTML file with the scan and the result, coloured by the distance to points."""
        path_of("path", path).write_text(self._show().html, encoding="utf-8")

    def to_dict(self) -> dict[str, Any]:
        """Returns how well the scan fits as values that JSON has."""
        result = self.registration
        measures = {
            name: as_json(measure) for name, measure in vars(result).items() if name not in _LONG
        }
        return super().to_dict() | measures | {"observed": float(result.observed.mean())}


def registered(
    template: OneSequence,
    scan: PathLike,
    *,
    landmarks: Input[PathLike | None] = None,
    frame: Input[float | None] = None,
    scan_unit: Input[float | str | None] = None,
    template_unit: Input[float | str | None] = None,
    crop: Input[Crop | str | None] = None,
    remove_planes: Input[bool] = False,
    align: Method[bool] = True,
    scale: Method[bool] = False,
    threads: Method[int] = 1,
    gaps: Input[Gaps] = "lost",
    progress: bool | None = None,
    **of_scans: Unpack[BesideScans],
) -> Run[RegisterReport]:
    """Registers a mesh with a scan: the same mesh, in the pose and the shape of the scan.

    Args:
        template: the mesh, of which the first frame is registered.
        scan: a point cloud (PLY, XYZ), a mesh, or the depth images of one moment: a
            folder, or a pattern such as 'depth_00012_*.png'.
        landmarks: a JSON file: [{"vertex": 12, "position": [x, y, z]}, ...], with positions in the
            unit of the scan.
        frame: the number of the scan, if there are several.
        scan_unit: the unit of length of the scan and the cameras: m, cm, mm, km, inch, foot, yard,
            or a number of metres; else, as their files state it, or that of the template.
        template_unit: the unit of length of a template whose file states none.
        crop: leave out points outside the box x,y,z,x,y,z, in the unit of the scan.
        remove_planes: whether to leave out floor and walls: planes in the scan that are larger than
            the mesh.
        align: whether to seek the rigid motion that puts the template into the scan.
        scale: whether the template may have another size than what was scanned, as in another unit.
            Whole sizes are compared, so neither may be a part of the other.
        threads: the number of threads that may work; more than one helps from about 2 000
            vertices or points on.
        gaps: what images are whose file or pose is missing: "refuse" makes them an error, "lost"
            what was not observed.
        progress: whether to show on standard error how far it is.
        of_scans: how the scan is read: `cameras`, `poses`, `subject` and `least_confidence` of
            :func:`dynmesh.scans.open_scans`.

    Returns:
        One frame, the registered mesh in the unit of the scan, which is made when it is read. Then
        there is a report, whose :meth:`~dynmesh.verbs.register.RegisterReport.page` shows it.
    """
    scan = path_of("scan", scan)
    room = Background(crop, remove_planes)
    if room.follows:
        message = f"must be two corners of a box, x,y,z,x,y,z, not {crop!r}"
        raise InputError(message, argument="crop", value=crop)
    if remove_planes and scale:
        message = "is not possible with scale, as the size of the template is not known"
        raise InputError(message, argument="remove_planes", value=True)
    check_integer("threads", threads, 1, 256)
    check_choice("gaps", gaps, Gaps)
    marked = [] if landmarks is None else [path_of("landmarks", landmarks)]
    reader = open_single(scan, frame, gaps=gaps, **of_scans)
    marks = read_landmarks(marked[0]) if marked else None
    with contextlib.ExitStack() as stack:
        mesh = stack.enter_context(formats.opened(template, "template"))
        units = units_of(reader, mesh, scan_unit, template_unit, assumes=True)
        own = template_of(mesh)
        size = size_of_surface(mesh.faces, own)
        first = np.asarray(own / units.factor, own.dtype)  # in the unit of the scan

        def sizes_in(left: Scan, *, ratio_is_told: bool) -> str:
            scanned = size_of(left.cloud)
            return "" if scale else sizes(scanned, size, units, ratio_is_told=ratio_is_told)

        def fit(left: Scan) -> Registration:
            try:
                with steps("registering", progress):
                    return registration.register(
                        mesh.faces,
                        first,
                        left,
                        landmarks=marks,
                        align=align,
                        scale=scale,
                        threads=threads,
                    )
            except InputError as error:
                about = marked[0] if str(error).startswith("landmarks: ") else None
                stated = sizes_in(left, ratio_is_told=True)
                message = "; ".join(filter(None, [str(error), stated]))
                raise InputError(message, file=about) from error

        def make() -> Generator[Frame, None, RegisterReport]:
            with formats.naming(reader.path):
                (measured,) = reader.frames()
                if measured is None:
                    raise InputError("all of its images are missing or damaged")
                left = room.enter(measured, mesh.faces, first)
                result = fit(left)
                seen = ""
                if result.quality != "good" and not scale:
                    # A plane in the scan of a larger subject may be a part of it.
                    if result.cause != "size":
                        seen = contents(left, first, mesh.faces, room)
                    seen = seen or sizes_in(left, ratio_is_told=result.cause == "size")
            yield Frame(result.vertices)
            times = result.scale * result.growth
            remark = f"the template became {times:.3g} times as large" if scale else ""
            return RegisterReport(
                quality=result.quality,
                reason=_reason(result, marks, seen),
                remarks=(*filter(None, [remark, room.remark]), *reader.lost, *reader.remarks),
                registration=result,
                _show=lambda: _page(result, mesh, reader),
            )

        header = replace(
            mesh.header,
            n_frames=1,
            start=0,
            times=None,
            metres_per_unit=units.scans or (None if scale else units.template),
            attributes=(),
        )
        return Run(
            header,
            make,
            mesh,
            files=[*reader.files, *marked],
            origin=mesh.origin,
            measured=reader.path,
            close=stack.pop_all().close,
        )


def _page(registration: Registration, mesh: Frames, reader: ScanReader) -> Page:
    return scan_page(
        Sequence(registration.vertices[None], mesh.faces).named(f"{mesh.path.name}, registered"),
        scans=reader,
        colour="distance",
        title=f"{mesh.path.name} registered with {reader.path.name}: {registration.quality}",
        up=mesh.header.up_axis,
    )


def _reason(result: Registration, landmarks: Landmarks | None, seen: str) -> str:
    """The quality and its reason, and what to do about it; empty if it is good."""
    if result.quality == "good":
        return ""
    about = LANDMARKS if landmarks is None else farthest(result.vertices, landmarks)
    told = "; ".join(filter(None, [result.reason, seen, about]))
    return f"{result.quality}: {told}"


@overload
def register(template: OneSequence, scan: PathLike, **options: Any) -> Run[RegisterReport]: ...
@overload
def register(
    faces: Faces | Mesh,
    template: Positions | Scan | tuple[Positions, Positions],
    points: Positions | Scan | tuple[Positions, Positions] | None = None,
    normals: Positions | None = None,
    **options: Any,
) -> Registration: ...
def register(*given: Any, **options: Any) -> Run[RegisterReport] | Registration:
    """Finds a template in a scan: the mesh, in the shape of the scan.

    With the file of a scan, as ``register("body.obj", "scan.ply")``, this is a run of one frame,
    with the options of :func:`dynmesh.verbs.register.registered`; of arrays or a mesh of another
    library, as ``register(faces, template, points)`` or ``register(mesh, points)``, it is
    :func:`dynmesh.registration.register`, which describes the result and the options.
    """
    every = [*given[:2], options.get("template"), options.get("scan")]
    is_of_files = any(isinstance(one, str | os.PathLike) for one in every)
    function: Any = registered if is_of_files else registration.register
    result: Run[RegisterReport] | Registration = function(*given, **options)
    return result
