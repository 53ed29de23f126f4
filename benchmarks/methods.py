"""The methods whose speed is measured: those of every comparison, and what only concerns speed."""

import numpy as np

from dynmesh.sequence import Mask, Positions
from dynmesh.study.completion import Completion, Faces, Method
from dynmesh.study.methods import DETAIL, MOTION, dynmesh_method

from .baselines import BASELINES, COPY, HARMONIC, SCIPY
from .compiled import CppMethod


class CppCompletion(Completion):
    """A method in C++, which also measures the time there, without Python in between."""

    def __init__(
        self, faces: Faces, first_frame: Positions, constant: str = "", factor: float = 1.0
    ) -> None:
        """Build the method; the arguments are those of `CppMethod`."""
        first = np.ascontiguousarray(first_frame, np.float32)
        self._method = CppMethod(np.ascontiguousarray(faces, np.int32), first, constant, factor)

    def complete(self, points: Positions, known: Mask) -> Positions:
        """Complete the next frame."""
        completed = self._method.push(points, known)
        self.seconds = self._method.seconds
        return completed


def varied_detail(constant: str, factor: float) -> Method:
    """Return method detail with one of its constants multiplied by a factor."""
    name = f"detail, {constant} x {factor:g}"
    return Method(
        name,
        name,
        DETAIL.colour,
        "--",
        lambda faces, first: CppCompletion(faces, first, constant, factor),
    )


TWO_THREADS = dynmesh_method(
    "motion_two_threads", "motion, two threads", "#56b4e9", "--", method="motion", threads=2
)
PLAIN = Method("plain", "plain C++", "#e69f00", "-", CppCompletion)

FAST = (MOTION, TWO_THREADS, PLAIN, COPY)
SLOW = (DETAIL, SCIPY, HARMONIC, *BASELINES)
"""The methods that solve a system for each frame. They take ten to two thousand times as long."""

SHARED_FROM = 23_553
"""The number of vertices from which on method motion uses more than one thread."""

ALL = (*FAST, *SLOW)
ON_ONE_THREAD = tuple(method for method in ALL if method is not TWO_THREADS)
BY_KEY = {method.key: method for method in ALL}
