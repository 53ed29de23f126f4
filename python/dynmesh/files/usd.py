"""USD: the points of one mesh in a stage, with a time sample for each frame.

Of the scene, only what the mesh itself says is read: its points, in its own space, and its faces.
Transforms, skeletons, materials and everything else stay where they are. What is written has the
mesh at the same path and times, so that it can be laid over the stage it came from, as a stronger
sublayer. Points, extent and faces are then those written here, and so are normals, velocities and
accelerations, computed anew, where the stage has them; the rest is the stage's.

The known mask is the primvar `known` (bool), `generation` and `age` (int) are primvars too, each
with a value per vertex.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..polygons import as_polygons, split_polygons
from .format import Format, Template, refuse_template
from .header import Frame, Header
from .reader import Reader
from .times import frame_numbers
from .usd_derived import DerivedAttributes, derived_of
from .usd_stage import (
    composed,
    faces_of,
    files_of,
    frame_times,
    library_array,
    mesh_in,
    primvars,
    primvars_of,
    pxr,
    timing,
    translating,
    value_at,
)
from .writer import Writer


class UsdReader(Reader):
    """The frames of a mesh: the time samples of its points, or else their only value.

    Exporters leave out samples where nothing moves: where the points before and after a gap are
    equal, the frames in between are there too. If the frames are evenly spaced then, `fps` follows
    from the stage's time codes per second; if not, `times` are time codes and `fps` says how many
    of them are a second. If the stage does not say that, it is None.
    """

    def __init__(self, path: Path, template: Template | None, prim: str | None) -> None:
        """Composes the stage and reads everything but the frames."""
        refuse_template(template)
        path.open("rb").close()  # the system says best what it does not allow
        with translating(ValueError, "is damaged or no USD file: "):
            self._stage = composed(path)
        with translating(ValueError, "is damaged: "):
            self._mesh = mesh_in(self._stage, prim)
            super().__init__(path, self._header())

    def _header(self) -> Header:
        stage = self._stage
        self._points = self._mesh.GetPointsAttr()
        self._times = frame_times(self._points)
        first = self._points.Get(self._times[0])
        if first is None:
            raise ValueError("the mesh has no points")
        faces, polygons = split_polygons(faces_of(self._mesh))
        up_axis, metres_per_unit = (
            stage.GetMetadata(name) if stage.HasAuthoredMetadata(name) else None
            for name in ("upAxis", "metersPerUnit")
        )
        self._primvars = primvars_of(self._mesh)
        header = Header(
            faces=faces,
            n_frames=len(self._times),
            n_vertices=len(first),
            dtype=np.dtype(np.float32),
            polygons=polygons,
            up_axis=up_axis.lower() if up_axis else None,
            name=str(self._mesh.GetPath()),
            metres_per_unit=metres_per_unit,
            **timing(stage, self._times)._asdict(),
            has_known="known" in self._primvars,
            has_provenance="age" in self._primvars,
        )
        derived = derived_of(
            self._mesh, as_polygons(faces, polygons), np.array(first), self._times[0]
        )
        return replace(header, derived=derived)

    @property
    def files(self) -> list[Path]:
        """The files that are read: those of all layers that the stage is composed of."""
        return files_of(self._stage) or [self.path]

    def _frames(self, numbers: range) -> Iterator[Frame]:
        for number in numbers:
            time = self._times[number]
            with translating(ValueError, f"time {time:g}: is damaged: "):
                points = value_at(self._points, time, (self.n_vertices, 3))
                values = {
                    name: value_at(attribute, time, (self.n_vertices,))
                    for name, attribute in self._primvars.items()
                }
            yield Frame(points, **values)

    def close(self) -> None:
        """Lets go of the stage."""
        self._stage = self._mesh = self._points = None
        self._primvars = {}


class UsdWriter(Writer):
    """A stage with one mesh, in the making; positions are rounded to float32.

    There is a frame at every time code from `start` on, or at each of `times`, `fps` time codes a
    second. They go into a binary layer a few at a time, which does not need more memory the more
    there are; a `.usda` is made from it in the end. A save writes over the layer's table of
    contents, so that a layer whose saving was cut short is lost, and the writer cannot go on with
    it.

    A mesh without a name is a mesh of polygons. One that has a name comes from a scene, where it
    may be subdivided: so nothing is said of that.
    """

    keeps_float64 = False
    unsaved_bytes = 1 << 24
    """How many bytes of positions wait in memory until the next save, at most one frame more."""

    def _begin(self, kept: int) -> None:  # noqa: ARG002 (never goes on)
        sdf, usd, geometry = pxr("Sdf"), pxr("Usd"), pxr("UsdGeom")
        self._path = self.folder / "frames.usdc"
        header = self.header
        faces = as_polygons(header.faces, header.polygons)
        self._times = frame_numbers(header).tolist()
        self._unsaved = 0
        with translating(OSError):
            self._stage = usd.Stage.Open(sdf.Layer.CreateNew(str(self._path.absolute())))
            if header.fps is not None:
                self._stage.SetTimeCodesPerSecond(header.fps)
                self._stage.SetFramesPerSecond(header.fps)
            if header.up_axis is not None:
                geometry.SetStageUpAxis(self._stage, header.up_axis.upper())
            if header.metres_per_unit is not None:
                geometry.SetStageMetersPerUnit(self._stage, header.metres_per_unit)
            self._stage.SetStartTimeCode(self._times[0])
            self._stage.SetEndTimeCode(self._times[-1])
            # The prims above become a `def` without a type: where this is laid over another stage,
            # its types show through; an `over` would leave the mesh undefined without that stage.
            mesh = geometry.Mesh.Define(self._stage, _prim_path(header.name))
            self._stage.SetDefaultPrim(self._stage.GetPrimAtPath(mesh.GetPath().GetPrefixes()[0]))
            if header.name is None:
                mesh.CreateSubdivisionSchemeAttr("none")
            mesh.CreateFaceVertexCountsAttr(library_array("IntArray", faces.sizes))
            mesh.CreateFaceVertexIndicesAttr(library_array("IntArray", faces.corners))
            self._points, self._extent = mesh.CreatePointsAttr(), mesh.CreateExtentAttr()
            names = ["known"] * header.has_known + ["generation", "age"] * header.has_provenance
            api = geometry.PrimvarsAPI(mesh)
            self._primvars = {
                name: api.CreatePrimvar(name, getattr(sdf.ValueTypeNames, primvars[name]), "vertex")
                for name in names
            }
            self._derived: Any = DerivedAttributes(self._stage, mesh, header, faces)
        for name, why in self._derived.blocked.items():
            self.remarks.append(
                f"{name} are blocked, so that none of another layer show through: {why}"
            )

    def _append(self, frame: Frame) -> None:
        points, time = frame.points, self._times[self._frame]
        finite = points[np.isfinite(points).all(axis=1)]
        with translating(OSError):
            self._points.Set(library_array("Vec3fArray", points), time)
            if len(finite):
                extent = np.stack([finite.min(axis=0), finite.max(axis=0)])
                self._extent.Set(library_array("Vec3fArray", extent), time)
            for name, primvar in self._primvars.items():
                values = library_array(primvars[name], getattr(frame, name))
                primvar.Set(values, time)
            self._unsaved += points.nbytes + self._derived.append(frame, self._times, self._frame)
            if self._unsaved > self.unsaved_bytes:
                self._save()

    def _save(self) -> None:
        if not self._stage.GetRootLayer().Save():
            raise OSError("cannot be saved")
        self._unsaved = 0

    def _finish(self) -> None:
        target = self.folder / self.path.name
        with translating(OSError):
            self._save()
            if self.path.suffix.lower() == ".usda":
                text = self._path.with_suffix(".usda")
                if not self._stage.GetRootLayer().Export(str(text.absolute())):
                    raise OSError("cannot be saved as text")
                self._path.unlink()
                self._path = text
        self._close()
        self._path.replace(target)

    def _close(self) -> None:
        self._stage = self._points = self._extent = self._derived = None
        self._primvars = {}


def _prim_path(name: str | None) -> str:
    """The path that the name says, with underscores for what USD does not allow in names."""
    sdf, tf = pxr("Sdf"), pxr("Tf")
    parts = [part for part in (name or "mesh").split("/") if part] or ["mesh"]
    valid = sdf.Path.IsValidIdentifier
    return "".join(f"/{part if valid(part) else tf.MakeValidIdentifier(part)}" for part in parts)


usd = Format(
    "usd",
    (".usd", ".usdc", ".usda"),
    "a mesh in a USD stage",
    UsdReader,
    UsdWriter,
    frozenset({"prim"}),
    library=("pxr.Usd", "usd"),
)
usdz = Format(
    "usdz", (".usdz",), "a mesh in a packed USD stage", UsdReader, None, frozenset({"prim"})
)
