"""USD: the points of one mesh in a stage, with a time sample for each frame.

Of the scene, only the mesh itself is read: its points, in its own space, and its faces.
Transforms, skeletons, materials and everything else are ignored. A written stage has the mesh, its
points and faces alone, at the same path and times. An overlay changes the points in the original
stage, blocks what followed from the former ones, and leaves everything else as it is.

The known mask is the primvar `known` (bool); `generation` and `age` (int) are primvars as well,
each with one value per vertex.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..attributes import flags_of
from ..polygons import split_polygons
from .format import Format
from .frame import Frame
from .header import Header, MeshFile
from .reader import Reader
from .usd_stage import (
    UsdScene,
    errors_of_key,
    faces_of,
    frame_times,
    primvars_of,
    timing,
    translating,
    value_at,
)
from .usd_writer import UsdOverlayWriter, UsdWriter


class UsdReader(Reader):
    """The frames of a mesh: the time samples of its points, or else their only value.

    Exporters omit samples where nothing moves: if the points before and after a gap are equal, the
    frames in between are included. If the frames are then evenly spaced, `fps` follows from the
    time codes per second of the stage; otherwise, `times` are time codes and `fps` is the number of
    time codes per second. If the stage does not state it, it is None.
    """

    def __init__(self, path: Path, prim: str | None) -> None:
        """Composes the stage and reads everything except the frames."""
        self._scene: UsdScene | None = UsdScene(path)
        with translating(ValueError, "is damaged: "):
            self._mesh = self._scene.mesh(prim)
            super().__init__(path, self._header(path, self._scene), self._scene.files)

    def _header(self, path: Path, scene: UsdScene) -> Header:
        stage = scene.stage
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
        bars = self._primvars.get("standard_error")
        errors = None if bars is None else bars.GetCustomDataByKey(errors_of_key)
        scheme = self._mesh.GetSubdivisionSchemeAttr()
        return Header(
            faces=faces,
            n_frames=len(self._times),
            n_vertices=len(first),
            dtype=np.dtype(np.float32),
            polygons=polygons,
            up_axis=up_axis.lower() if up_axis else None,
            name=str(self._mesh.GetPath()),
            metres_per_unit=metres_per_unit,
            **timing(stage, self._times)._asdict(),
            **flags_of(self._primvars),
            standard_error_of="position" if errors is None else errors,
            mesh_file=MeshFile(path, ("transforms",)) if scene.is_moved(self._mesh) else None,
            subdivision=scheme.Get() if scheme.HasAuthoredValue() else None,
        )

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
        self._scene = self._mesh = self._points = None
        self._primvars = {}


usd = Format(
    "usd",
    (".usd", ".usdc", ".usda"),
    UsdReader,
    UsdWriter,
    frozenset({"prim"}),
    library=("pxr.Usd", "usd"),
    meshes=lambda path: UsdScene(path).moves,
    overlay=UsdOverlayWriter,
)
usdz = replace(usd, name="usdz", suffixes=(".usdz",), writer=None, overlay=None)
