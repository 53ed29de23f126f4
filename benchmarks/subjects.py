"""Completers that are called and timed in C++, without Python in between (cpp/subjects.cpp)."""

import ctypes
import os
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dynmesh.sequence import Mask

from .scenes import Faces, Frames

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
    library.subject_create.argtypes = [pointer, size, pointer, size, ctypes.c_int32]
    library.subject_create.restype = pointer
    varied = library.subject_create_varied
    varied.argtypes = [pointer, size, pointer, size, ctypes.c_char_p, ctypes.c_double]
    varied.restype = pointer
    library.subject_destroy.argtypes = [pointer]
    library.subject_error_bars.argtypes = [pointer] * 3
    library.subject_reset.argtypes = [pointer, pointer, size]
    library.subject_push.argtypes = [pointer] * 3 + [size, pointer, size, pointer, pointer]
    library.subject_push_sparse.argtypes = [pointer, pointer, pointer, size, pointer, size]
    library.subject_push_sparse.restype = ctypes.c_int64
    return library


def _address(array: NDArray[Any]) -> int:
    assert array.flags.c_contiguous
    return array.ctypes.data


class CppSubject:
    """A completer in C++, or with 0 threads the plain implementation of method motion.

    Attributes:
        completed: the last completed frame, (k, 3).
    """

    def __init__(
        self,
        faces: Faces,
        first_frame: Frames,
        threads: int = 1,
        varied: tuple[str, float] | None = None,
    ) -> None:
        """Build the completer.

        Args:
            faces: (m, 3) int32.
            first_frame: (k, 3) float32.
            threads: the number of threads, or 0 for the plain implementation.
            varied: the name of a constant of method detail and a factor. The completer then uses
                method detail in one thread, with this constant multiplied by the factor.

        Raises:
            ImportError: the library is not built.
            ValueError: the library refuses the arguments.
        """
        self._library = _library()
        self.completed: Frames = first_frame.copy()
        mesh = _address(faces), len(faces), _address(first_frame), len(first_frame)
        if varied is None:
            self._subject = self._library.subject_create(*mesh, threads)
        else:
            name, factor = varied
            self._subject = self._library.subject_create_varied(*mesh, name.encode(), factor)
        if not self._subject:
            raise ValueError(f"the library refuses {varied or f'{threads} threads'}")

    def __del__(self) -> None:
        """Free the memory of the completer."""
        if getattr(self, "_subject", None):
            self._library.subject_destroy(self._subject)

    def reset(self, frame: Frames) -> None:
        """Begin again with a complete frame."""
        self._library.subject_reset(self._subject, _address(frame), len(frame))

    def push(
        self, frames: Frames, masks: Mask | None, order: NDArray[np.int64]
    ) -> NDArray[np.float64]:
        """Complete `frames[order]` one after another, and return the seconds of each.

        Args:
            frames: (n, k, 3).
            masks: (n, k) known masks. If None, vertices that are not finite are unknown.
            order: the numbers of the frames.
        """
        n_vertices = len(self.completed)
        assert frames.dtype == np.float32
        assert frames.shape[1:] == (n_vertices, 3)
        assert order.dtype == np.int64
        nanoseconds = np.full(
            len(order), -1, np.int64
        )  # written to, so that it causes no page fault later
        self._library.subject_push(
            self._subject,
            _address(frames),
            None if masks is None else _address(masks),
            n_vertices,
            _address(order),
            len(order),
            _address(self.completed),
            _address(nanoseconds),
        )
        return np.asarray(1e-9 * nanoseconds, np.float64)

    def error_bars(self) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
        """Return the standard errors and the generations of the last frame, (k,) each.

        Only for a subject with a varied constant of the error bars, "uncertainty.NAME".
        """
        bars = np.empty(len(self.completed))
        generation = np.empty(len(self.completed), np.int32)
        self._library.subject_error_bars(self._subject, _address(bars), _address(generation))
        return bars, generation

    def push_sparse(self, indices: NDArray[np.int32], points: Frames) -> float:
        """Complete a frame from the known vertices alone, and return the seconds."""
        nanoseconds: int = self._library.subject_push_sparse(
            self._subject,
            _address(indices),
            _address(points),
            len(indices),
            _address(self.completed),
            len(self.completed),
        )
        return 1e-9 * nanoseconds
