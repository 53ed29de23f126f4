"""Reads one mesh of a USD stage, its values at a time, and what surrounds it."""

import contextlib
import itertools
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._errors import InputError, of_library
from .._extras import require
from ..attributes import ATTRIBUTES, flags_of, with_all_needed
from ..frames import FileFrames, Frame, Indices
from ..header import TEXTURE, Header, MeshFile
from ..polygons import Polygons, as_polygons, reversal, split_polygons, turned
from .format import check_same_faces, choose_mesh
from .usd_samples import frame_times, timing, value_at

_TYPES = {"b": "BoolArray", "i": "IntArray", "f": "FloatArray"}

primvars = {name: _TYPES[row.dtype.kind] for name, row in ATTRIBUTES.items()}
"""The data of a vertex besides its position, and the type of the values of all vertices."""

errors_of_key = "standard_error_of"
"""Of the custom data of the primvar `standard_error`."""


def faces_of(mesh: Any) -> Polygons:
    """Returns the faces, counter-clockwise, which must be the same at all times."""
    attributes = (mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr())

    def faces_at(time: float) -> Polygons:
        values = [attribute.Get(time) for attribute in attributes]
        if any(value is None for value in values):
            raise ValueError("the mesh has no faces")
        return Polygons(*(np.array(value, np.int32) for value in values))

    times = {time for attribute in attributes for time in attribute.GetTimeSamples()}
    first, *later = sorted(times) or [0.0]
    faces = faces_at(first)
    for time in later:
        check_same_faces(faces, faces_at(time), f"time {time:g}")
    return turned(faces) if is_left_handed(mesh) else faces


def is_left_handed(mesh: Any) -> bool:
    """Whether the faces of a mesh are stored clockwise."""
    return bool(mesh.GetOrientationAttr().Get() == "leftHanded")


def primvars_of(mesh: Any) -> dict[str, Any]:
    """Returns the attributes of the primvars that exist; generation and age only together."""
    geometry, sdf = pxr("UsdGeom"), pxr("Sdf")
    result = {name: geometry.PrimvarsAPI(mesh).GetPrimvar(name) for name in primvars}
    result = {name: primvar for name, primvar in result.items() if primvar.HasAuthoredValue()}
    result = {name: result[name] for name in with_all_needed(result)}
    for name, primvar in result.items():
        kind = getattr(sdf.ValueTypeNames, primvars[name])
        interpolation = primvar.GetInterpolation()
        if (primvar.GetTypeName(), interpolation) != (kind, "vertex") or primvar.IsIndexed():
            raise ValueError(
                f"primvars:{name}: must be {kind} with vertex interpolation and without indices, "
                f"not {primvar.GetTypeName()} with {interpolation} interpolation"
            )
    return {name: primvar.GetAttr() for name, primvar in result.items()}


_READ = {
    *("points", "faceVertexCounts", "faceVertexIndices", "subdivisionScheme", "extent"),
    "orientation",
    *(f"primvars:{name}" for name in primvars),
}
"""The properties of a mesh that are read."""

_WORDS = {
    "material:binding": "materials",
    "primvars:displayColor": "colours",
    "primvars:normals": "normals",
    "xformOpOrder": "transforms",
}
"""What messages call properties of a mesh that are not read."""


def texture_in(mesh: Any) -> Any:
    """Returns the primvar of texture coordinates, of several the one called `st`, else the first.

    None if there are none that are the same at all times, for each corner or vertex.
    """
    results = [
        one
        for one in pxr("UsdGeom").PrimvarsAPI(mesh).GetPrimvarsWithAuthoredValues()
        if one.GetTypeName().role == "TextureCoordinate" or one.GetPrimvarName() == "st"
        if one.GetInterpolation() in ("faceVarying", "vertex", "varying")
        if not one.ValueMightBeTimeVarying()
    ]
    return min(results, key=lambda one: one.GetPrimvarName() != "st", default=None)


