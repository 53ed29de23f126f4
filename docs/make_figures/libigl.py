"""The closest rival that can be had ready-made, for one figure."""

import importlib

import numpy as np

from dynmesh.reproduce.measure import Floats
from dynmesh.reproduce.methods import Faces
from dynmesh.sequence import Mask, Positions


class Harmonic:
    """``igl.harmonic`` on motion vectors, with the operator of frame 0."""

    def __init__(self, faces: Faces, first_frame: Positions, *, order: int) -> None:
        """`order`: 1 harmonic, 2 biharmonic. ImportError without libigl."""
        self._igl = importlib.import_module("igl")
        self._first = first_frame.astype(np.float64)
        self._faces = faces.astype(np.int64)
        self._order = order
        self.completed: Floats = self._first

    def complete(self, points: Positions, known: Mask) -> Floats:
        """Completes the next frame."""
        places = np.flatnonzero(known)
        motion = (points - self.completed)[known]
        self.completed = self.completed + self._igl.harmonic(
            self._first, self._faces, places, motion, self._order
        )
        self.completed[known] = points[known]
        return self.completed
