"""Normals, velocities and accelerations in a USD stage: which exist, and how to replace them.

A stage over its original hides only the attributes that it has itself. Therefore it recomputes
every attribute that followed from the points of the original, or blocks it.
"""

from collections.abc import Iterator, Sequence
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..frames.frame import Frame
from ..frames.header import Header
from ..polygons import Polygons
from ..sequence import Positions
from .derivatives import Motions, Normals, layout_of
from .usd_stage import library_array, pxr

_least_frames = {"velocities": 2, "accelerations": 3}


def derived_of(
    mesh: Any, polygons: Polygons, points: Positions, time: float
) -> dict[str, str] | None:
    """Returns :attr:`Header.derived` of the mesh, judged by its first frame; None if empty."""
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
            values = values[indices[there]]  # if some are out of range, too few remain
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
    """The derived attributes that a header requires, written to a stage.

    Attributes:
        blocked: by name, why an attribute has no values but hides those of another layer.
    """

    def __init__(
        self, mesh: Any, header: Header, polygons: Polygons, seconds: NDArray[np.float64]
    ) -> None:
        """Creates the attributes of the mesh, whose frames have these times."""
        self.blocked: dict[str, str] = {}
        self._motions = Motions(seconds)
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
        """Sets the values that are available after a frame, for this frame or others.

        Takes the times of all frames and the number of this one; returns the bytes of the values.
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
    """Creates the attribute without values."""
    interpolation = "vertex" if how == "blocked" else how.split()[-1]
    if name == "primvars:normals":
        kind = pxr("Sdf").ValueTypeNames.Normal3fArray
        primvar = pxr("UsdGeom").PrimvarsAPI(mesh).CreatePrimvar("normals", kind, interpolation)
        primvar.BlockIndices()  # otherwise the indices of a weaker layer would apply
        return primvar.GetAttr()
    if name == "normals":
        attribute = mesh.CreateNormalsAttr()
        mesh.SetNormalsInterpolation(interpolation)
        return attribute
    return mesh.CreateVelocitiesAttr() if name == "velocities" else mesh.CreateAccelerationsAttr()
