"""What the completer and the tracker have in common."""

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, ClassVar, get_args

import numpy as np
from numpy.typing import NDArray

from . import _arrays, _core
from ._arrays import Positions
from ._checks import check_flags, check_integer, check_number
from ._errors import KindError, SettingError
from .frame import Frame
from .polygons import Faces, Mesh, mesh_arrays
from .topology import RefusedFace, TopologyReport


def trained(training: Iterable[Positions], first_frame: Positions) -> Any:
    """Returns frames as the core takes them."""
    result = _core.training(first_frame)
    for frame in _arrays.frames("training", training):
        result.add(_arrays.points("training", frame, first_frame.dtype))
    return result


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
        frames = None if training is None else trained(training, first)
        self._training = None if frames is None else frames.frames()
        self._core = self._create(self._faces, self._first_frame, self._settings, frames)

    def __getstate__(self) -> tuple[dict[str, Any], bytes]:
        return {name: given for name, given in vars(self).items() if name != "_core"}, self.state()

    def __setstate__(self, given: tuple[dict[str, Any], bytes]) -> None:
        vars(self).update(given[0])
        frames = None if self._training is None else trained(self._training, self._first_frame)
        self._core = self._create(self._faces, self._first_frame, self._settings, frames)
        self.restore(given[1])

    def skip(self, *, out: Positions | None = None) -> Positions:
        """Passes over a frame in which nothing was observed; the rest is as of `push`."""
        return self._made(out, self._core.skip)

    def reset(self, frame: Positions) -> None:
        """Starts again with a new frame 0, (k, 3), complete and finite."""
        self._core.reset(self._points("frame", frame))

    def state(self) -> bytes:
        """Returns everything that later frames depend on, to be stored or sent.

        These are little-endian bytes for `restore`. They contain no times, so objects that received
        the same frames have identical states.
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
