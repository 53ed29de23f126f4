"""What the completer and the tracker have in common."""

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, ClassVar, get_args

import numpy as np
from numpy.typing import NDArray

from . import _arrays, _core
from ._arrays import Floats, Positions
from ._checks import check_flags, check_integer, check_number
from ._errors import KindError, SettingError
from .frame import Frame
from .geometry import vertex_normals
from .polygons import Faces, Mesh, mesh_arrays
from .topology import RefusedFace, TopologyReport, cells


def trained(
    training: Iterable[Positions], first_frame: Positions, faces: NDArray[np.integer[Any]]
) -> Any:
    """Returns frames as the core takes them; refuses mirror images of a closed mesh.

    An open one may be bent the other way.
    """
    result, likeness = _core.training(first_frame), list[float]()
    n_edges = len(cells(faces, len(first_frame))[1]) // 2
    is_closed = 2 * n_edges - 3 * len(faces) < _OPEN * n_edges
    own = _heights(first_frame, faces)
    for frame in _arrays.frames("training", training):
        points = _arrays.points("training", frame, first_frame.dtype)
        result.add(points)
        likeness.append(float(own @ _heights(points, faces)))
    if is_closed and likeness and np.median(likeness) < _MIRRORED:
        message = "the frames are mirror images of the mesh; mirror them back"
        raise SettingError(message, argument="training")
    return result


_OPEN = 0.05
"""At most this share of the edges of a closed mesh are at a boundary."""
_MIRRORED = -0.75
"""The correlation of the heights of vertices over their neighbours with those of frame 0, below
which frames are mirror images: these have the opposite heights, in any pose."""


def _heights(points: Positions, faces: NDArray[np.integer[Any]]) -> Floats:
    """How high (k, 3) vertices are above their neighbours, along the normals of the faces.

    The sum of the squares is 1, or 0 of a flat mesh.
    """
    scaled: Floats = points / np.float64(np.abs(points).max(initial=0) or 1.0)
    apart = np.zeros_like(scaled)
    corners = scaled[faces]
    for own in range(3):
        away = 3 * corners[:, own] - corners.sum(axis=1)
        for axis in range(3):
            apart[:, axis] += np.bincount(faces[:, own], away[:, axis], len(points))
    heights = (apart * vertex_normals(faces, scaled)).sum(axis=1)
    return np.asarray(heights / (np.linalg.norm(heights) or 1.0))


