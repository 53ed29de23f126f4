"""The methods whose speed is measured: those of the study, and what only concerns speed."""

from collections.abc import Iterable

import numpy as np

from dynmesh.sequence import Mask, Positions
from dynmesh.study.baselines import BASELINES, COPY, HARMONIC, SCIPY
from dynmesh.study.completion import Completion, Faces, Method
from dynmesh.study.methods import DETAIL, MOTION, dynmesh_method

from .scenes import Scene
from .subjects import CppSubject


class CppCompletion(Completion):
    """A completer in C++, which also measures the time there, without Python in between."""

    def __init__(self, subject: CppSubject, first_frame: Positions) -> None:
        """Take the completer, which has been built with a frame 0."""
        self._subject = subject
        self._first = np.ascontiguousarray(first_frame, np.float32)
        self._single = np.zeros(1, np.int64)

    def reset(self) -> None:
        """Begin again with frame 0."""
        self._subject.reset(self._first)

    def complete(self, points: Positions, known: Mask) -> Positions:
        """Complete the next frame."""
        frame = np.ascontiguousarray(points[None], np.float32)
        (seconds,) = self._subject.push(frame, np.ascontiguousarray(known[None]), self._single)
        self.seconds = float(seconds)
        return self._subject.completed


def _cpp(
    faces: Faces, first_frame: Positions, threads: int, varied: tuple[str, float] | None = None
) -> CppCompletion:
    first = np.ascontiguousarray(first_frame, np.float32)
    subject = CppSubject(np.ascontiguousarray(faces, np.int32), first, threads, varied)
    return CppCompletion(subject, first)


def varied_detail(constant: str, factor: float) -> Method:
    """Return method detail with one of its constants multiplied by a factor."""
    return Method(
        f"detail, {constant} x {factor:g}",
        f"detail, {constant} x {factor:g}",
        DETAIL.colour,
        "--",
        lambda faces, first: _cpp(faces, first, 1, (constant, factor)),
    )


TWO_THREADS = dynmesh_method(
    "motion_two_threads", "motion, two threads", "#56b4e9", "--", method="motion", threads=2
)
PLAIN = Method(
    "plain", "plain C++", "#e69f00", "-", lambda faces, first: _cpp(faces, first, threads=0)
)

FAST = (MOTION, TWO_THREADS, PLAIN, COPY)
SLOW = (DETAIL, SCIPY, HARMONIC, *BASELINES)
"""The methods that solve a system for each frame. They take ten to two thousand times as long."""

SHARED_FROM = 23_553
"""The number of vertices from which on method motion uses more than one thread."""

ALL = (*FAST, *SLOW)
ON_ONE_THREAD = tuple(method for method in ALL if method is not TWO_THREADS)
BY_KEY = {method.key: method for method in ALL}


def begin(
    scene: Scene, methods: Iterable[Method], missing: dict[str, str]
) -> dict[str, Completion]:
    """Begin the methods that can run here, by key; `missing` gets the reasons of the others."""
    completions = {}
    for method in methods:
        try:
            completions[method.key] = method.begin(scene.subject.faces, scene.subject.vertices[0])
        except (ImportError, ValueError) as error:
            missing[method.label] = str(error)
    return completions
