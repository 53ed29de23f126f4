"""A dynamic mesh in memory, and what can be done with it."""

import contextlib
from collections.abc import Callable, Iterator, Mapping
from collections.abc import Sequence as Some
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import Any, Self, TypeAlias, overload

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ._arrays import Integers, Mask, as_mask
from ._checks import as_array, check_array, refuse_mask
from ._errors import InputError, KindError, require
from .frame import (
    Frame,
    Frames,
    Indices,
    VertexAttributes,
    as_array_of,
    checked,
    rate,
    shares,
    summary,
)
from .header import (
    ATTRIBUTES,
    Description,
    Header,
    Origin,
    check_vertices,
    with_all_needed,
)
from .polygons import Mesh, as_polygons, mesh_arrays, split_faces
from .run import R, Run
from .stored import Stored

__all__ = ["InMemory", "Sequence", "read"]


@dataclass(frozen=True, eq=False)
class Sequence(Description, VertexAttributes, Stored):
    """Frames of one fixed connectivity, in memory.

    ``len(sequence)`` is the number of frames n, and iteration yields one :class:`dynmesh.Frame`
    after another. ``sequence[7]`` is frame 7, ``sequence[-1]`` the last one, and
    ``sequence[10:50:2]`` a Sequence of some of the frames, with their masks, generations and ages,
    which shares the arrays. The frames keep their numbers. NumPy takes a frame as its positions,
    (k, 3), and a sequence as its vertices, NaN where they are not known.

    Verbs of a sequence return another one, with what they did as its `report`. In a notebook, a
    sequence shows itself: as a player that needs no network if the extra `view` is installed, with
    a simplified mesh and fewer frames if it is large, and as a table.

    Attributes:
        vertices: (n, k, 3) float32 or float64. Values are arbitrary where ``known`` is False. Or
            meshes of trimesh or PyVista, one for each frame, without `faces`; their masks are
            given as `known`, unless they have one themselves.
        faces: (m, 3) integers, triangles. Other polygons, as :data:`dynmesh.polygons.Faces`, are
            cut into triangles and kept as `polygons`.
        known: (n, k) bool, or integers 0 and 1, or None if every position was observed.
        generation: (n, k) int32, 0 for anchors, g for satellites, -1 for disconnected vertices, -2
            for those that were put together from other frames, or None. If there are generations,
            only vertices of generation 0 were observed; when the sequence is completed again, the
            others are estimated again.
        age: (n, k) int32, frames since the vertex was last observed; None if `generation` is.
        standard_error: (n, k) float32, how far each vertex may be off, in the unit of the
            positions; `standard_error_of` says in which sense: see
            :attr:`dynmesh.Completer.standard_error` and :attr:`dynmesh.Tracker.standard_error`.
            None if it was not estimated.
        origin: the file of which the mesh was read, if that holds more than is read; or None.
        report: what the verb did that made the frames; None of others.

    The attributes of :class:`dynmesh.frames.Description`, from `fps` on, are keywords as well.
    """

    vertices: Any
    faces: Any = None
    known: Mask | None = None
    origin: Origin | None = field(default=None, kw_only=True, repr=False)
    report: Any = field(default=None, kw_only=True, repr=False)

    def __post_init__(self) -> None:
        if isinstance(self.vertices, Frames):
            refuse_mask("vertices", self.vertices)
            message = "are frames already, which dynmesh.read() keeps in memory"
            raise KindError(message, argument="vertices")
        if self.faces is None or _is_of_meshes(self.vertices):
            arrays = _arrays_of(self.vertices)
            if self.faces is not None:
                message = "are those of the meshes, which need no others; masks are `known`"
                raise InputError(message, argument="faces")
            vars(self).update(arrays | self.attributes())
        for name in ("vertices", "times", *self.attributes()):
            whole = np.float64 if name in ("vertices", "times") else None
            vars(self)[name] = as_array(name, getattr(self, name), whole)
        if np.ndim(self.vertices) == 3:
            self._take_faces(self.vertices.shape[1])
        for name, array in {"vertices": self.vertices, **self.attributes()}.items():
            check_array(name, array)
        check_vertices(self.vertices.dtype, self.vertices.shape)
        for name, values in self.attributes().items():
            ATTRIBUTES[name].check(values.dtype, values.shape, self.vertices.shape[:2])
        if self.known is not None:
            vars(self)["known"] = as_mask(self.known)
        _ = self.header  # which checks all that it shares
        if not isinstance(self.origin, Origin | None):
            raise KindError("must be that of another sequence, or None", argument="origin")

    def __repr__(self) -> str:
        masks = shares(self.vertices, self.known)
        counts = summary(self.n_frames, self.n_vertices, len(self.faces), self.dtype)
        return f"{type(self).__name__}({counts}, {masks}, {rate(self.fps)})"

    @cached_property
    def header(self) -> Header:  # type: ignore[override]
        """What all frames share."""
        n_frames, n_vertices, _ = self.vertices.shape
        what: dict[str, Any] = {"attributes": self.attributes(), **self.described()}
        return Header(self.faces, n_frames, n_vertices, self.vertices.dtype, **what)

    @property
    def path(self) -> Path:  # type: ignore[override]
        """What messages and pages call the sequence: the last part of its name, if it has one."""
        own = (self.name or "").rpartition("/")[2]
        return Path(vars(self).get("called", own or "sequence"))

    def named(self, name: str, files: Some[Path] = ()) -> Self:
        """The same sequence, which messages call by this name, and which was read from files."""
        other = copy(self)
        vars(other).update(called=name, files=files)
        return other

    def __getstate__(self) -> object:
        return vars(self)

    def close(self) -> None:
        """Does nothing: frames in memory stay there."""

    def _frames(self, numbers: Indices) -> Iterator[Frame]:
        rows: dict[str, Any] = self.attributes()
        for number in numbers:
            values = {name: array[number] for name, array in rows.items()}
            yield Frame(self.vertices[number], **values)

    def _chosen(self, indices: Indices) -> Self:
        at = (
            slice(indices.start, indices.stop, indices.step)
            if isinstance(indices, range)
            else indices
        )
        rows: dict[str, Any] = {name: array[at] for name, array in self.attributes().items()}
        header = self.header.of_frames(indices)
        rows |= {"start": header.start, "times": header.times, "report": None}
        return replace(self, vertices=self.vertices[at], origin=self._origin_of(indices), **rows)

    @overload
    def __getitem__(self, frames: int | np.integer[Any]) -> Frame: ...
    @overload
    def __getitem__(self, frames: slice | Some[int] | Integers) -> Self: ...
    def __getitem__(
        self, frames: int | np.integer[Any] | slice | Some[int] | Integers
    ) -> "Frame | Self":
        result: Frame | Self = super().__getitem__(frames)  # type: ignore[assignment]
        return result

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        return as_array_of(self.vertices, self.known, dtype, copy)

    @classmethod
    def read(cls, path: Any, **source: Any) -> "Sequence":
        """Reads all frames of a file: see :func:`dynmesh.read`."""
        return read(path, **source)

    def write(self, path: Any, **options: Any) -> Any:
        """Writes the frames to a file: see :func:`dynmesh.write`."""
        return _called("formats", "write", path, self, **options)

    def complete(self, **options: Any) -> Any:
        """Completes the frames: see :func:`dynmesh.complete`."""
        return _called("verbs.complete", "complete", self, **options)

    def convert(self, **options: Any) -> Any:
        """Changes axes, units, rate or range: see :func:`dynmesh.convert`."""
        return _called("verbs.convert", "convert", self, **options)

    def degrade(self, **options: Any) -> Any:
        """Removes vertices and adds noise: see :func:`dynmesh.degrade`."""
        return _called("verbs.degrade", "degrade", self, **options)

    def evaluate(self, reference: Any, **options: Any) -> Any:
        """Measures the errors of the frames: see :func:`dynmesh.evaluate`."""
        return _called("verbs.evaluate", "evaluate", self, reference, **options)

    def view(self, **options: Any) -> Any:
        """Makes a page that plays the frames: see :func:`dynmesh.view`."""
        return _called("verbs.view", "view", self, **options)

    def picture(self, **options: Any) -> Any:
        """Draws frames: see :func:`dynmesh.picture`."""
        return _called("verbs.picture", "picture", self, **options)

    def to_pyvista(self, frame: int) -> Any:
        """Returns a frame as a `pyvista.PolyData`, NaN where it is not known."""
        result = self[frame]
        sizes, corners = as_polygons(self.faces, self.polygons)
        padded = np.insert(corners, np.cumsum(sizes) - sizes, sizes)
        mesh = require("pyvista", extra="view").PolyData(np.array(result), padded)
        for name, values in result.attributes().items():
            mesh.point_data[name] = values
        return mesh

    def to_trimesh(self, frame: int) -> Any:
        """Returns a frame as a `trimesh.Trimesh`, NaN where it is not known."""
        result = self[frame]
        return require("trimesh", extra="scans").Trimesh(
            np.array(result),
            np.array(self.faces),
            vertex_attributes=result.attributes(),
            process=False,
        )

    def _repr_html_(self) -> str:
        return str(_called("draw.notebook", "shown", self))


