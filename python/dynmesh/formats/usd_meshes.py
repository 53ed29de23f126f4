"""Several meshes of a stage as one, in the space of the scene, moved as the stage moves them."""

from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..frame import Frame
from ..header import ATTRIBUTES, Header
from ..polygons import Polygons, as_polygons, split_polygons
from ..stored import FileFrames, Indices, Stored
from .format import Gaps, not_read
from .usd_library import of_usd
from .usd_mesh import moved_by, placements
from .usd_samples import axis_and_unit, timing
from .usd_stage import TRIED, UsdFrames, UsdScene


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
