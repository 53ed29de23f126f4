"""USD: the points of one mesh in a stage, with a time sample for each frame.

Of the scene, only the mesh itself is read: its points, in its own space, and its faces; several
meshes are read as one, in the space of the scene. Skeletons, materials, transforms of a single mesh
and everything else are ignored. A written stage has the mesh, its points, faces and texture
coordinates alone, at the same path and times. An overlay changes the points, extents and velocities
of meshes in the original stage, blocks what else followed from the former ones, and leaves the rest
as it is.

The known mask is the primvar `known` (bool); `generation` and `age` (int) are primvars as well,
each with one value per vertex.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats
from .._errors import InputError, naming
from .._report import listed, some_of
from ..frame import Frame, Frames
from ..header import TEXTURE, Header
from ..polygons import as_polygons
from .format import STATED, Format, extent_of, not_written
from .output import destination_of, refuse_inputs, seen_from
from .usd_mesh import errors_of_key, library_array, of_usd, primvars, pxr
from .usd_stage import UsdFrames, UsdScene, open_usd

unsaved_bytes = 1 << 24
"""Bytes of positions that are held in memory until the next save, plus at most one frame."""


class _Stage:
    """A stage with a mesh that is being written; positions are rounded to float32.

    There is a frame at every time code from `start`, or at each of `times`, with `fps` time codes
    per second. They are saved to a binary layer a few at a time, so memory does not grow with their
    number; a `.usda` is converted from it in the end.
    Saving overwrites the table of contents of the layer, so a layer whose saving was interrupted is
    lost, and writing cannot be continued.

    A mesh without a name is a polygon mesh. One with a name comes from a scene, where it may be
    subdivided, so only the subdivision scheme that a stage states for it is written.
    """

    def __init__(self, path: Path, *meshes: Frames) -> None:
        self.path, self._meshes = path, meshes
        self.header, self._frames = meshes[0].header, meshes[0]
        self._path = path.with_name("frames.usdc")
        self._unsaved = 0
        self._layer: Any = None
        self._stage: Any = None

    def write(self) -> None:
        """Writes the frames."""
        try:
            with of_usd("cannot be written", OSError):
                self._layer = pxr("Sdf").Layer.CreateNew(str(self._path.absolute()))
                self._stage = pxr("Usd").Stage.Open(self._layer)
                self._describe_stage()
            for frames in self._meshes:
                self.header, self._frames = frames.header, frames
                self._begin()
                for number, frame in enumerate(frames):
                    self._append(number, frame)
            self._finish()
        finally:
            self._close()
        self._path.replace(self.path)

    def _begin(self) -> None:
        sdf, geometry, header = pxr("Sdf"), pxr("UsdGeom"), self.header
        with of_usd("cannot be written", OSError):
            self._times = self._time_codes(self._stage.GetTimeCodesPerSecond()).tolist()
            mesh = self._make_mesh()
            self._points, self._extent = mesh.CreatePointsAttr(), mesh.CreateExtentAttr()
            api = geometry.PrimvarsAPI(mesh)
            self._primvars = {
                name: api.CreatePrimvar(name, getattr(sdf.ValueTypeNames, primvars[name]), "vertex")
                for name in header.attributes
            }
            if header.has_standard_error:  # always, since those of layers below would be visible
                attribute = self._primvars["standard_error"].GetAttr()
                attribute.SetCustomDataByKey(errors_of_key, header.standard_error_of)

    def _describe_stage(self) -> None:
        """Writes what is said of the stage, not of a mesh."""
        header, geometry = self.header, pxr("UsdGeom")
        if header.fps is not None:
            self._stage.SetTimeCodesPerSecond(header.fps)
            self._stage.SetFramesPerSecond(header.fps)
        if header.up_axis == "x":
            raise InputError("USD has y or z up, not x; a conversion can turn the points")
        if header.up_axis is not None:
            geometry.SetStageUpAxis(self._stage, header.up_axis.upper())
        if header.metres_per_unit is not None:
            geometry.SetStageMetersPerUnit(self._stage, header.metres_per_unit)

    def _time_codes(self, rate: float) -> NDArray[np.float64]:
        """Returns (n,) the time of each frame, in a stage with that many codes per second."""
        numbers = self.header.numbers
        fps = self.header.fps
        return numbers if fps in (None, rate) else numbers * (rate / fps)

    def _make_mesh(self) -> Any:
        """Creates the mesh without its points, and the range of the stage."""
        header, geometry, stage = self.header, pxr("UsdGeom"), self._stage
        # The prims above become a `def` without a type: over another stage, its types remain
        # visible; an `over` would leave the mesh undefined without that stage.
        mesh = geometry.Mesh.Define(stage, _prim_path(header.name))
        stage.SetDefaultPrim(stage.GetPrimAtPath(mesh.GetPath().GetPrefixes()[0]))
        stage.SetStartTimeCode(self._times[0])
        stage.SetEndTimeCode(self._times[-1])
        origin = self._frames.own_origin
        scheme = "none" if header.name is None else origin and origin.subdivision
        if scheme is not None:
            mesh.CreateSubdivisionSchemeAttr(scheme)
        faces = as_polygons(header.faces, header.polygons)
        mesh.CreateFaceVertexCountsAttr(library_array("IntArray", faces.sizes))
        mesh.CreateFaceVertexIndicesAttr(library_array("IntArray", faces.corners))
        if (texture := self._frames.texture) is not None:
            kind = pxr("Sdf").ValueTypeNames.TexCoord2fArray
            primvar = geometry.PrimvarsAPI(mesh).CreatePrimvar("st", kind, "faceVarying")
            primvar.Set(library_array("Vec2fArray", texture))
        return mesh

    def _append(self, number: int, frame: Frame) -> None:
        points, time = frame.points, self._times[number]
        with of_usd("cannot be written", OSError):
            self._points.Set(library_array("Vec3fArray", points), time)
            self._extent.Set(library_array("Vec3fArray", extent_of(frame)), time)
            for name, primvar in self._primvars.items():
                values = library_array(primvars[name], getattr(frame, name))
                primvar.Set(values, time)
            self._unsaved += points.nbytes
            if self._unsaved > unsaved_bytes:
                self._save()

    def _save(self) -> None:
        if not self._layer.Save():
            raise OSError("cannot be saved")
        self._unsaved = 0

    def _finish(self) -> None:
        with of_usd("cannot be written", OSError):
            self._release_stage()
            self._complete_layer()
            self._save()
            if self.path.suffix.lower() == ".usda":
                text = self._path.with_suffix(".usda")
                if not self._layer.Export(str(text.absolute())):
                    raise OSError("cannot be saved as text")
                self._path.unlink()
                self._path = text

    def _complete_layer(self) -> None:
        """Changes the layer after everything else was written to it."""

    def _release_stage(self) -> None:
        self._stage = self._points = self._extent = None
        self._primvars = {}

    def _close(self) -> None:
        self._release_stage()
        self._layer = None


def _prim_path(name: str | None) -> str:
    """Returns the path for the name, with underscores for characters that USD does not allow."""
    sdf, tf = pxr("Sdf"), pxr("Tf")
    parts = [part for part in (name or "mesh").split("/") if part] or ["mesh"]
    valid = sdf.Path.IsValidIdentifier
    return "".join(f"/{part if valid(part) else tf.MakeValidIdentifier(part)}" for part in parts)


_of_layers = ("subLayers", "subLayerOffsets", "primChildren", "comment", "documentation")
"""What a layer says of itself, not of the stage of which it is the root."""

_derived = ("normals", "primvars:normals", "accelerations")
"""The attributes of a mesh that follow from its points, and are not written."""


class _Overlay(_Stage):
    """A layer that is being written, with the scene of which its meshes are as its sublayer.

    It only has opinions on these meshes: their points, extents and velocities, and what no longer
    fits, which it blocks. Velocities follow from the points before and after each frame.
    Everything else is that of the stage, whose time codes, units and default prim are repeated, as
    USD takes them from the root layer alone. The sublayer is named relative to the layer, so that
    both files can be moved together.
    """

    def __init__(self, path: Path, scene: UsdScene, meshes: Mapping[str, Frames]) -> None:
        super().__init__(path, *meshes.values())
        self._scene, self._names = scene, iter(meshes)
        self._instances, self._blocked = dict[str, None](), dict[str, None]()
        self._velocities: Any = None  # the attribute, if the mesh has one
        self._recent: list[tuple[float, Floats]] = []  # the last points, at most three

    @property
    def remarks(self) -> list[str]:
        """What the user should know of the layer."""
        results = []
        if self._instances:
            results.append(f"no longer instances: {some_of([*self._instances])}")
        if self._blocked:
            results.append(
                f"{some_of([*self._blocked])} of {self._scene.path.name} are blocked, since they "
                "no longer fit the points, and are not computed anew"
            )
        return results

    def _describe_stage(self) -> None:
        original = self._scene.stage.GetRootLayer().pseudoRoot
        for name in original.ListInfoKeys():
            if name not in _of_layers:
                self._layer.pseudoRoot.SetInfo(name, original.GetInfo(name))

    def _time_codes(self, rate: float) -> NDArray[np.float64]:
        """Returns the times of the samples themselves, which the conversion may round."""
        codes = super()._time_codes(rate)
        samples = np.array(self._original.GetPointsAttr().GetTimeSamples())
        if len(samples) == 0:
            return codes
        after = np.searchsorted(samples, codes).clip(1, max(1, len(samples) - 1)) % len(samples)
        before = samples[after - 1]
        nearest = np.where(codes - before < samples[after] - codes, before, samples[after])
        return np.where(np.isclose(codes, nearest, rtol=1e-9, atol=1e-9), nearest, codes)

    def _begin(self) -> None:
        self._original = self._scene.meshes[next(self._names)]
        super()._begin()
        velocities = self._original.GetVelocitiesAttr()
        self._velocities, self._recent = None, []
        if velocities.HasAuthoredValue():
            self._velocities = self._stage.OverridePrim(self._original.GetPath()).CreateAttribute(
                "velocities", velocities.GetTypeName(), custom=False
            )

    def _append(self, number: int, frame: Frame) -> None:
        super()._append(number, frame)
        if self._velocities is None:
            return
        self._unsaved += frame.points.nbytes
        points = frame.points.astype(np.float64)
        self._recent = [*self._recent[-2:], (self._times[number], points)]
        if number:
            self._set_velocity(number - 1, self._recent)
        if number == self.header.n_frames - 1:
            self._set_velocity(number, self._recent[-2:])

    def _set_velocity(self, number: int, between: list[tuple[float, Floats]]) -> None:
        """Sets that of a frame, in units per second: the mean between the first and the last."""
        (begin, first), (end, last) = between[0], between[-1]
        per_second = self._scene.stage.GetTimeCodesPerSecond() / ((end - begin) or 1)
        velocity = np.nan_to_num(per_second * (last - first), posinf=0, neginf=0)
        with of_usd("cannot be written", OSError):
            self._velocities.Set(library_array("Vec3fArray", velocity), self._times[number])

    def _make_mesh(self) -> Any:
        stage, path = self._stage, self._original.GetPath()
        for prim in map(self._scene.stage.GetPrimAtPath, path.GetPrefixes()):
            if prim.IsInstanceable():  # otherwise nothing below it can be changed
                stage.OverridePrim(prim.GetPath()).SetInstanceable(False)
                self._instances[str(prim.GetPath())] = None
            self._block(prim, "extentsHint")
        original = self._original.GetPrim()
        self._blocked |= dict.fromkeys(self._block(original, *_derived))
        stale = [name for name in primvars if name not in self.header.attributes]
        self._block(original, *(f"primvars:{name}" for name in stale))
        return pxr("UsdGeom").Mesh(stage.OverridePrim(path))

    def _block(self, prim: Any, *names: str) -> list[str]:
        """Hides the values of attributes of the stage; returns the names of those that have one."""
        results = [one for one in map(prim.GetAttribute, names) if one and one.HasAuthoredValue()]
        for one in results:
            over = self._stage.OverridePrim(prim.GetPath())
            over.CreateAttribute(one.GetName(), one.GetTypeName(), custom=False).Block()
        return [one.GetName() for one in results]

    def _complete_layer(self) -> None:
        self._layer.subLayerPaths.append(
            seen_from(destination_of(self.path).parent, self._scene.path)
        )


def write_usd(path: Path, header: Header, frames: Frames) -> list[str]:
    """Writes a stage with a mesh alone."""
    texture = () if frames.texture is None else (TEXTURE,)
    _Stage(path, frames).write()
    remarks = not_written(frames, texture)
    name, written = header.name or "", _prim_path(header.name)
    if name and written.strip("/") != name.strip("/"):
        remarks.append(f"has its mesh at {written}, as USD does not allow the name {name}")
    return remarks


def write_overlay(path: Path, header: Header, frames: Frames) -> list[str]:
    """Writes a layer over the scene of the origin, or the mesh alone if its frames are others."""
    meshes = frames.each or {"": frames}
    origins = [one.origin for one in meshes.values()]
    assert origins[0] is not None
    path_of_scene = origins[0].path
    if not path_of_scene.exists():  # of frames in memory
        reason = "is no longer there"
    else:
        with naming(path_of_scene):
            scene = UsdScene(path_of_scene)
            refuse_inputs(filter(Path.exists, [destination_of(path)]), scene.files)
            others, named = dict[str, None](), dict[str, Frames]()
            for frames_of_mesh, origin in zip(meshes.values(), origins, strict=True):
                assert origin is not None
                original = UsdFrames(scene, origin.name)
                others |= dict.fromkeys(_differences(original.header, frames_of_mesh.header))
                others |= dict.fromkeys(origin.changed)
                named[str(original.mesh.GetPath())] = frames_of_mesh
            if not others:
                layer = _Overlay(path, scene, named)
                layer.write()
                return layer.remarks
        reason = f"has another {listed(others)}"
    what = "the meshes as one" if frames.each else "the mesh alone"
    remark = f"is {what}, as {path_of_scene.name} {reason}"
    return [remark, *write_usd(path, header, frames)]


def _differences(one: Header, other: Header) -> list[str]:
    """What a layer with frames would have to change in the whole scene, in words."""
    has_mesh = one.n_vertices == other.n_vertices and np.array_equal(one.faces, other.faces)
    differ = {
        "mesh": not has_mesh,
        "path of the mesh": one.name != other.name,
        "range of frames": not np.array_equal(one.numbers, other.numbers),
        "frame rate": not _are_close(one.fps, other.fps),
        "up axis": one.up_axis != other.up_axis,
        "unit of length": not _are_close(one.metres_per_unit, other.metres_per_unit),
    }
    return [name for name, is_other in differ.items() if is_other]


def _are_close(one: float | None, other: float | None) -> bool:
    return one == other or math.isclose(one or 0, other or 0, rel_tol=1e-6)


usd = Format(
    "usd",
    (".usd", ".usdc", ".usda"),
    open_usd,
    write_usd,
    frozenset({"known", "provenance", "texture", *STATED}),
    frozenset({"prim", "gaps", "primvar"}),
    library=("pxr.Usd", "usd"),
    meshes=lambda path: UsdScene(path).moves,
    overlay=write_overlay,
)
usdz = replace(usd, name="usdz", suffixes=(".usdz",), write=None, overlay=None)