_Array: TypeAlias = NDArray[np.floating[Any]]

InMemory: TypeAlias = Sequence | _Array | Some[_Array] | Some[Mesh]
"""A sequence, positions (n, k, 3) beside faces, or meshes of trimesh or PyVista, a frame each."""


def _called(module: str, name: str, *given: Any, **options: Any) -> Any:
    """Calls a function of a module that uses this one, and is loaded when it is called."""
    function: Callable[..., Any] = getattr(import_module(f".{module}", __package__), name)
    return function(*given, **options)


def _arrays_of(meshes: Any) -> dict[str, Any]:
    """The arrays of one or several meshes of trimesh or PyVista, a frame each."""
    every = [meshes] if hasattr(meshes, "faces") else meshes
    is_list = isinstance(every, list | tuple) and len(every) > 0
    found = [mesh_arrays(mesh) for mesh in every] if is_list else [None]
    frames = [frame for frame in found if frame is not None]
    if len(frames) < len(found):
        message = "are missing, and what stands before them is no list of meshes with faces"
        raise KindError(message, argument="faces")
    (faces, first), values = frames[0], [_values_of(mesh) for mesh in every]
    for number, (own, points) in enumerate(frames):
        same = np.array_equal(split_faces(own)[0], split_faces(faces)[0])
        if not same or len(points) != len(first):
            raise InputError(
                "has other vertices or faces than frame 0; trimesh leaves out vertices that are "
                "not finite unless it is told process=False",
                frame=number,
            )
    names = with_all_needed([n for n in ATTRIBUTES if all(n in own for own in values)])
    rows = {name: np.stack([np.asarray(own[name]) for own in values]) for name in names}
    return {"vertices": np.stack([points for _, points in frames]), "faces": faces, **rows}


