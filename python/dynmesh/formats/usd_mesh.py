"""What a mesh of a USD stage says: its faces, primvars, placement, and values at times."""

import contextlib
import math
from collections.abc import Iterable, Iterator, Sequence
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._errors import InputError, of_library, require
from .._report import some_of
from ..header import ATTRIBUTES, with_all_needed
from ..polygons import Polygons, reversal, turned
from .format import OTHER_MESHES, check_same_faces
from .times import Timing, frame_number, spacing


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
            raise InputError("the mesh has no faces")
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


_NUMBERS = {
    f"{kind}[]"
    for kind in ("bool", "uchar", "int", "uint", "int64", "uint64", "half", "float", "double")
}
"""Types of values that a known mask may have; floats are confidences."""


def primvars_of(mesh: Any, known: str | None = None) -> dict[str, Any]:
    """Returns the attributes of the primvars that exist; generation and age only together.

    The known mask may have another name, which must exist.
    """
    api, sdf = pxr("UsdGeom").PrimvarsAPI(mesh), pxr("Sdf")
    result = {
        name: api.GetPrimvar(known if name == "known" and known else name) for name in primvars
    }
    result = {name: primvar for name, primvar in result.items() if primvar.HasAuthoredValue()}
    result = {name: result[name] for name in with_all_needed(result)}
    if known and "known" not in result:
        there = [one.GetPrimvarName() for one in api.GetPrimvarsWithAuthoredValues()]
        reason = f"{mesh.GetPath()} has no primvar {known!r}, only {some_of(there) or 'none'}"
        raise InputError(reason, argument="known", value=f"primvars:{known}")
    for name, primvar in result.items():
        kind, interpolation = primvar.GetTypeName(), primvar.GetInterpolation()
        wanted = getattr(sdf.ValueTypeNames, primvars[name])
        is_right = kind == wanted or (name == "known" and str(kind) in _NUMBERS)
        if not is_right or interpolation not in ("vertex", "varying") or primvar.IsIndexed():
            raise InputError(
                f"{primvar.GetName()}: must be {wanted} with vertex interpolation and without "
                f"indices, not {kind} with {interpolation} interpolation"
            )
    return {name: primvar.GetAttr() for name, primvar in result.items()}


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


def moved_by(mesh: Any) -> tuple[str, ...]:
    """What moves a mesh beside the samples of its points, in words."""
    prim = mesh.GetPrim()
    prims = [prim.GetStage().GetPrimAtPath(path) for path in mesh.GetPath().GetPrefixes()]
    result = {
        "a skeleton": any(one.HasRelationship("skel:skeleton") for one in prims),
        "blend shapes": prim.HasAttribute("skel:blendShapes"),
        "transforms": is_moving(mesh),
    }
    return tuple(name for name, there in result.items() if there)


def is_moving(mesh: Any) -> bool:
    """Whether transforms of the mesh, or above it, change with time.

    Exporters write a sample for every frame, also where nothing moves.
    """
    geometry, stage = pxr("UsdGeom"), mesh.GetPrim().GetStage()
    prims = map(stage.GetPrimAtPath, mesh.GetPath().GetPrefixes())
    every = [geometry.Xformable(one) for one in prims if one.IsA(geometry.Xformable)]
    times = {time for one in every for time in one.GetTimeSamples()}
    first, *others = placements(mesh, sorted(times) or [0.0])
    least = _STILL * np.abs(first).max()
    return any(np.abs(other - first).max() > least for other in others)


_STILL = 1e-6
"""How much transforms may differ that stand still, as programs round them."""


def placements(mesh: Any, times: Iterable[float]) -> Iterator[NDArray[np.float64]]:
    """Yields the (4, 4) matrix that takes rows (x, y, z, 1) to the scene at each time."""
    cache = pxr("UsdGeom").XformCache()
    for time in times:
        cache.SetTime(time)
        yield np.array(cache.GetLocalToWorldTransform(mesh.GetPrim()))


