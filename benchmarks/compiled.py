"""Methods and trackers in C++ (cpp/), timed there or with other constants."""

import os
from ctypes import CDLL, byref, c_char_p, c_double, c_int, c_int64, c_size_t, c_void_p
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.ctypeslib import ndpointer
from numpy.typing import NDArray

from dynmesh.files.scans import PointScan
from dynmesh.sequence import Mask, Positions
from dynmesh.study.completion import Completion, Faces

REPOSITORY = Path(__file__).parents[1]

_FLOATS, _DOUBLES, _INTEGERS, _FLAGS = (
    ndpointer(dtype, flags="C_CONTIGUOUS") for dtype in (np.float32, np.float64, np.int32, np.bool_)
)


def require(name: str) -> Path:
    """Return the path of a compiled program.

    It is in the folder that DYNMESH_BENCHMARKS names, or else in that of script/bench.

    Raises:
        ImportError: it is not built.
    """
    built = REPOSITORY / "build" / "bench" / "benchmarks" / "cpp"
    path = Path(os.environ.get("DYNMESH_BENCHMARKS", built)) / name
    if not path.exists():
        raise ImportError(f"{name} is not built; script/bench builds it")
    return path


@lru_cache
def _function(name: str, *arguments: Any, returns: Any = None) -> Any:
    """Return a function of the compiled part; its name begins with that of its library."""
    library = "dynmesh-tracking.so" if name.startswith("tracking") else "dynmesh-subjects.so"
    function = CDLL(str(require(library)))[name]
    function.argtypes, function.restype = arguments, returns
    return function


def constants_of(part: str) -> dict[str, float]:
    """Return the values of the constants of a part, "detail", "uncertainty" or "tracking".

    Raises:
        ImportError: the library is not built.
    """
    constant = _function(f"{part}_constant", c_size_t, c_void_p, returns=c_char_p)
    value = c_double()
    found: dict[str, float] = {}
    while (name := constant(len(found), byref(value))) is not None:
        found[name.decode()] = value.value
    return found


class _Compiled:
    """An object of the compiled part, whose memory is freed with it.

    Attributes:
        frame: the last frame, (k, 3) float32.
    """

    def __init__(
        self, kind: str, faces: Faces, first_frame: Positions, constant: str, factor: float
    ) -> None:
        self._destroy = _function(f"{kind}_destroy", c_void_p)
        self.frame = np.array(first_frame, np.float32, order="C")
        mesh = (_INTEGERS, c_size_t, _FLOATS, c_size_t)
        create = _function(f"{kind}_create", *mesh, c_char_p, c_double, returns=c_void_p)
        corners = np.ascontiguousarray(faces, np.int32)
        sizes = len(corners), len(self.frame)
        self._made = create(corners, sizes[0], self.frame, sizes[1], constant.encode(), factor)
        if not self._made:
            raise ValueError(f"the library refuses {factor:g} times {constant}")

    def __del__(self) -> None:
        if getattr(self, "_made", None):
            self._destroy(self._made)


class CppMethod(_Compiled, Completion):
    """A method in C++ without a completer around it, timed without Python in between."""

    def __init__(
        self, faces: Faces, first_frame: Positions, constant: str = "", factor: float = 1.0
    ) -> None:
        """Build the plain implementation of method motion, or detail with a changed constant.

        Args:
            faces: (m, 3) vertex indices.
            first_frame: (k, 3) positions.
            constant: the name of the constant of method detail, or of the error bars after
                "uncertainty.", which are then estimated. "" is for method motion.
            factor: by which it is multiplied.

        Raises:
            ImportError: the library is not built.
            ValueError: the library refuses the arguments.
        """
        super().__init__("subject", faces, first_frame, constant, factor)

    def complete(self, points: Positions, known: Mask) -> NDArray[np.float32]:
        """Complete the next frame; the next call overwrites the returned array."""
        given = (c_void_p, _FLOATS, _FLAGS, c_size_t, _FLOATS)
        push = _function("subject_push", *given, returns=c_int64)
        shown = np.ascontiguousarray(points, np.float32), np.ascontiguousarray(known)
        self.seconds = 1e-9 * push(self._made, *shown, len(known), self.frame)
        return self.frame

    def error_bars(self) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
        """Return the standard errors and the generations of the last frame, (k,) each.

        Only where error bars are estimated.
        """
        bars = np.empty(len(self.frame))
        generation = np.empty(len(self.frame), np.int32)
        _function("subject_error_bars", c_void_p, _DOUBLES, _INTEGERS)(self._made, bars, generation)
        return bars, generation


class CppTracker(_Compiled):
    """A tracker with one constant changed."""

    def __init__(self, faces: Faces, first_frame: Positions, constant: str, factor: float) -> None:
        """Build the tracker; `factor` multiplies the constant, and counts are rounded.

        Raises:
            ImportError: the library is not built.
            ValueError: the library refuses the arguments.
        """
        super().__init__("tracking", faces, first_frame, constant, factor)

    def push(self, scan: PointScan) -> NDArray[np.float32]:
        """Track a scan with normals and viewpoints; the next call overwrites the returned array.

        Raises:
            ValueError: the scan is refused.
        """
        given = (c_void_p, _FLOATS, _FLOATS, c_size_t, _FLOATS, c_size_t, _FLOATS)
        push = _function("tracking_push", *given, returns=c_int)
        points, normals, viewpoints = (np.ascontiguousarray(rows, np.float32) for rows in scan)
        measured = points, normals, len(points), viewpoints, len(viewpoints)
        if push(self._made, *measured, self.frame) < 0:
            raise ValueError("the scan is refused")
        return self.frame
