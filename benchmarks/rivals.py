"""dynmesh, and what one could use in its place, each as its user would call it.

All of them work online: a frame is completed from its known vertices and from the frame that the
same method completed before it. The rivals complete the motion since that frame, which serves them
better than completing positions.
"""

import time
from collections.abc import Callable
from typing import Any, Protocol, Unpack

import numpy as np
from scipy.sparse.linalg import spsolve

import dynmesh
from dynmesh.sequence import Mask
from dynmesh.settings import Settings
from dynmesh.study.libigl import Arap, Harmonic

from .scenes import Frames, Scene
from .subjects import CppSubject


class Method(Protocol):
    """A way to complete the frames of a scene."""

    @property
    def completed(self) -> Any:
        """The last frame, (k, 3); what it holds is overwritten by the next."""

    def reset(self) -> None:
        """Begins again with frame 0."""

    def complete(self, points: Frames, known: Mask) -> float:
        """Completes the next frame; returns the seconds that the method itself took."""


class Dynmesh:
    """``push`` with ``out=``, from Python."""

    def __init__(self, scene: Scene, **settings: Unpack[Settings]) -> None:
        """ValueError for more threads than this version knows."""
        self._first = scene.frames[0]
        self.completer = dynmesh.Completer(scene.faces, self._first, **settings)
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


class Libigl:
    """`dynmesh.study.libigl`, each call whole."""

    def __init__(self, rival: Harmonic | Arap) -> None:
        """Takes the one to time."""
        self._rival = rival

    @property
    def completed(self) -> Any:
        """As the protocol."""
        return self._rival.completed

    def reset(self) -> None:
        """As the protocol."""
        self._rival.reset()

    def complete(self, points: Frames, known: Mask) -> float:
        """As the protocol."""
        start = time.perf_counter()
        self._rival.complete(points, known)
        return time.perf_counter() - start


DYNMESH = "dynmesh"
TWO_THREADS = "dynmesh, two threads"
DETAIL = "dynmesh, detail"
PLAIN = "plain C++"
COPY = "copy of the bytes"
SCIPY = "SciPy spsolve"
HARMONIC = "libigl harmonic, k = 1"
BIHARMONIC = "libigl harmonic, k = 2"
ARAP = "libigl ARAP"

FAST: dict[str, Callable[[Scene], Method]] = {
    DYNMESH: Dynmesh,
    TWO_THREADS: lambda scene: Dynmesh(scene, threads=2),
    PLAIN: Plain,
    COPY: Copy,
}
SLOW: dict[str, Callable[[Scene], Method]] = {
    DETAIL: lambda scene: Dynmesh(scene, method="detail"),
    SCIPY: Scipy,
    HARMONIC: lambda scene: Libigl(Harmonic(scene.faces, scene.frames[0], order=1)),
    BIHARMONIC: lambda scene: Libigl(Harmonic(scene.faces, scene.frames[0], order=2)),
    ARAP: lambda scene: Libigl(Arap(scene.faces, scene.frames[0], rest="first")),
}
"""Those that solve for a frame, and take tens to thousands of times as long."""

SHARED_FROM = 23_553
"""Vertices from which on method motion uses more than one thread."""
ALL = (*FAST, *SLOW)
ON_ONE_THREAD = tuple(name for name in ALL if name != TWO_THREADS)


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
