"""One mesh in a USD stage: where it is, what it says at which time.

Everything of the library that reading and writing share is here.
"""

import contextlib
import itertools
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._extras import require
from ..polygons import Polygons
from .scenes import check_same_faces, choose_mesh
from .times import Timing, frame_number, spacing

primvars = {"known": "BoolArray", "generation": "IntArray", "age": "IntArray"}
"""What a vertex has beside its position, and the type of all vertices' values."""

dtypes = {"Vec3fArray": np.float32, "BoolArray": np.bool_, "IntArray": np.int32}
"""What the library's arrays hold."""

_numbers = itertools.count()


def composed(path: Path) -> Any:
    """The stage of this file, and of all that it refers to."""
    sdf = pxr("Sdf")
    # A layer is opened once in a process and is then the same for all, even if the file has been
    # replaced since. An argument that no other reader has makes it a layer of its own.
    layer = sdf.Layer.FindOrOpen(str(path.absolute()), {"reader": str(next(_numbers))})
    if layer is None:
        raise ValueError("is damaged or no USD file")
    return pxr("Usd").Stage.Open(layer)


def files_of(stage: Any) -> list[Path]:
    """The files of all layers of the stage; a packed stage is one file."""
    ar = pxr("Ar")
    paths = [layer.realPath for layer in stage.GetUsedLayers() if layer.realPath]
    outer = (ar.SplitPackageRelativePathOuter(path)[0] for path in paths)
    return [Path(path) for path in dict.fromkeys(outer)]


def mesh_in(stage: Any, prim: str | None) -> Any:
    """The mesh at this path, or as :func:`choose_mesh`; with everything that makes it up."""
    usd, geometry = pxr("Usd"), pxr("UsdGeom")
    prims = usd.PrimRange.Stage(stage, usd.TraverseInstanceProxies())
    meshes = {str(p.GetPath()): geometry.Mesh(p) for p in prims if p.IsA(geometry.Mesh)}
    errors = stage.GetCompositionErrors()
    if meshes or not errors:
        moving = {path: m.GetPointsAttr().ValueMightBeTimeVarying() for path, m in meshes.items()}
        mesh = meshes[choose_mesh(moving, prim)]
        errors = [error for error in errors if mesh.GetPath().HasPrefix(error.rootSite.path)]
    if errors:
        raise ValueError(f"is not all there: {_one_line(str(errors[0]))}")
    return mesh


def frame_times(points: Any) -> list[float]:
    """The times of the samples, and those between equal ones; 0 where there is no sample."""
    samples = np.array(points.GetTimeSamples())
    if len(samples) < 2:
        return [*samples, 0.0][:1]
    gaps = np.diff(samples)
    steps = np.rint(gaps / gaps.min())
    even = np.allclose(gaps, steps * gaps.min(), rtol=1e-6, atol=0)
    if even and all(_held(points, *samples[i : i + 2]) for i in np.flatnonzero(steps > 1)):
        samples = np.linspace(samples[0], samples[-1], int(steps.sum()) + 1)
    return [float(time) for time in samples]


def timing(stage: Any, times: Sequence[float]) -> Timing:
    """Frames per second, if the stage says them, and the numbers of the frames.

    Where the stage says its rate and frames are n time codes apart, the first number is an n-th of
    the first time code: so what is written from it, with a time code per frame, begins in the same
    second. Where they are not evenly spaced, or nobody knows the rate, the numbers are time codes.
    """
    said = any(map(stage.HasAuthoredMetadata, ("timeCodesPerSecond", "framesPerSecond")))
    rate = float(stage.GetTimeCodesPerSecond()) if said else None
    step = 1.0 if len(times) == 1 else spacing(times)
    if step is None or (rate is None and step != 1):
        return Timing(rate, times[0], np.array(times))
    # Laid over its original, a sample is where the first one was, to the last digits of it.
    start = frame_number(times[0], 1 / step, tolerance=1e-15)
    return Timing(None if rate is None else rate / step, start)


def faces_of(mesh: Any) -> Polygons:
    """The faces, which must be the same at all times."""
    attributes = (mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr())
    times = {time for attribute in attributes for time in attribute.GetTimeSamples()}
    first, *later = sorted(times) or [0.0]
    faces = _faces_at(attributes, first)
    for time in later:
        check_same_faces(faces, _faces_at(attributes, time), time)
    return faces


def _faces_at(attributes: tuple[Any, Any], time: float) -> Polygons:
    counts, indices = (attribute.Get(time) for attribute in attributes)
    if counts is None or indices is None:
        raise ValueError("the mesh has no faces")
    return Polygons(np.array(counts, np.int32), np.array(indices, np.int32))


def primvars_of(mesh: Any) -> dict[str, Any]:
    """The attributes of the primvars that are there, generation and age both or neither."""
    geometry, sdf = pxr("UsdGeom"), pxr("Sdf")
    found = {name: geometry.PrimvarsAPI(mesh).GetPrimvar(name) for name in primvars}
    found = {name: primvar for name, primvar in found.items() if primvar.HasAuthoredValue()}
    if not ("generation" in found and "age" in found):
        found = {name: primvar for name, primvar in found.items() if name == "known"}
    for name, primvar in found.items():
        kind = getattr(sdf.ValueTypeNames, primvars[name])
        interpolation = primvar.GetInterpolation()
        if (primvar.GetTypeName(), interpolation) != (kind, "vertex") or primvar.IsIndexed():
            raise ValueError(
                f"primvars:{name}: must be {kind} with vertex interpolation and without indices, "
                f"not {primvar.GetTypeName()} with {interpolation} interpolation"
            )
    return {name: primvar.GetAttr() for name, primvar in found.items()}


def value_at(attribute: Any, time: float, shape: tuple[int, ...]) -> NDArray[Any]:
    """The value of a sample, or of equal ones before and after, or else the only value there is."""
    times = attribute.GetBracketingTimeSamples(time) or (time,)
    nearest = min(times, key=lambda sample: abs(sample - time))
    if not math.isclose(nearest, time, abs_tol=1e-9) and not _held(attribute, *times):
        raise ValueError(f"time {time:g}: {attribute.GetName()} has no sample")
    value = attribute.Get(nearest)
    array = np.array([] if value is None else value)
    if array.shape != shape:
        raise ValueError(
            f"time {time:g}: {attribute.GetName()} has {len(array)} values, "
            f"but the mesh has {shape[0]} vertices in its first frame"
        )
    return array


def _held(attribute: Any, before: float, after: float) -> bool:
    """Whether nothing changes between two samples."""
    one, other = (np.asarray(attribute.Get(time)) for time in (before, after))
    return before < after and np.array_equal(one, other, equal_nan=True)


def library_array(kind: str, array: NDArray[Any]) -> Any:
    """A copy as an array of the library's own."""
    return getattr(pxr("Vt"), kind).FromNumpy(np.ascontiguousarray(array, dtypes[kind]))


def pxr(name: str) -> ModuleType:
    """A module of the library."""
    return require(f"pxr.{name}", extra="usd")


@contextlib.contextmanager
def translating(kind: type[Exception], what: str = "") -> Iterator[None]:
    """Raises the library's errors as others of that kind, and keeps it from printing."""
    tf, utils = pxr("Tf"), pxr("UsdUtils")
    delegate = utils.CoalescingDiagnosticDelegate()  # takes what would be printed while it lives
    try:
        yield
    except tf.ErrorException as error:
        raise kind(what + _one_line(error.args[0].commentary)) from error
    finally:
        del delegate


def _one_line(text: str) -> str:
    return " ".join(text.split())
