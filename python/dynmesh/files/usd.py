"""USD: the points of one mesh in a stage, with a time sample for each frame.

Of the scene, only what the mesh itself says is read: its points, in its own space, and its faces.
Transforms, skeletons, materials and everything else stay where they are. What is written has the
mesh at the same path, so that it can be laid over the stage it came from, as a stronger sublayer:
points, extent, faces and subdivision are then those written here, the rest is the stage's.

The known mask is the primvar `known` (bool), `generation` and `age` (int) are primvars too, each
with a value per vertex.
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
from ..polygons import Polygons, as_polygons, split_polygons
from .interface import Format, Frame, Header, Reader, Template, Writer, refuse_template
from .scenes import check_same_faces, choose_mesh, spacing

primvars = {"known": "BoolArray", "generation": "IntArray", "age": "IntArray"}
"""What a vertex has beside its position, and the type of all vertices' values."""

_numbers = itertools.count()


class UsdReader(Reader):
    """The frames of a mesh: the time samples of its points, or else their only value.

    Exporters leave out samples where nothing moves: where the points before and after a gap are
    equal, the frames in between are there too. If the frames are evenly spaced then, `fps` follows
    from the stage's time codes per second; if not, or if the stage does not say them, it is None.
    """

    def __init__(self, path: Path, template: Template | None, prim: str | None) -> None:
        """Composes the stage and reads everything but the frames."""
        refuse_template(template)
        path.open("rb").close()  # the system says best what it does not allow
        with _translating(ValueError, "is damaged or no USD file: "):
            self._stage = _composed(path)
        with _translating(ValueError, "is damaged: "):
            self._mesh = _mesh(self._stage, prim)
            super().__init__(path, self._header())

    def _header(self) -> Header:
        stage = self._stage
        self._points = self._mesh.GetPointsAttr()
        self._times = _frame_times(self._points)
        first = self._points.Get(self._times[0])
        if first is None:
            raise ValueError("the mesh has no points")
        faces, polygons = split_polygons(_faces(self._mesh))
        up_axis = stage.GetMetadata("upAxis") if stage.HasAuthoredMetadata("upAxis") else None
        self._primvars = _primvars(self._mesh)
        return Header(
            faces=faces,
            n_frames=len(self._times),
            n_vertices=len(first),
            dtype=np.dtype(np.float32),
            fps=_fps(stage, self._times),
            polygons=polygons,
            up_axis=up_axis.lower() if up_axis else None,
            name=str(self._mesh.GetPath()),
            has_known="known" in self._primvars,
            has_provenance="age" in self._primvars,
        )

    def _frames(self, numbers: range) -> Iterator[Frame]:
        for number in numbers:
            time = self._times[number]
            with _translating(ValueError, f"time {time:g}: is damaged: "):
                points = _value(self._points, time, (self.n_vertices, 3))
                values = {
                    name: _value(attribute, time, (self.n_vertices,))
                    for name, attribute in self._primvars.items()
                }
            yield Frame(points, **values)

    def close(self) -> None:
        """Lets go of the stage."""
        self._stage = self._mesh = self._points = None
        self._primvars = {}


def _composed(path: Path) -> Any:
    sdf = _pxr("Sdf")
    # A layer is opened once in a process and is then the same for all, even if the file has been
    # replaced since. An argument that no other reader has makes it a layer of its own.
    layer = sdf.Layer.FindOrOpen(str(path.absolute()), {"reader": str(next(_numbers))})
    if layer is None:
        raise ValueError("is damaged or no USD file")
    return _pxr("Usd").Stage.Open(layer)


def _mesh(stage: Any, prim: str | None) -> Any:
    usd, geometry = _pxr("Usd"), _pxr("UsdGeom")
    prims = usd.PrimRange.Stage(stage, usd.TraverseInstanceProxies())
    meshes = {str(p.GetPath()): geometry.Mesh(p) for p in prims if p.IsA(geometry.Mesh)}
    missing = stage.GetCompositionErrors()
    if meshes:
        moving = {path: m.GetPointsAttr().ValueMightBeTimeVarying() for path, m in meshes.items()}
        mesh = meshes[choose_mesh(moving, prim)]
        missing = [error for error in missing if mesh.GetPath().HasPrefix(error.rootSite.path)]
    if missing:
        raise ValueError(f"is not all there: {_one_line(str(missing[0]))}")
    return mesh


def _frame_times(points: Any) -> list[float]:
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


def _fps(stage: Any, times: Sequence[float]) -> float | None:
    if not any(map(stage.HasAuthoredMetadata, ("timeCodesPerSecond", "framesPerSecond"))):
        return None
    step = 1.0 if len(times) == 1 else spacing(times)
    return None if step is None else float(stage.GetTimeCodesPerSecond()) / step


def _faces(mesh: Any) -> Polygons:
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


def _primvars(mesh: Any) -> dict[str, Any]:
    """The attributes of the primvars that are there, generation and age both or neither."""
    geometry, sdf = _pxr("UsdGeom"), _pxr("Sdf")
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


def _value(attribute: Any, time: float, shape: tuple[int, ...]) -> NDArray[Any]:
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