class Stream:
    """A mesh whose frames arrive one after another."""

    _create: ClassVar[Callable[..., Any]]
    """Makes the object of the core, of faces, first frame, settings and training."""

    def __init__(
        self,
        faces: Faces | Mesh,
        first_frame: Positions | Frame | None,
        training: Iterable[Positions] | None,
        kinds: Mapping[str, Any],
        settings: dict[str, Any],
    ) -> None:
        for name, kind in kinds.items():
            _check_setting(name, settings[name], kind)
        faces, first_frame = _arrays.template(faces, first_frame, "first_frame")
        first = _arrays.first_frame("first_frame", first_frame)
        self._settings = settings
        # Copies: a pickle holds what was given, which the caller may change.
        self._faces = _arrays.triangles(faces, len(first)).copy()
        self._first_frame = first.copy()
        frames = None if training is None else trained(training, first, self._faces)
        self._training = None if frames is None else frames.frames()
        self._core = self._create(self._faces, self._first_frame, self._settings, frames)

    def __getstate__(self) -> tuple[dict[str, Any], bytes]:
        return {name: given for name, given in vars(self).items() if name != "_core"}, self.state()

    def __setstate__(self, given: tuple[dict[str, Any], bytes]) -> None:
        vars(self).update(given[0])
        frames = (
            None
            if self._training is None
            else trained(self._training, self._first_frame, self._faces)
        )
        self._core = self._create(self._faces, self._first_frame, self._settings, frames)
        self.restore(given[1])

    def skip(self, *, out: Positions | None = None) -> Positions:
        """Passes over a frame in which nothing was observed.

        Args:
            out: see `push`.

        Returns:
            The frame, (k, 3).
        """
        return self._made(out, self._core.skip)

    def reset(self, frame: Positions) -> None:
        """Starts again with a new frame 0.

        Args:
            frame: the new frame 0, (k, 3), complete and finite.
        """
        self._core.reset(self._points("frame", frame))

    def state(self) -> bytes:
        """Returns everything that later frames depend on, to be stored or sent.

        Returns:
            Little-endian bytes for `restore`. They contain no times, so objects that received the
            same frames have identical states.
        """
        return bytes(self._core.state())

    def restore(self, state: bytes | bytearray | memoryview) -> None:
        """Continues from a state, with the same results, or up to rounding on another processor.

        The seconds of `report` become 0. This is fast if frame 0 of the state is that of this
        object, so that frames can be undone while they arrive; otherwise it takes as long as a new
        object, as it does with `learn`.

        Args:
            state: the bytes that `state` returned, from an object with the same faces in the same
                order, dtype, settings and training frames, on any machine.
        """
        try:
            given = bytes(memoryview(state))
        except TypeError as error:
            message = f"must be bytes, not {type(state).__name__}"
            raise KindError(message, argument="state") from error
        self._core.restore(given)

    @property
    def generation(self) -> NDArray[np.int32]:
        """(k,) int32: the number of edges to the nearest observed vertex of the last frame.

        0 for an observed vertex, -1 where no chain of edges leads to one.
        """
        return np.asarray(self._core.generation())

    @property
    def age(self) -> NDArray[np.int32]:
        """(k,) int32: the number of frames since the vertex was last observed."""
        return np.asarray(self._core.age())

    @property
    def topology(self) -> TopologyReport:
        """The TopologyReport of the mesh."""
        components, isolated, boundary, refused = self._core.topology()
        faces = [RefusedFace(*face) for face in refused]
        return TopologyReport(components, isolated, boundary, faces)

    @property
    def settings(self) -> dict[str, Any]:
        """All settings with their values, by name."""
        return dict(self._settings)

    @property
    def n_frames(self) -> int:
        """The number of frames since construction or `reset`; `restore` restores it."""
        return int(self._core.n_frames())

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.n_vertices} vertices, {self.n_edges} edges)"

    @property
    def n_vertices(self) -> int:
        """The number of vertices, k."""
        return len(self._first_frame)

    @property
    def n_edges(self) -> int:
        """The number of edges of the mesh."""
        return int(self._core.n_edges())

    @property
    def dtype(self) -> np.dtype[Any]:
        """float32 or float64, the dtype of first_frame."""
        return self._first_frame.dtype

    def _points(self, name: str, given: Any, shape: str = "(k, 3)") -> Positions:
        if not isinstance(given, np.ndarray) and (mesh := mesh_arrays(given)) is not None:
            given = mesh[1]
        return _arrays.points(name, given, self._first_frame.dtype, shape)

    def _made(self, out: Positions | None, make: Callable[[Positions], object]) -> Positions:
        """Returns `out`, or a new array, with the frame that a function writes."""
        result = _arrays.output(out, self._first_frame.dtype, len(self._first_frame))
        make(result)
        if out is None or out is result:
            return result
        out[...] = result
        return out


def _check_setting(name: str, value: Any, kind: Any) -> None:
    """Refuses a value of the wrong kind; the core refuses those out of range."""
    if kind is bool:
        check_flags(**{name: value})
    elif kind is int:
        check_integer(name, value, -math.inf)
    elif choices := [one for one in get_args(kind) if isinstance(one, str)]:
        if not isinstance(value, str):
            raise KindError(f"must be a string, not {value!r}", argument=name, value=value)
        if value not in choices:
            message = " or ".join(map(repr, choices))
            raise SettingError(f"must be {message}, not {value!r}", argument=name, value=value)
    elif value is not None:
        check_number(name, value)