def texture_of(mesh: Any, faces: Polygons, n_vertices: int) -> NDArray[np.float32] | None:
    """Returns (c, 2) the texture coordinates of each corner of faces as :func:`faces_of` has them.

    None if there are none that fit.
    """
    primvar = texture_in(mesh)
    if primvar is None:
        return None
    of_corners = primvar.GetInterpolation() == "faceVarying"
    values = np.array(primvar.ComputeFlattened(pxr("Usd").TimeCode.EarliestTime()), np.float32)
    if values.shape != (len(faces.corners) if of_corners else n_vertices, 2):
        return None
    if of_corners:
        return np.asarray(values[reversal(faces.sizes)] if is_left_handed(mesh) else values)
    return np.asarray(values[faces.corners])


def library_array(kind: str, array: NDArray[Any]) -> Any:
    """Returns a copy as an array of the library, of integers, bools or else float32."""
    dtype = {"BoolArray": np.bool_, "IntArray": np.int32}.get(kind, np.float32)
    return getattr(pxr("Vt"), kind).FromNumpy(np.ascontiguousarray(array, dtype))


def pxr(name: str) -> ModuleType:
    """Imports a module of the library."""
    return require(f"pxr.{name}", extra="usd")


@contextlib.contextmanager
def of_usd(tried: str, kind: type[Exception] = InputError) -> Iterator[None]:
    """Raises the library's errors as :func:`of_library` does, and keeps it from printing."""
    delegate = pxr("UsdUtils").CoalescingDiagnosticDelegate()  # suppresses printing while it exists
    try:
        with of_library(tried, kind):
            yield
    finally:
        del delegate


_TRIED = "cannot be read as USD"

_numbers = itertools.count()


class UsdScene:
    """A stage with everything that it refers to.

    The copies that USD makes of a mesh by reference (instances) count as meshes.

    Attributes:
        path: of the file.
        stage: the composed stage.
        moves: the paths of the meshes, and whether the points of each change.
    """

    def __init__(self, path: Path) -> None:
        """Composes the stage."""
        path.open("rb").close()  # gives the error message of the system
        usd, geometry = pxr("Usd"), pxr("UsdGeom")
        with of_usd(_TRIED):
            # In a process, all users of a path share one layer, even if the file has been replaced
            # since it was opened. A file format argument that is unique to this reader makes it a
            # separate layer.
            unique = {"reader": str(next(_numbers))}
            layer = pxr("Sdf").Layer.FindOrOpen(str(path.absolute()), unique)
            if layer is None:
                raise InputError("is damaged or not a USD file")
            self.stage = usd.Stage.Open(layer)
        with of_usd(_TRIED):
            prims = usd.PrimRange.Stage(self.stage, usd.TraverseInstanceProxies())
            self._meshes = {
                str(p.GetPath()): geometry.Mesh(p) for p in prims if p.IsA(geometry.Mesh)
            }
            self.moves: dict[str, bool] = {
                name: mesh.GetPointsAttr().ValueMightBeTimeVarying()
                for name, mesh in self._meshes.items()
            }
        self.path = path

    @property
    def files(self) -> list[Path]:
        """The files of all layers that the stage is composed of; a packed stage is one file."""
        split = pxr("Ar").SplitPackageRelativePathOuter
        layers = (layer.realPath for layer in self.stage.GetUsedLayers())
        outer = (split(path)[0] for path in layers if path)
        return [Path(path) for path in dict.fromkeys(outer)] or [self.path]

    def mesh(self, prim: str | None) -> Any:
        """Returns the mesh at this path, or see :func:`choose_mesh`; refuses incomplete stages."""
        errors = self.stage.GetCompositionErrors()
        if self._meshes or not errors:
            mesh = self._meshes[choose_mesh(self.moves, prim)]
            errors = [error for error in errors if mesh.GetPath().HasPrefix(error.rootSite.path)]
        if errors:
            raise ValueError(f"is incomplete: {' '.join(str(errors[0]).split())}")
        return mesh

    def held_beside(self, mesh: Any) -> set[str]:
        """What the stage holds around a mesh that is not read, in words."""
        prim, paths = mesh.GetPrim(), mesh.GetPath().GetPrefixes()
        texture = texture_in(mesh)
        words = _WORDS if texture is None else _WORDS | {texture.GetName(): TEXTURE}
        held = {
            words.get(name, name.removeprefix("primvars:"))
            for name in {one.GetName() for one in prim.GetAuthoredProperties()} - _READ
            if not name.startswith("xformOp:") and not name.endswith(":indices")
        }
        above = [pxr("UsdGeom").Xformable(self.stage.GetPrimAtPath(path)) for path in paths]
        if any(one and one.GetXformOpOrderAttr().HasAuthoredValue() for one in above):
            held.add(_WORDS["xformOpOrder"])
        if pxr("UsdShade").MaterialBindingAPI(prim).ComputeBoundMaterial()[0]:
            held.add(_WORDS["material:binding"])
        if pxr("UsdGeom").Subset.GetAllGeomSubsets(mesh):
            held.add("subsets")
        if len(self.moves) > 1:
            held.add("other meshes")
        return held


