"""Registration of a template with one scan."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from . import _arrays, _core
from ._arrays import Mask, Positions
from ._checks import check_flags, check_integer
from ._errors import InputError, KindError
from ._scan_arrays import image_arrays, scan_arrays
from ._stream import trained
from .polygons import Faces, Mesh, mesh_arrays
from .scan import DepthScan, Scan, parts_of
from .tracker import MeshInScan

__all__ = ["Registration", "register"]

Landmarks: TypeAlias = tuple[NDArray[np.integer[Any]], Positions]
"""Vertices (n,) of a template and the positions (n, 3) of the scan to which they belong."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Registration(MeshInScan):
    """What :func:`dynmesh.register` returns; see also :class:`dynmesh.tracker.MeshInScan`.

    Attributes:
        vertices: (k, 3), with the dtype of the template, in the unit of the points.
        observed: (k,) bool, whether the vertex has a measured point.
        standard_error: (k,) as :attr:`dynmesh.Tracker.standard_error`; None without `uncertainty`.
        transform: (4, 4) float64, the rigid motion that brings the template closest to the
            vertices; with `scale`, its rotation is multiplied by the scale that was found.
        rounds: how often the whole surface was drawn into the scan.
        converged: whether the vertices had stopped moving then.
        quality: "good"; "doubtful", if a part is probably wrong or missing, or a landmark is not
            where it belongs; "ruined", if the scan shows something else or the pose was not found.
            Points of other things say nothing, so that the template may be a part of what was
            scanned; see docs/reference/tracking.md.
        scale: how many times as large as the unit of the template that of the points is; 1 without
            `scale`, in whose units `growth` is.
    """

    vertices: Positions
    observed: Mask
    standard_error: NDArray[np.floating[Any]] | None
    transform: NDArray[np.float64]
    rounds: int
    converged: bool
    scale: float


def register(
    faces: Faces | Mesh,
    template: Positions | Scan | tuple[Positions, Positions],
    points: Positions | Scan | tuple[Positions, Positions] | None = None,
    normals: Positions | None = None,
    *,
    landmarks: Landmarks | None = None,
    align: bool = True,
    scale: bool = False,
    viewpoints: Positions | None = None,
    training: Iterable[Positions] | None = None,
    uncertainty: bool = False,
    threads: int = 1,
) -> Registration:
    """Finds a template in a scan: the mesh, in the shape of the scan.

    The template is first moved rigidly, by at least three landmarks that are not on a line or else
    from any rotation, then bent as a coarse mesh, and at last as :class:`dynmesh.Tracker` does,
    until its vertices stop. The scan may show it partially, the template may be a part of what was
    scanned, or both. A scan of something else is not refused, but its quality is "ruined"; the
    mirror image of the template is not recognised.

    Args:
        faces: (m, 3) integers, or other polygons; see :data:`dynmesh.polygons.Faces`. Or a mesh of
            another library, without `template`: ``register(mesh, points, normals)``.
        template: (k, 3) float32 or float64, complete and finite, in any pose.
        points: (n, 3) finite, at least twelve, in any order; or a tuple of points and normals; or a
            :class:`dynmesh.scans.PointScan` or DepthScan, of one or several cameras of the same
            moment.
        normals: (n, 3) the outward normals of the points, of any length; a normal of 0 is not
            known. None if they are to be estimated from the nearest points. If they point inwards,
            nothing fits.
        landmarks: vertices of the template, (n,) integers, and (n, 3) their positions in the scan.
            On ends of limbs, they find poses that are far from that of the template more often.
        align: whether the rigid motion is sought. If not, the template must be where the scan is.
        scale: whether the template may have another size than what was scanned, as in another unit
            of length. Whole sizes are compared, so neither may be a part of the other.
        viewpoints: (c, 3) the positions of the sensors. Give them if they are known: what no sensor
            can see is then not compared with the scan.
        training: None, or other complete frames of the template, as for :class:`dynmesh.Tracker`.
        uncertainty: whether standard errors are wanted.
        threads: the number of threads that may work; more than one helps from about 2 000
            vertices or points on.

    Raises:
        ValueError: landmarks contradict each other or lie far outside the scan, or the sizes differ
            by a factor of more than 20, without `scale`.
    """
    own: Any = faces
    arrays: Any = (template, points, normals)
    if (mesh := mesh_arrays(faces)) is not None:
        own, arrays = mesh[0], (mesh[1], template, points)
    template, points, normals = arrays
    frame = _arrays.first_frame("template", template)
    if isinstance(points, DepthScan):
        _one_of("normals", points.depth, normals)
        _one_of("viewpoints", points.poses, viewpoints)
        scan: Any = image_arrays(*points)
    else:
        own_points, own_normals, own_viewpoints = parts_of(points)
        normals = _one_of("normals", own_normals, normals)
        viewpoints = _one_of("viewpoints", own_viewpoints, viewpoints)
        scan = scan_arrays(own_points, normals, viewpoints, frame.dtype)
    check_flags(align=align, scale=scale, uncertainty=uncertainty)
    check_integer("threads", threads, 1, 256)
    triangles = _arrays.triangles(own, len(frame))
    marks = _landmark_arrays(landmarks, frame.dtype)
    learnt = None if training is None else trained(training, frame)
    choices = align, scale, learnt, uncertainty, threads
    flat, observed, errors, result = _core.register(triangles, frame, scan, *marks, *choices)
    vertices = flat.reshape(-1, 3)
    result["transform"] = result["transform"].reshape(4, 4)
    return Registration(
        vertices=vertices,
        observed=observed.astype(np.bool_),
        standard_error=errors if uncertainty else None,
        **result,
    )


def _one_of(argument: str, of_scan: Any, given: Any) -> Any:
    """Returns what a scan has or what is given beside it; refuses both."""
    if of_scan is not None and given is not None:
        raise InputError("are those of the scan, and cannot be given beside it", argument=argument)
    return given if of_scan is None else of_scan


def _landmark_arrays(landmarks: Any, dtype: Any) -> tuple[NDArray[np.int32], Positions]:
    if landmarks is None:
        landmarks = [], np.empty((0, 3))
    if not isinstance(landmarks, tuple | list) or len(landmarks) != 2:
        raise KindError(
            f"must be a pair of vertices (n,) and positions (n, 3), not {type(landmarks).__name__}",
            argument="landmarks",
        )
    vertices, positions = landmarks
    return (
        _arrays.indices("landmarks", vertices),
        _arrays.points("landmarks", positions, dtype, "(n, 3)"),
    )
