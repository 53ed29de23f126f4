"""What libigl offers in dynmesh's place, made to work online.

Each frame is completed from its known vertices, of which every connected part of the mesh needs
one, and from the frame completed last; in double precision, as libigl is, and in one thread.

Needs libigl, of the extra `reproduce`.
"""

import os
from types import ModuleType
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from .._extras import require
from ..sequence import Mask, Positions

Faces = NDArray[np.integer[Any]]
Floats = NDArray[np.float64]


class Harmonic:
    """``igl.harmonic`` on motion vectors, with the operator of frame 0.

    Attributes:
        completed: the last completed frame, (k, 3) float64.
    """

    def __init__(self, faces: Faces, first_frame: Positions, *, order: int) -> None:
        """`order`: 1 harmonic, 2 biharmonic. ImportError without libigl."""
        self._igl = load_libigl()
        self._faces = np.array(faces, np.int64)
        self._first = np.array(first_frame, np.float64)
        self._order = order
        self.reset()

    def reset(self) -> None:
        """Begins again with frame 0."""
        self.completed = self._first

    def complete(self, points: Positions, known: Mask) -> Floats:
        """Completes the next frame; RuntimeError where libigl cannot."""
        places = np.flatnonzero(known)
        given = points[known] - self.completed[known]
        motion = self._igl.harmonic(self._first, self._faces, places, given, self._order)
        self.completed = _checked(self.completed + motion, points, known)
        return self.completed


class Arap:
    """``igl.ARAP``, as rigid as possible, begun at the last completed frame.

    Attributes:
        completed: the last completed frame, (k, 3) float64.
    """

    def __init__(
        self, faces: Faces, first_frame: Positions, *, rest: Literal["first", "previous"]
    ) -> None:
        """`rest`: the frame whose shape is kept. ImportError without libigl."""
        self._igl = load_libigl()
        self._faces = np.array(faces, np.int64)
        self._first = np.array(first_frame, np.float64)
        self._rest = rest
        self.reset()

    def reset(self) -> None:
        """Begins again with frame 0."""
        self.completed = self._first

    def complete(self, points: Positions, known: Mask) -> Floats:
        """Completes the next frame; RuntimeError where libigl cannot.

        The known vertices are part of what libigl factors, so that is done anew in each frame.
        """
        places = np.flatnonzero(known).astype(np.int32)
        given = points[known].astype(np.float64)
        rest = self._first if self._rest == "first" else self.completed
        data = self._igl.ARAPData()
        self._igl.arap_precomputation(rest, self._faces, 3, places, data)
        completed: Floats = self._igl.arap_solve(given, data, self.completed)
        self.completed = _checked(completed, points, known)
        return self.completed


def load_libigl() -> ModuleType:
    """libigl, or an ImportError that names the extra which installs it."""
    # libigl would take all cores for some of its steps, and reads this once.
    os.environ.setdefault("IGL_NUM_THREADS", "1")
    return require("igl", extra="reproduce")


def _checked(completed: Floats, points: Positions, known: Mask) -> Floats:
    """Known vertices exactly as given, and only finite values."""
    if not np.isfinite(completed).all():
        raise RuntimeError("its solution is not finite")
    completed[known] = points[known]
    return completed