def moved_by(mesh: Any) -> tuple[str, ...]:
    """What moves a mesh beside the samples of its points, in words."""
    prim, geometry = mesh.GetPrim(), pxr("UsdGeom")
    prims = [prim.GetStage().GetPrimAtPath(path) for path in mesh.GetPath().GetPrefixes()]
    result = {
        "a skeleton": any(one.HasRelationship("skel:skeleton") for one in prims),
        "blend shapes": prim.HasAttribute("skel:blendShapes"),
        "transforms": any(
            geometry.Xformable(one).TransformMightBeTimeVarying()
            for one in prims
            if one.IsA(geometry.Xformable)
        ),
    }
    return tuple(name for name, there in result.items() if there)


class UsdFrames(FileFrames):
    """The frames of a mesh: the time samples of its points, or else their only value.

    Exporters omit samples where nothing moves: if the points before and after a gap are equal, the
    frames in between are included. If the frames are then evenly spaced, `fps` follows from the
    time codes per second of the stage; otherwise, `times` are time codes and `fps` is the number of
    time codes per second. If the stage does not state it, it is None.
    """

    def __init__(self, path: Path, prim: str | None) -> None:
        """Composes the stage and reads everything except the frames."""
        self.scene: UsdScene | None = UsdScene(path)
        with of_usd(_TRIED):
            self.mesh = self.scene.mesh(prim)
            super().__init__(path, self._header(path, self.scene), self.scene.files)

    def _header(self, path: Path, scene: UsdScene) -> Header:
        stage = scene.stage
        self._points = self.mesh.GetPointsAttr()
        self._times = frame_times(self._points)
        first = self._points.Get(self._times[0])
        if first is None:
            raise ValueError("the mesh has no points")
        faces, polygons = split_polygons(faces_of(self.mesh))
        up_axis, metres_per_unit = (
            stage.GetMetadata(name) if stage.HasAuthoredMetadata(name) else None
            for name in ("upAxis", "metersPerUnit")
        )
        self._primvars = primvars_of(self.mesh)
        bars = self._primvars.get("standard_error")
        errors = None if bars is None else bars.GetCustomDataByKey(errors_of_key)
        scheme = self.mesh.GetSubdivisionSchemeAttr()
        return Header(
            faces=faces,
            n_frames=len(self._times),
            n_vertices=len(first),
            dtype=np.dtype(np.float32),
            polygons=polygons,
            up_axis=up_axis.lower() if up_axis else None,
            name=str(self.mesh.GetPath()),
            metres_per_unit=metres_per_unit,
            **timing(stage, self._times)._asdict(),
            **flags_of(self._primvars),
            standard_error_of="position" if errors is None else errors,
            mesh_file=MeshFile.of(path, scene.held_beside(self.mesh)),
            moved_by=moved_by(self.mesh),
            subdivision=scheme.Get() if scheme.HasAuthoredValue() else None,
            texture=texture_of(self.mesh, as_polygons(faces, polygons), len(first)),
        )

    def _frames(self, numbers: Indices) -> Iterator[Frame]:
        for number in numbers:
            time = self._times[number]
            with of_usd(f"time {time:g}: {_TRIED}"):
                points = value_at(self._points, time, (self.n_vertices, 3))
                values = {
                    name: value_at(attribute, time, (self.n_vertices,))
                    for name, attribute in self._primvars.items()
                }
            yield Frame(points, **values)

    def _close(self) -> None:
        """Releases the stage."""
        self.scene = self.mesh = self._points = None
        self._primvars = {}