def hidden_times(mesh: Any, times: Sequence[float]) -> frozenset[float]:
    """Returns those of these times at which the mesh is invisible; none if it always is."""
    geometry, stage = pxr("UsdGeom"), mesh.GetPrim().GetStage()
    prims = map(stage.GetPrimAtPath, mesh.GetPath().GetPrefixes())
    every = [
        geometry.Imageable(one).GetVisibilityAttr() for one in prims if one.IsA(geometry.Imageable)
    ]
    if not any(one.ValueMightBeTimeVarying() for one in every):
        return frozenset()
    image = geometry.Imageable(mesh)
    hidden = {time for time in times if image.ComputeVisibility(time) == "invisible"}
    return frozenset() if len(hidden) == len(times) else frozenset(hidden)


def frame_times(points: Any) -> list[float]:
    """Returns the times of the samples and of gaps between equal ones; 0 if there is no sample."""
    samples = np.array(points.GetTimeSamples())
    if len(samples) < 2:
        return [*samples, 0.0][:1]
    gaps = np.diff(samples)
    steps = np.rint(gaps / gaps.min())
    even = np.allclose(gaps, steps * gaps.min(), rtol=1e-6, atol=0)
    if even and all(_held(points, *samples[i : i + 2]) for i in np.flatnonzero(steps > 1)):
        samples = np.linspace(samples[0], samples[-1], int(steps.sum()) + 1)
    return [float(time) for time in samples]


def axis_and_unit(stage: Any) -> tuple[str | None, float | None]:
    """Returns the up axis and the metres per unit, as far as the stage states them."""
    axis, metres = (
        stage.GetMetadata(name) if stage.HasAuthoredMetadata(name) else None
        for name in ("upAxis", "metersPerUnit")
    )
    return axis and axis.lower(), metres


def timing(stage: Any, times: Sequence[float]) -> Timing:
    """Returns the frames per second, if the stage states them, and the numbers of the frames.

    If the stage states its rate and frames are n time codes apart, the first number is the first
    time code divided by n, so that a stage written from it, with one time code per frame, starts at
    the same second. Otherwise the numbers are time codes.
    """
    metadata = any(map(stage.HasAuthoredMetadata, ("timeCodesPerSecond", "framesPerSecond")))
    rate = float(stage.GetTimeCodesPerSecond()) if metadata else None
    step = 1.0 if len(times) == 1 else spacing(times)
    if step is None or (rate is None and step != 1):
        return Timing(rate, times[0], np.array(times))
    # Over its original, a sample must have exactly the time of the original one.
    start = frame_number(times[0], 1 / step, tolerance=1e-15)
    return Timing(None if rate is None else rate / step, start)


def value_at(attribute: Any, time: float, shape: tuple[int, ...]) -> NDArray[Any] | str:
    """Returns the value of a sample, of equal ones before and after, or the only value.

    Before all samples, and after them, it is the nearest one, as in USD. If there is no value, or
    it is blocked or empty, it returns that in words.
    """
    times, name = attribute.GetBracketingTimeSamples(time) or (time,), attribute.GetName()
    nearest = min(times, key=lambda sample: abs(sample - time))
    is_nearest = len(set(times)) == 1 or math.isclose(nearest, time, abs_tol=1e-9)
    if not (is_nearest or _held(attribute, *times)):
        return f"{name} has no sample"
    value = attribute.Get(nearest)
    if value is None or (len(value) == 0 < shape[0]):
        return f"{name} is {'blocked' if value is None else 'empty'}"
    array = np.array(value)
    if array.shape != shape:
        raise InputError(
            f"time {time:g}: {name} has {len(array)} values, "
            f"but the mesh has {shape[0]} vertices in its first frame; {OTHER_MESHES}"
        )
    return array


def _held(attribute: Any, before: float, after: float) -> bool:
    first, second = (attribute.Get(time) for time in (before, after))
    if first is None or second is None:
        return first is second
    are_equal = np.array_equal(np.asarray(first), np.asarray(second), equal_nan=True)
    return before < after and are_equal
