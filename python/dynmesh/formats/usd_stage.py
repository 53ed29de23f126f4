"""Reads a mesh of a USD stage, or several as one, and what surrounds it."""

import itertools
from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .._errors import InputError
from ..frame import Frame, Indices
from ..header import ATTRIBUTES, TEXTURE, Header, Origin
from ..polygons import Polygons, as_polygons, split_polygons
from ..stored import FileFrames, Stored
from .format import Gaps, choose_mesh, not_read, of_points
from .usd_mesh import (
    axis_and_unit,
    errors_of_key,
    faces_of,
    frame_times,
    hidden_times,
    is_moving,
    moved_by,
    of_usd,
    placements,
    primvars,
    primvars_of,
    pxr,
    texture_in,
    texture_of,
    timing,
    value_at,
)

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

_KNOWN = {"", "GeomSubset", "Material", "Mesh", "NodeGraph", "Scope", "Shader", "Xform"}
"""The types of prims that are no other objects, such as cameras, but are called otherwise."""

TRIED = "cannot be read as USD"
"""What errors of the library say was tried."""

_numbers = itertools.count()


class UsdScene:
    """A stage with everything that it refers to.

    The copies that USD makes of a mesh by reference (instances) count as meshes.

    Attributes:
        path: of the file.
        stage: the composed stage.
        meshes: by their paths.
        moves: the paths of the meshes, and whether the points of each change.
    """

    def __init__(self, path: Path) -> None:
        path.open("rb").close()  # gives the error message of the system
        usd, geometry = pxr("Usd"), pxr("UsdGeom")
        with of_usd(TRIED):
            # In a process, all users of a path share one layer, even if the file has been replaced
            # since it was opened. A file format argument that is unique to this reader makes it a
            # separate layer.
            unique = {"reader": str(next(_numbers))}
            layer = pxr("Sdf").Layer.FindOrOpen(str(path.absolute()), unique)
            if layer is None:
                raise InputError("is damaged or not a USD file")
            self.stage = usd.Stage.Open(layer)
        with of_usd(TRIED):
            prims = usd.PrimRange.Stage(self.stage, usd.TraverseInstanceProxies())
            self.meshes = {
                str(p.GetPath()): geometry.Mesh(p) for p in prims if p.IsA(geometry.Mesh)
            }
            self.moves: dict[str, bool] = {
                name: mesh.GetPointsAttr().ValueMightBeTimeVarying()
                for name, mesh in self.meshes.items()
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
        if self.meshes or not errors:
            mesh = self.meshes[choose_mesh(self.moves, prim)]
            errors = [error for error in errors if mesh.GetPath().HasPrefix(error.rootSite.path)]
        if errors:
            raise InputError(f"is incomplete: {' '.join(str(errors[0]).split())}")
        return mesh

    def has_points(self, name: str) -> bool:
        """Whether a mesh has any."""
        points = self.meshes[name].GetPointsAttr()
        return any(points.Get(time) for time in points.GetTimeSamples()) or bool(points.Get())

    def has_primvar(self, name: str, primvar: str) -> bool:
        """Whether a mesh that may be there has a primvar."""
        api = pxr("UsdGeom").PrimvarsAPI
        return name in self.meshes and api(self.meshes[name]).GetPrimvar(primvar).HasAuthoredValue()

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
        others = (one for one in self.stage.Traverse() if one.GetPath() not in paths)
        if {str(one.GetTypeName()) for one in others} - _KNOWN:
            held.add("other objects")
        return held


class UsdFrames(FileFrames):
    """The frames of a mesh: the time samples of its points, or else their only value.

    Exporters omit samples where nothing moves: if the points before and after a gap are equal, the
    frames in between are included. If the frames are then evenly spaced, `fps` follows from the
    time codes per second of the stage; otherwise, `times` are time codes and `fps` is the number of
    time codes per second. If the stage does not state it, it is None.
    """

    def __init__(
        self,
        scene: UsdScene,
        prim: str | None,
        gaps: Gaps = "refuse",
        primvar: str | None = None,
    ) -> None:
        self._scene: UsdScene | None = scene  # whose prims expire with it
        with of_usd(TRIED):
            self.mesh = scene.mesh(prim)
            self._points = self.mesh.GetPointsAttr()
            self.time_codes = frame_times(self._points)
            self._primvars = primvars_of(self.mesh, primvar)
            self._hidden = hidden_times(self.mesh, self.time_codes)
            header, origin = self._described(scene)
            super().__init__(scene.path, header, scene.files, origin=origin)
            if gaps == "lost":
                each = enumerate(map(self._frame_at, self.time_codes))
                self.lost = frozenset(number for number, frame in each if isinstance(frame, str))

    def _described(self, scene: UsdScene) -> tuple[Header, Origin | None]:
        stage = scene.stage
        first = next(filter(None, map(self._points.Get, self.time_codes)), None)
        if first is None:
            raise InputError("the mesh has no points")
        faces, polygons = split_polygons(faces_of(self.mesh))
        times = self.time_codes if is_moving(self.mesh) else self.time_codes[:1]
        to_scene = (matrix[:3, :3] for matrix in placements(self.mesh, times))
        up_axis, metres_per_unit, unknown = of_points(*axis_and_unit(stage), to_scene)
        name, k = str(self.mesh.GetPath()), len(first)
        bars = self._primvars.get("standard_error")
        errors = None if bars is None else bars.GetCustomDataByKey(errors_of_key)
        scheme = self.mesh.GetSubdivisionSchemeAttr()
        header = Header(
            faces=faces,
            n_frames=len(self.time_codes),
            n_vertices=k,
            dtype=np.dtype(np.float32),
            polygons=polygons,
            up_axis=up_axis,
            name=name,
            metres_per_unit=metres_per_unit,
            **timing(stage, self.time_codes)._asdict(),
            attributes=self._primvars,
            standard_error_of="position" if errors is None else errors,
        )
        return header, Origin.of(
            scene.path,
            header,
            scene.held_beside(self.mesh),
            name=name,
            remarks=not_read(moved_by(self.mesh), unknown),
            subdivision=scheme.Get() if scheme.HasAuthoredValue() else None,
            texture=texture_of(self.mesh, as_polygons(faces, polygons), k),
            is_scene=True,
        )

    def _frames(self, numbers: Indices) -> Iterator[Frame]:
        for number in numbers:
            time = self.time_codes[number]
            frame: Frame | str = self._lost_frame()
            if number not in self.lost:
                with of_usd(f"time {time:g}: {TRIED}"):
                    frame = self._frame_at(time)
            if isinstance(frame, str):
                advice = "with `gaps` lost, nothing was observed in such frames of"
                raise InputError(f"time {time:g}: {frame}; {advice} {self.mesh.GetPath()}")
            yield frame

    def _frame_at(self, time: float) -> Frame | str:
        """The frame at a time; why nothing was observed in it, if so."""
        if time in self._hidden:
            return "the mesh is invisible"
        points = value_at(self._points, time, (self.n_vertices, 3))
        each = self._primvars.items()
        values = {name: value_at(one, time, (self.n_vertices,)) for name, one in each}
        lost = [value for value in (points, *values.values()) if isinstance(value, str)]
        return lost[0] if lost else Frame(points, **values)  # type: ignore[arg-type]

    def _close(self) -> None:
        self._scene = self.mesh = self._points = None
        self._primvars = {}


def open_usd(
    path: Path, prim: str | Iterable[str] | None, gaps: Gaps = "refuse", primvar: str | None = None
) -> Stored:
    """Opens a mesh of a stage; or several, or "all" of them that have points, as one."""
    scene = UsdScene(path)
    names = [prim] if isinstance(prim, str) else [*dict.fromkeys(prim or ())]
    if names == ["all"]:
        names = [name for name in scene.moves if scene.has_points(name)]
    if len(names) > 1:
        return UsdMeshes(scene, names, gaps, primvar)
    return UsdFrames(scene, names[0] if names else None, gaps, primvar)


class UsdMeshes(FileFrames):
    """The frames of several meshes together.

    There is a frame wherever one of those that move has one; the others are there as they were in
    the last frame of their own. All have masks, without which positions that are not finite are
    missing.
    """

    def __init__(
        self, scene: UsdScene, names: Iterable[str], gaps: Gaps, primvar: str | None
    ) -> None:
        masked = [name for name in names if primvar and scene.has_primvar(name, primvar)]
        own = {
            name: UsdFrames(scene, name, gaps, primvar if name in masked or not masked else None)
            for name in names
        }
        self.each: Mapping[str, Stored] = dict(own)
        self._meshes = [one.mesh for one in own.values()]
        self._own_times = [np.array(one.time_codes) for one in own.values()]
        moving = [times for times in self._own_times if len(times) > 1] or self._own_times
        self._times: list[float] = np.unique(np.round(np.concatenate(moving), 9)).tolist()
        super().__init__(scene.path, self._header(scene.stage), scene.files)

    def _header(self, stage: Any) -> Header:
        headers = [one.header for one in self.each.values()]
        firsts = np.cumsum([0, *(one.n_vertices for one in headers)])
        every = [as_polygons(one.faces, one.polygons) for one in headers]
        corners = [one.corners + first for one, first in zip(every, firsts, strict=False)]
        sizes = np.concatenate([one.sizes for one in every])
        faces, polygons = split_polygons(Polygons(sizes, np.concatenate(corners)))
        up_axis, metres_per_unit = axis_and_unit(stage)
        return Header(
            faces=faces,
            n_frames=len(self._times),
            n_vertices=int(firsts[-1]),
            dtype=np.dtype(np.float32),
            polygons=polygons,
            up_axis=up_axis,
            metres_per_unit=metres_per_unit,
            **timing(stage, self._times)._asdict(),
            attributes={"known"}.union(*(one.attributes for one in headers)),
        )

    @property
    def remarks(self) -> tuple[str, ...]:
        """What moves the meshes beside their points and the transforms of the stage."""
        return tuple(
            f"{name}: {told}"
            for name, mesh in zip(self.each, self._meshes, strict=True)
            for told in not_read([one for one in moved_by(mesh) if one != "transforms"], "")
        )

    def _frames(self, numbers: Indices) -> Iterator[Frame]:
        return (self.placed(number, {}, self.header.attributes) for number in numbers)

    def placed(self, number: int, given: Mapping[str, Frame], attributes: Collection[str]) -> Frame:
        """A frame of all meshes, with these attributes; some are given, in their own space."""
        time, rows = self._times[number], list[dict[str, Any]]()
        for name, mesh, own in zip(self.each, self._meshes, self._own_times, strict=True):
            index = max(0, int(np.searchsorted(own, time + 1e-9, side="right")) - 1)
            frame = given.get(name) or next(self.each[name].frames(index, index + 1))
            with of_usd(f"time {time:g}: {TRIED}"):
                (matrix,) = placements(mesh, [time])
            with np.errstate(invalid="ignore", over="ignore"):  # missing ones may be anywhere
                points = frame.points.astype(np.float64) @ matrix[:3, :3] + matrix[3, :3]
                points = points.astype(np.float32)
            rows.append({"known": frame.present, **frame.attributes(), "points": points})

        def joined(name: str) -> Any:
            nothing = ((len(row["points"]), ATTRIBUTES[name].dtype) for row in rows)
            return np.concatenate(
                [row.get(name, np.zeros(*none)) for row, none in zip(rows, nothing, strict=True)]
            )

        points = np.concatenate([row["points"] for row in rows])
        return Frame(points, **{name: joined(name) for name in attributes})

    def _close(self) -> None:
        self._meshes = []
        for one in self.each.values():
            one.close()