class UsdWriter(Writer):
    """A stage with one mesh, in the making; positions are rounded to float32.

    The frames are the time codes 0, 1, 2 and so on, `fps` of them a second. They go into a binary
    layer a few at a time, which does not need more memory the more there are; a `.usda` is made
    from it in the end. A save writes over the layer's table of contents, so that a layer whose
    saving was cut short is lost, and the writer cannot go on with it.
    """

    unsaved_bytes = 1 << 24
    """How many bytes of positions wait in memory until the next save, at most one frame more."""

    def _begin(self, kept: int) -> None:  # noqa: ARG002 (never goes on)
        sdf, usd, geometry = _pxr("Sdf"), _pxr("Usd"), _pxr("UsdGeom")
        self._path = self.folder / "frames.usdc"
        header = self.header
        faces = as_polygons(header.faces, header.polygons)
        self._unsaved = 0
        with _translating(OSError):
            self._stage = usd.Stage.Open(sdf.Layer.CreateNew(str(self._path.absolute())))
            if header.fps is not None:
                self._stage.SetTimeCodesPerSecond(header.fps)
                self._stage.SetFramesPerSecond(header.fps)
            if header.up_axis is not None:
                geometry.SetStageUpAxis(self._stage, header.up_axis.upper())
            self._stage.SetStartTimeCode(0)
            self._stage.SetEndTimeCode(header.n_frames - 1)
            # The prims above become a `def` without a type: where this is laid over another stage,
            # its types show through; an `over` would leave the mesh undefined without that stage.
            mesh = geometry.Mesh.Define(self._stage, _prim_path(header.name))
            self._stage.SetDefaultPrim(self._stage.GetPrimAtPath(mesh.GetPath().GetPrefixes()[0]))
            mesh.CreateSubdivisionSchemeAttr("none")
            mesh.CreateFaceVertexCountsAttr(_vt("IntArray", faces.sizes, np.int32))
            mesh.CreateFaceVertexIndicesAttr(_vt("IntArray", faces.corners, np.int32))
            self._points, self._extent = mesh.CreatePointsAttr(), mesh.CreateExtentAttr()
            names = ["known"] * header.has_known + ["generation", "age"] * header.has_provenance
            api = geometry.PrimvarsAPI(mesh)
            self._primvars = {
                name: api.CreatePrimvar(name, getattr(sdf.ValueTypeNames, primvars[name]), "vertex")
                for name in names
            }

    def _append(self, frame: Frame) -> None:
        points = frame.points.astype(np.float32)
        finite = points[np.isfinite(points).all(axis=1)]
        with _translating(OSError):
            self._points.Set(_vt("Vec3fArray", points, np.float32), self._frame)
            if len(finite):
                extent = np.stack([finite.min(axis=0), finite.max(axis=0)])
                self._extent.Set(_vt("Vec3fArray", extent, np.float32), self._frame)
            for name, primvar in self._primvars.items():
                kind, dtype = primvars[name], np.bool_ if name == "known" else np.int32
                primvar.Set(_vt(kind, getattr(frame, name), dtype), self._frame)
            self._unsaved += points.nbytes
            if self._unsaved > self.unsaved_bytes:
                self._save()

    def _save(self) -> None:
        self._stage.GetRootLayer().Save()
        self._unsaved = 0

    def _finish(self) -> None:
        target = self.folder / self.path.name
        with _translating(OSError):
            self._save()
            if self.path.suffix.lower() == ".usda":
                text = self._path.with_suffix(".usda")
                self._stage.GetRootLayer().Export(str(text.absolute()))
                self._path.unlink()
                self._path = text
        self._close()
        self._path.replace(target)

    def _close(self) -> None:
        self._stage = self._points = self._extent = None
        self._primvars = {}


def _prim_path(name: str | None) -> str:
    """The path that the name says, with underscores for what USD does not allow in names."""
    sdf, tf = _pxr("Sdf"), _pxr("Tf")
    parts = [part for part in (name or "mesh").split("/") if part] or ["mesh"]
    valid = sdf.Path.IsValidIdentifier
    return "".join(f"/{part if valid(part) else tf.MakeValidIdentifier(part)}" for part in parts)


def _vt(kind: str, array: NDArray[Any], dtype: Any) -> Any:
    """The library's own kind of array."""
    vt = _pxr("Vt")
    return getattr(vt, kind).FromNumpy(np.ascontiguousarray(array, dtype))


def _pxr(name: str) -> ModuleType:
    return require(f"pxr.{name}", extra="usd")


@contextlib.contextmanager
def _translating(kind: type[Exception], what: str = "") -> Iterator[None]:
    """Raises the library's errors as others of that kind, and keeps it from printing."""
    tf, utils = _pxr("Tf"), _pxr("UsdUtils")
    delegate = utils.CoalescingDiagnosticDelegate()  # takes what would be printed while it lives
    try:
        yield
    except tf.ErrorException as error:
        raise kind(what + _one_line(error.args[0].commentary)) from error
    finally:
        del delegate


def _one_line(text: str) -> str:
    return " ".join(text.split())


usd = Format("usd", (".usd", ".usdc", ".usda"), "a mesh in a USD stage", UsdReader, UsdWriter)
usdz = Format("usdz", (".usdz",), "a mesh in a packed USD stage", UsdReader, None)