def _values_of(mesh: Any) -> Any:
    """The values of the vertices of a mesh of another library, by name."""
    return getattr(mesh, "point_data", getattr(mesh, "vertex_attributes", {}))


def _is_of_meshes(frames: Any) -> bool:
    first = frames[0] if isinstance(frames, list | tuple) and len(frames) > 0 else frames
    return hasattr(first, "faces") and not isinstance(first, Frames)


def as_sequence(frames: Any, faces: Any = None) -> Sequence | None:
    """A Sequence as it is, arrays and meshes of other libraries as one; None if it is none."""
    if isinstance(frames, Frames):
        refuse_reading({"faces": faces})
        return frames if isinstance(frames, Sequence) else None
    is_in_memory = are_arrays(frames, faces) or _is_of_meshes(frames)
    return Sequence(frames, faces) if is_in_memory else None


def are_arrays(frames: Any, faces: Any) -> bool:
    """Whether these are positions alone: an array, or a list where faces are given."""
    is_list = isinstance(frames, list | tuple) and faces is not None
    return isinstance(frames, np.ndarray) or (is_list and not _is_of_meshes(frames))


def refuse_reading(how: Mapping[str, Any]) -> None:
    """Refuses keywords of :func:`dynmesh.open` where nothing is opened, as frames are there."""
    for name, value in how.items():
        if value is not None and not (name == "gaps" and value == "refuse"):
            raise InputError("has no effect, as frames and meshes state it", argument=name)


def result_of(run: Run[R], source: Frames) -> Run[R] | Any:
    """What a verb returns: frames in memory of those in memory, else the run."""
    return run.read() if isinstance(source, Sequence) else run


def read(path: Any, **source: Any) -> Sequence:
    """Reads all frames into memory, of a file or of any others, as a verb makes them.

    The keywords and errors are those of :func:`dynmesh.open`.
    """
    with contextlib.ExitStack() as stack:
        frames = path
        if isinstance(path, Frames):
            refuse_reading(source)
        else:
            frames = stack.enter_context(_called("formats", "open", path, **source))
        header = frames.header
        shape = (header.n_frames, header.n_vertices)
        vertices = np.empty((*shape, 3), header.dtype)
        values: dict[str, Any] = {
            name: np.empty(shape, ATTRIBUTES[name].dtype) for name in header.attributes
        }
        for number, frame in enumerate(checked(frames)):
            vertices[number] = frame.points
            for name, rows in frame.attributes().items():
                values[name][number] = rows
        values |= {"origin": frames.origin, "report": frames.report}
        return Sequence(vertices, header.faces, **values, **header.described())
