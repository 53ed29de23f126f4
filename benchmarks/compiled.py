"""Methods and trackers in C++ (cpp/), timed there or with other constants."""

import ctypes
import os
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dynmesh.files.scans import PointScan
from dynmesh.sequence import Mask

Faces = NDArray[np.int32]
Frames = NDArray[np.float32]

REPOSITORY = Path(__file__).parents[1]


def programs() -> Path:
    """Return the folder of the compiled programs: DYNMESH_BENCHMARKS, or that of script/bench."""
    built = REPOSITORY / "build" / "bench" / "benchmarks" / "cpp"
    return Path(os.environ.get("DYNMESH_BENCHMARKS", built))


def require(name: str) -> Path:
    """Return the path of a compiled program.

    Raises:
        ImportError: it is not built.
    """
    path = programs() / name
    if not path.exists():
        raise ImportError(f"{name} is not built; script/bench builds it")
    return path


@lru_cache
def _library() -> ctypes.CDLL:
    library = ctypes.CDLL(str(require("dynmesh-subjects.so")))
    size, pointer = ctypes.c_size_t, ctypes.c_void_p
    library.subject_create.argtypes = [pointer, size, pointer, size, ctypes.c_char_p]
    library.subject_create.argtypes += [ctypes.c_double]
    library.subject_create.restype = pointer
    library.subject_destroy.argtypes = [pointer]
    library.subject_error_bars.argtypes = [pointer] * 3
    library.subject_push.argtypes = [pointer, pointer, pointer, size, pointer]
    library.subject_push.restype = ctypes.c_int64
    return library


@lru_cache
def _tracking() -> ctypes.CDLL:
    library = ctypes.CDLL(str(require("dynmesh-tracking.so")))
    size, pointer = ctypes.c_size_t, ctypes.c_void_p
    library.tracking_create.argtypes = [pointer, size, pointer, size, ctypes.c_char_p]
    library.tracking_create.argtypes += [ctypes.c_double]
    library.tracking_create.restype = pointer
    library.tracking_destroy.argtypes = [pointer]
    library.tracking_push.argtypes = [pointer, pointer, pointer, size, pointer, size, pointer]
    library.tracking_push.restype = ctypes.c_int
    return library


def _address(array: NDArray[Any]) -> int:
    assert array.flags.c_contiguous
    return array.ctypes.data


class CppMethod:
    """A method in C++ without a completer around it.

    Attributes:
        completed: the last completed frame, (k, 3).
        seconds: the time of the last frame, without Python in between.
    """

    def __init__(
        self, faces: Faces, first_frame: Frames, constant: str = "", factor: float = 1.0
    ) -> None:
        """Build the plain implementation of method motion, or detail with a changed constant.

        Args:
            faces: (m, 3) int32.
            first_frame: (k, 3) float32.
            constant: the name of the constant of method detail, or of the error bars after
                "uncertainty.", which are then estimated. "" is for method motion.
            factor: by which it is multiplied.

        Raises:
            ImportError: the library is not built.
            ValueError: the library refuses the arguments.
        """
        self._library = _library()
        self.completed: Frames = first_frame.copy()
        self.seconds = 0.0
        mesh = _address(faces), len(faces), _address(first_frame), len(first_frame)
        self._subject = self._library.subject_create(*mesh, constant.encode(), factor)
        if not self._subject:
            raise ValueError(f"the library refuses {factor:g} times {constant}")

    def __del__(self) -> None:
        """Free the memory of the method."""
        if getattr(self, "_subject", None):
            self._library.subject_destroy(self._subject)

    def push(self, points: Frames, known: Mask) -> Frames:
        """Complete a frame; the next call overwrites the returned array.

        Args:
            points: (k, 3) float32; those of unknown vertices are not used.
            known: (k,) bool.
        """
        shown = np.ascontiguousarray(points, np.float32), np.ascontiguousarray(known)
        size, completed = len(self.completed), _address(self.completed)
        nanoseconds = self._library.subject_push(
            self._subject, *map(_address, shown), size, completed
        )
        self.seconds = 1e-9 * nanoseconds
        return self.completed

    def error_bars(self) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
        """Return the standard errors and the generations of the last frame, (k,) each.

        Only where error bars are estimated.
        """
        bars = np.empty(len(self.completed))
        generation = np.empty(len(self.completed), np.int32)
        self._library.subject_error_bars(self._subject, _address(bars), _address(generation))
        return bars, generation


def constants_of(part: str) -> dict[str, float]:
    """Return the values of the constants of a part, "detail", "uncertainty" or "tracking".

    Raises:
        ImportError: the library is not built.
    """
    library = _tracking() if part == "tracking" else _library()
    constant = library[f"{part}_constant"]
    constant.argtypes, constant.restype = [ctypes.c_size_t, ctypes.c_void_p], ctypes.c_char_p
    value = ctypes.c_double()
    found: dict[str, float] = {}
    while (name := constant(len(found), ctypes.byref(value))) is not None:
        found[name.decode()] = value.value
    return found


class CppTracker:
    """A tracker with one constant changed.

    Attributes:
        tracked: the last tracked frame, (k, 3).
    """

    def __init__(self, faces: Faces, first_frame: Frames, constant: str, factor: float) -> None:
        """Build the tracker.

        Args:
            faces: (m, 3) int32.
            first_frame: (k, 3) float32.
            constant: the name of the constant.
            factor: by which it is multiplied; counts are rounded.

        Raises:
            ImportError: the library is not built.
            ValueError: the library refuses the arguments.
        """
        self.tracked: Frames = first_frame.copy()
        mesh = _address(faces), len(faces), _address(first_frame), len(first_frame)
        self._tracker = _tracking().tracking_create(*mesh, constant.encode(), factor)
        if not self._tracker:
            raise ValueError(f"the library refuses {factor:g} times {constant}")

    def __del__(self) -> None:
        """Free the memory of the tracker."""
        if getattr(self, "_tracker", None):
            _tracking().tracking_destroy(self._tracker)

    def push(self, scan: PointScan) -> Frames:
        """Track a scan with normals and viewpoints; the next call overwrites the returned array.

        Raises:
            ValueError: the scan is refused.
        """
        points, normals, viewpoints = (np.ascontiguousarray(rows, np.float32) for rows in scan)
        sensors = _address(viewpoints), len(viewpoints)
        measured = _address(points), _address(normals), len(points)
        if (
            _tracking().tracking_push(self._tracker, *measured, *sensors, _address(self.tracked))
            < 0
        ):
            raise ValueError("the scan is refused")
        return self.tracked
