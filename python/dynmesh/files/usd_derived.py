"""Normals, velocities and accelerations in a USD stage: which there are, and new ones.

A result that is laid over its original hides only what it says itself. So it says all that followed
from the points of the original, or blocks it.
"""

from collections.abc import Iterator, Sequence
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..polygons import Polygons
from ..sequence import Positions
from .derivatives import Motions, Normals, layout_of
from .header import Frame, Header
from .times import frame_numbers
from .usd_stage import library_array, pxr

_least_frames = {"velocities": 2, "accelerations": 3}


def derived_of(
    mesh: Any, polygons: Polygons, points: Positions, time: float
) -> dict[str, str] | None:
    """What the mesh has of :attr:`Header.derived`, judged by its first frame; None for nothing."""
    geometry = pxr("UsdGeom")
    left_handed = mesh.GetOrientationAttr().Get() == geometry.Tokens.leftHanded
    primvar = geometry.PrimvarsAPI(mesh).GetPrimvar("normals")
    derived = {}
    for name, attribute, interpolation in (
        ("normals", mesh.GetNormalsAttr(), mesh.GetNormalsInterpolation()),
        ("primvars:normals", primvar.GetAttr(), primvar and primvar.GetInterpolation()),
    ):
        if not (attribute and attribute.HasAuthoredValue()):
            continue
        value = attribute.Get(time)
        values = np.array([] if value is None else value)
        if name == "primvars:normals" and primvar.IsIndexed():
            indices = np.array(primvar.GetIndices(time), np.int64)
            there = (indices >= 0) & (indices < len(values))
            values = values[indices[there]]  # if some are not, too few are left
        derived[name] = layout_of(
            values, interpolation, polygons, points, reversed_if_unknown=left_handed
        )
    for name, attribute in (
        ("velocities", mesh.GetVelocitiesAttr()),
        ("accelerations", mesh.GetAccelerationsAttr()),
    ):
        if attribute.HasAuthoredValue():
            derived[name] = "vertex"
    return derived or None


class DerivedAttributes:
    """What a header says is derived, on its way into a stage.

    Attributes:
        blocked: why an attribute has no values, but hides those of another layer, by its name.
    """

    def __init__(self, stage: Any, mesh: Any, header: Header, polygons: Polygons) -> None:
        """Makes the attributes of the mesh; the rate of the stage is set already."""
        self.blocked: dict[str, str] = {}
        self._motions = Motions(frame_numbers(header) / stage.GetTimeCodesPerSecond())
        self._normals: dict[str, Normals] = {}
        self._attributes: dict[str, Any] = {}
        for name, how in (header.derived or {}).items():
            attribute = _make(mesh, name, how)
            if how == "blocked":
                self.blocked[name] = "they cannot be computed from the positions"
            elif header.n_frames < _least_frames.get(name, 1):
                self.blocked[name] = f"{header.n_frames} frames are too few to compute them"
            else:
                self._attributes[name] = attribute
                if name not in _least_frames:
                    self._normals[name] = Normals(polygons, how)
            if name in self.blocked:
                attribute.Block()
        self._has_motion = any(name in self._attributes for name in _least_frames)

    def append(self, frame: Frame, times: Sequence[float], number: int) -> int:
        """Sets what the next frame tells, of itself or of others.

        Args:
            frame: its positions and mask.
            times: of all frames.
            number: of this frame.

        Returns:
            How many bytes that was.
        """
        if not self._attributes:
            return 0
        points = frame.points
        if frame.known is not None:
            points = np.where(frame.known[:, None], points, np.float32(np.nan))
        values: Iterator[tuple[str, int, NDArray[np.float32]]] = (
            (name, number, normals.of(points)) for name, normals in self._normals.items()
        )
        if self._has_motion:
            values = chain(values, self._motions.push(points))
        n_bytes = 0
        for name, of_frame, array in values:
            if name in self._attributes:
                self._attributes[name].Set(library_array("Vec3fArray", array), times[of_frame])
                n_bytes += array.nbytes
        return n_bytes


def _make(mesh: Any, name: str, how: str) -> Any:
    """The attribute, without values yet."""
    interpolation = "vertex" if how == "blocked" else how.split()[-1]
    if name == "primvars:normals":
        kind = pxr("Sdf").ValueTypeNames.Normal3fArray
        primvar = pxr("UsdGeom").PrimvarsAPI(mesh).CreatePrimvar("normals", kind, interpolation)
        primvar.BlockIndices()  # those of a weaker layer would be taken for ours
        return primvar.GetAttr()
    if name == "normals":
        attribute = mesh.CreateNormalsAttr()
        mesh.SetNormalsInterpolation(interpolation)
        return attribute
    return mesh.CreateVelocitiesAttr() if name == "velocities" else mesh.CreateAccelerationsAttr()
