"""What libigl offers in place of dynmesh, made to work online.

Each frame is completed from its known vertices and from the frame completed last, in double
precision and in one thread. Every connected part of the mesh needs a known vertex. libigl is
a dependency for development.
"""

import os
from importlib import import_module
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from dynmesh.sequence import Mask, Positions
from dynmesh.study.completion import Completion, Faces

Floats = NDArray[np.float64]


class _Libigl(Completion):
    """What the methods of libigl share: their arguments in its types, and the last frame.

    Attributes:
        completed: the last completed frame, (k, 3) float64.

    Raises:
        ImportError: libigl is not installed.
    """

    def __init__(self, faces: Faces, first_frame: Positions) -> None:
        # libigl would use all cores for some of its steps. It reads this variable when it first
        # runs.
        os.environ.setdefault("IGL_NUM_THREADS", "1")
        self._igl = import_module("igl")
        self._faces = np.array(faces, np.int64)
        self._first = np.array(first_frame, np.float64)
        self.completed = self._first

    def _accept(self, completed: Floats, points: Positions, known: Mask) -> Floats:
        """Remember a frame, with the known vertices exactly as given."""
        if not np.isfinite(completed).all():
            raise RuntimeError("its solution is not finite")
        completed[known] = points[known]
        self.completed = completed
        return completed


class Harmonic(_Libigl):
    """``igl.harmonic`` on motion vectors, with the operator of frame 0."""

    def __init__(self, faces: Faces, first_frame: Positions, *, order: int) -> None:
        """Prepare the harmonic field (`order` 1) or the biharmonic field (`order` 2)."""
        super().__init__(faces, first_frame)
        self._order = order

    def complete(self, points: Positions, known: Mask) -> Floats:
        """Complete the next frame."""
        vertices = np.flatnonzero(known)
        given = points[known] - self.completed[known]
        motion = self._igl.harmonic(self._first, self._faces, vertices, given, self._order)
        return self._accept(self.completed + motion, points, known)


class Arap(_Libigl):
    """``igl.ARAP``, as rigid as possible, starting from the last completed frame."""

    def __init__(
        self, faces: Faces, first_frame: Positions, *, rest: Literal["first", "previous"]
    ) -> None:
        """Prepare the method; `rest` is the frame whose shape is preserved."""
        super().__init__(faces, first_frame)
        self._rest = rest

    def complete(self, points: Positions, known: Mask) -> Floats:
        """Complete the next frame.

        The matrix that libigl factors depends on the known mask, so every frame needs a new one.
        """
        vertices = np.flatnonzero(known).astype(np.int32)
        given = points[known].astype(np.float64)
        rest = self._first if self._rest == "first" else self.completed
        data = self._igl.ARAPData()
        self._igl.arap_precomputation(rest, self._faces, 3, vertices, data)
        completed: Floats = self._igl.arap_solve(given, data, self.completed)
        return self._accept(completed, points, known)
