"""All meshes of a scene as one sequence, to be looked at together."""

from collections.abc import Iterator, Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from .._errors import DynmeshError, InputError
from ..frames.attributes import ATTRIBUTES, flags_of
from ..frames.frame import Frame
from ..frames.header import Header
from ..frames.reader import Reader
from ..frames.scenes import Scene, listed
from ..frames.times import Timing, frame_numbers
from .scene_files import naming_mesh, open_mesh

_SAME_TIME = 1e-6


class WholeScene(Reader):
    """All meshes of a scene, joined at their places in it.

    There is a frame wherever a mesh that moves has one. Where another mesh has none, it is as in
    its last frame before or, before its first, as in that. The vertices of a mesh without masks,
    generations or standard errors, which another one has, count as observed. A mesh that cannot be
    read as a sequence is left out, and `remarks` says so.

    Attributes:
        meshes: the number of vertices of each mesh, by its path, in their order.
    """

    def __init__(self, scene: Scene, missing: Literal["zero"] | None = None) -> None:
        """Opens the meshes of an open scene.

        Raises:
            ValueError: none of them is a valid sequence.
        """
        self._scene = scene
        self._readers: dict[str, Reader] = {}
        told: list[str] = []
        for mesh in scene.moves:
            try:
                self._readers[mesh] = open_mesh(scene, mesh, missing)
            except DynmeshError as error:
                error.file = None
                told.append(f"{mesh} is left out: {error}")
        if not self._readers:
            raise InputError("; ".join(told) or "contains no polygon mesh", file=scene.path)
        self.meshes = {mesh: reader.n_vertices for mesh, reader in self._readers.items()}
        moving = [mesh for mesh in self.meshes if scene.moves[mesh]] or list(self.meshes)
        times = {mesh: np.array(scene.times(mesh)) for mesh in self.meshes}
        self._times, timing = _joined(
            {mesh: times[mesh] for mesh in moving}, {m: r.header for m, r in self._readers.items()}
        )
        self._indices = {
            mesh: np.searchsorted(own, self._times + _SAME_TIME, side="right").clip(1) - 1
            for mesh, own in times.items()
        }
        if short := [mesh for mesh in moving if len(times[mesh]) < len(self._times)]:
            told.append(
                "where a mesh has no frame, it is shown as in its last one before, or else its "
                f"first: {listed(short, 3)}"
            )
        self.remarks = tuple(told)
        super().__init__(scene.path, self._joined_header(timing))
        self._unchanged = scene.unchanged

    def _joined_header(self, timing: Timing) -> Header:
        headers = [reader.header for reader in self._readers.values()]
        starts = np.cumsum([0, *self.meshes.values()])
        bars = [header for header in headers if header.has_standard_error]
        return Header(
            np.concatenate([h.faces + start for h, start in zip(headers, starts, strict=False)]),
            len(self._times),
            int(starts[-1]),
            np.result_type(*(header.dtype for header in headers)),
            up_axis=headers[0].up_axis,
            metres_per_unit=headers[0].metres_per_unit,
            **timing._asdict(),
            **flags_of({name for header in headers for name in header.attributes}),
            standard_error_of=(bars or headers)[0].standard_error_of,
        )

    @property
    def files(self) -> list[Any]:
        """The files of the scene."""
        return self._scene.files

    def _frames(self, numbers: range) -> Iterator[Frame]:
        held: dict[str, tuple[int, Frame]] = {}
        for number in numbers:
            for mesh, reader in self._readers.items():
                index = int(self._indices[mesh][number])
                if mesh not in held or held[mesh][0] != index:
                    with naming_mesh(mesh):
                        (frame,) = reader.frames(index, index + 1)
                    held[mesh] = index, frame
            time = self._times[number]
            placed = [self._placed(mesh, frame, time) for mesh, (_, frame) in held.items()]
            names = placed[0].keys()
            yield Frame(**{name: np.concatenate([one[name] for one in placed]) for name in names})

    def _placed(self, mesh: str, frame: Frame, time: float) -> dict[str, NDArray[Any]]:
        """What the whole has of a mesh at this time."""
        place = self._scene.place(mesh, time)
        with np.errstate(invalid="ignore", over="ignore"):  # missing positions may be infinite
            points = (frame.points @ place[:3, :3] + place[3, :3]).astype(self.dtype)
        given = frame.attributes()
        values = {name: given.get(name) for name in self.header.attributes}
        made: dict[str, NDArray[Any]] = {"points": points}
        for name, value in values.items():
            if value is None and name == "known":
                made[name] = np.isfinite(points).all(axis=1)
            else:
                zeros = np.zeros(len(points), ATTRIBUTES[name].dtype)
                made[name] = zeros if value is None else value
        if "standard_error" in made:
            size = np.cbrt(abs(np.linalg.det(place[:3, :3])))
            made["standard_error"] = made["standard_error"] * np.float32(size)
        return made


def _joined(
    times: Mapping[str, NDArray[np.float64]], headers: Mapping[str, Header]
) -> tuple[NDArray[np.float64], Timing]:
    """Returns all times at which a mesh has a frame, and how their frames are numbered.

    The numbers are those of the mesh whose frames follow one another the fastest.
    """
    ordered = np.sort(np.concatenate(list(times.values())))
    ordered = ordered[np.diff(ordered, prepend=-np.inf) > _SAME_TIME]
    fastest = min(times, key=lambda mesh: np.diff(times[mesh]).min(initial=np.inf))
    header, own = headers[fastest], times[fastest]
    if len(own) == len(ordered):
        return ordered, Timing(header.fps, header.start, header.times)
    first, *more = frame_numbers(header)[:2]
    pace = (more[0] - first) / (own[1] - own[0]) if more else 1.0
    numbers = np.round(first + (ordered - own[0]) * pace, 6)
    even = bool((np.diff(numbers) == 1).all())
    return ordered, Timing(header.fps, float(numbers[0]), None if even else numbers)
