"""dynmesh, and what one could use in its place, each as its user would call it.

All of them work online: a frame is completed from its known vertices and from the frame that the
same method completed before it. The rivals complete the motion since that frame, which serves them
better than completing positions.
"""

import importlib
import os
import time
from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from scipy.sparse.linalg import spsolve

import dynmesh
from dynmesh.sequence import Mask

from .scenes import Frames, Scene
from .subjects import CppSubject

# libigl would take all cores for some of its steps.
os.environ.setdefault("IGL_NUM_THREADS", "1")


class Method(Protocol):
    """A way to complete the frames of a scene.

    Attributes:
        completed: the last frame, (k, 3); what it holds is overwritten by the next.
    """

    completed: Any

    def reset(self) -> None:
        """Begins again with frame 0."""

    def complete(self, points: Frames, known: Mask) -> float:
        """Completes the next frame; returns the seconds that the method itself took."""


class Dynmesh:
    """``push`` with ``out=``, from Python."""

    def __init__(self, scene: Scene, threads: int) -> None:
        """ValueError for more threads than this version knows."""
        self._first = scene.frames[0]
        self.completer = dynmesh.Completer(scene.faces, self._first, threads=threads)
        self.completed: Frames = self._first.copy()

    def reset(self) -> None:
        """As the protocol."""
        self.completer.reset(self._first)

    def complete(self, points: Frames, known: Mask) -> float:
        """As the protocol."""
        start = time.perf_counter()
        self.completer.push(points, known, out=self.completed)
        return time.perf_counter() - start


class Plain:
    """The C++ class that says the method in plain words."""

    def __init__(self, scene: Scene) -> None:
        """ImportError where the C++ part is not built."""
        self._first = scene.frames[0]
        self._subject = CppSubject(scene.faces, self._first, threads=0)
        self.completed = self._subject.completed
        self._only = np.zeros(1, np.int64)

    def reset(self) -> None:
        """As the protocol."""
        self._subject.reset(self._first)

    def complete(self, points: Frames, known: Mask) -> float:
        """As the protocol."""
        return float(self._subject.push(points[None], known[None], self._only)[0])


class Copy:
    """Copies what a frame must touch at least: points, previous frame, mask and cells."""

    def __init__(self, scene: Scene) -> None:
        """Makes room."""
        _, self._neighbours = dynmesh.cells(scene.faces, scene.n_vertices)
        self._previous = scene.frames[0].copy()
        self.completed: Frames = scene.frames[0].copy()
        self._rest = self._previous.copy(), self._neighbours.copy(), scene.masks["10 %"][0].copy()

    def reset(self) -> None:
        """Nothing to do."""

    def complete(self, points: Frames, known: Mask) -> float:
        """As the protocol, but nothing is completed."""
        previous, neighbours, mask = self._rest
        start = time.perf_counter()
        np.copyto(self.completed, points)
        np.copyto(previous, self._previous)
        np.copyto(neighbours, self._neighbours)
        np.copyto(mask, known)
        return time.perf_counter() - start


class Scipy:
    """``spsolve`` of the uniform graph Laplacian on motion vectors, cut to the unknown vertices."""

    def __init__(self, scene: Scene) -> None:
        """Builds the Laplacian of all vertices."""
        self._first = scene.frames[0].astype(np.float64)
        self._laplacian = dynmesh.laplacian(scene.faces, scene.n_vertices)
        self.completed = self._first

    def reset(self) -> None:
        """As the protocol."""
        self.completed = self._first

    def complete(self, points: Frames, known: Mask) -> float:
        """As the protocol."""
        motion = points[known] - self.completed[known]
        completed = self.completed.copy()
        start = time.perf_counter()
        rows = self._laplacian[~known]
        solution = spsolve(rows[:, ~known].tocsc(), -(rows[:, known] @ motion))
        seconds = time.perf_counter() - start
        completed[known] = points[known]
        completed[~known] += solution
        self.completed = completed
        return seconds


class Harmonic:
    """``igl.harmonic`` on motion vectors, with the operator of frame 0."""

    def __init__(self, scene: Scene, k: int) -> None:
        """`k`: 1 harmonic, 2 biharmonic. ImportError without libigl."""
        self._igl = importlib.import_module("igl")
        self._first = scene.frames[0].astype(np.float64)
        self._faces = scene.faces.astype(np.int64)
        self._k = k
        self.completed = self._first

    def reset(self) -> None:
        """As the protocol."""
        self.completed = self._first

    def complete(self, points: Frames, known: Mask) -> float:
        """As the protocol."""
        places = np.flatnonzero(known)
        motion = points[known] - self.completed[known]
        start = time.perf_counter()
        solution = self._igl.harmonic(self._first, self._faces, places, motion, self._k)
        seconds = time.perf_counter() - start
        self.completed = self.completed + solution
        return seconds


class Arap:
    """``igl.ARAP``: as rigid as possible from frame 0, begun at the last completed frame."""

    def __init__(self, scene: Scene) -> None:
        """ImportError without libigl."""
        self._igl = importlib.import_module("igl")
        self._first = scene.frames[0].astype(np.float64)
        self._faces = scene.faces.astype(np.int64)
        self.completed = self._first

    def reset(self) -> None:
        """As the protocol."""
        self.completed = self._first

    def complete(self, points: Frames, known: Mask) -> float:
        """As the protocol. The mask decides the factorisation, so that is made anew."""
        places = np.flatnonzero(known).astype(np.int32)
        given = points[known].astype(np.float64)
        data = self._igl.ARAPData()
        start = time.perf_counter()
        self._igl.arap_precomputation(self._first, self._faces, 3, places, data)
        completed = self._igl.arap_solve(given, data, self.completed)
        seconds = time.perf_counter() - start
        self.completed = completed
        return seconds


DYNMESH = "dynmesh"
TWO_THREADS = "dynmesh, two threads"
PLAIN = "plain C++"
COPY = "copy of the bytes"
SCIPY = "SciPy spsolve"
HARMONIC = "libigl harmonic, k = 1"
BIHARMONIC = "libigl harmonic, k = 2"
ARAP = "libigl ARAP"

FAST: dict[str, Callable[[Scene], Method]] = {
    DYNMESH: lambda scene: Dynmesh(scene, 1),
    TWO_THREADS: lambda scene: Dynmesh(scene, 2),
    PLAIN: Plain,
    COPY: Copy,
}
SLOW: dict[str, Callable[[Scene], Method]] = {
    SCIPY: Scipy,
    HARMONIC: lambda scene: Harmonic(scene, 1),
    BIHARMONIC: lambda scene: Harmonic(scene, 2),
    ARAP: Arap,
}


def prepare(
    scene: Scene,
    factories: dict[str, Callable[[Scene], Method]],
    wanted: list[str],
    missing: dict[str, str],
) -> dict[str, Method]:
    """The wanted methods that can run here; tells `missing` why the others cannot."""
    methods = {}
    for name, factory in factories.items():
        if name not in wanted:
            continue
        try:
            methods[name] = factory(scene)
        except (ImportError, ValueError) as error:
            missing[name] = str(error)
    return methods
