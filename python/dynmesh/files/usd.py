"""USD: the points of one mesh in a stage, with a time sample for each frame.

Of the scene, only the mesh itself is read: its points, in its own space, and its faces.
Transforms, skeletons, materials and everything else are ignored. A written stage has the mesh at
the same path and times, so that it can be used as a stronger sublayer over the original stage. It
then overrides points, extent and faces, and also normals, velocities and accelerations, which are
recomputed if the original has them; everything else comes from the original.

The known mask is the primvar `known` (bool); `generation` and `age` (int) are primvars as well,
each with one value per vertex.
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

    Exporters omit samples where nothing moves: if the points before and after a gap are equal, the
    frames in between are included. If the frames are then evenly spaced, `fps` follows from the
    time codes per second of the stage; otherwise, `times` are time codes and `fps` is the number of
    time codes per second. If the stage does not state it, it is None.
    """

    def __init__(self, path: Path, template: Template | None, prim: str | None) -> None:
        """Composes the stage and reads everything except the frames."""
        refuse_template(template)
        path.open("rb").close()  # gives the error message of the system
        with translating(ValueError, "is damaged or not a USD file: "):
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
        """Releases the stage."""
        self._stage = self._mesh = self._points = None
        self._primvars = {}


class UsdWriter(Writer):
    """A stage with one mesh that is being written; positions are rounded to float32.

    There is a frame at every time code from `start`, or at each of `times`, with `fps` time codes
    per second. They are saved to a binary layer a few at a time, so memory does not grow with their
    number; a `.usda` is converted from it in the end. Saving overwrites the table of contents of
    the layer, so a layer whose saving was interrupted is lost, and the writer cannot be continued.

    A mesh without a name is a polygon mesh. One with a name comes from a scene, where it may be
    subdivided, so the subdivision scheme is not written.
    """

    keeps_float64 = False
    unsaved_bytes = 1 << 24
    """Bytes of positions that are held in memory until the next save, plus at most one frame."""

    def _begin(self, kept: int) -> None:  # noqa: ARG002 (always 0, as it is not resumable)
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
            # The prims above become a `def` without a type: over another stage, its types remain
            # visible; an `over` would leave the mesh undefined without that stage.
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
                f"{name} are blocked, so that those of another layer are hidden: {why}"
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
    """Returns the path for the name, with underscores for characters that USD does not allow."""
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
