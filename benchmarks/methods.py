"""The methods that are compared: those of dynmesh, of the paper, and of other libraries.

Each works online: a frame is completed from its known vertices and from the frame that the same
method completed last. What is called "on motion" completes the motion since that frame, which is
more accurate than completing positions. To add a method, define it here; in `BASELINES` it becomes
part of every comparison.
"""

import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from typing import Any, Literal, Protocol, Unpack

import numpy as np
from numpy.typing import NDArray

from dynmesh import Completer
from dynmesh.baselines import LaplacianInterpolation, LeastSquaresMesh
from dynmesh.sequence import Mask, Positions
from dynmesh.settings import Settings

Faces = NDArray[np.integer[Any]]
Floats = NDArray[np.float64]


class Completion(Protocol):
    """A method that completes one sequence, frame by frame."""

    @property
    def iterations(self) -> int:
        """The number of iterations of the last frame, or 0 if the method does not iterate."""
        return 0

    def complete(self, points: Positions, known: Mask) -> Positions:
        """Complete the next frame. The next call may overwrite the returned array.

        Raises:
            RuntimeError: the method cannot complete this frame.
        """


@dataclass(frozen=True, eq=False)
class Method:
    """A method and how it is shown.

    Attributes:
        label: the name in tables and figures.
        colour: the colour in figures, chosen so that colour-blind readers can tell it from others.
        dash: "--" for methods of other libraries and variants that the paper does not have, or "-".
        begin: a function of the faces and frame 0 that returns a new completion. It raises
            ImportError if a library is missing, and ValueError if the method cannot run here.
    """

    label: str
    colour: str
    dash: str
    begin: Callable[[Faces, Positions], Completion]


class _Streaming(Completion):
    """A dynmesh completer that writes each frame to the same array."""

    def __init__(
        self, settings: Settings, training: Positions | None, faces: Faces, first_frame: Positions
    ) -> None:
        self._completer = Completer(faces, first_frame, training=training, **settings)
        self._completed = first_frame.copy()

    @property
    def iterations(self) -> int:
        return self._completer.report.iterations

    def complete(self, points: Positions, known: Mask) -> Positions:
        return self._completer.push(points, known, out=self._completed)


def dynmesh_method(
    label: str,
    colour: str,
    dash: str,
    training: Positions | None = None,
    **settings: Unpack[Settings],
) -> Method:
    """Return a method that is a dynmesh completer with some settings and training frames."""
    return Method(label, colour, dash, partial(_Streaming, settings, training))


class _OfThePaper(Completion):
    """Completes each frame alone, as in the paper, or the motion since the last completed frame."""

    def __init__(
        self,
        make: Callable[[Faces, int], LaplacianInterpolation | LeastSquaresMesh],
        on_motion: bool,
        faces: Faces,
        first_frame: Positions,
    ) -> None:
        self._system = make(faces, len(first_frame))
        self._previous = first_frame if on_motion else None

    def complete(self, points: Positions, known: Mask) -> Positions:
        completed = self._system.complete(points, known, previous=self._previous)
        if self._previous is not None:
            self._previous = completed
        return completed


class _Libigl(Completion):
    """What the methods of libigl share. Every connected part of the mesh needs a known vertex.

    Raises:
        ImportError: libigl is not installed.
    """

    def __init__(self, faces: Faces, first_frame: Positions) -> None:
        self._faces = np.array(faces, np.int64)
        self._first = self._completed = np.array(first_frame, np.float64)
        # libigl would use all cores for some of its steps. It reads this variable when it first
        # runs.
        os.environ.setdefault("IGL_NUM_THREADS", "1")
        self._igl = import_module("igl")

    def _accept(self, completed: Floats, points: Positions, known: Mask) -> Floats:
        """Remember a frame, with the known vertices exactly as given."""
        if not np.isfinite(completed).all():
            raise RuntimeError("its solution is not finite")
        completed[known] = points[known]
        self._completed = completed
        return completed


class Biharmonic(_Libigl):
    """``igl.harmonic`` with k = 2 on motion vectors, with the operator of frame 0."""

    def complete(self, points: Positions, known: Mask) -> Floats:
        """Complete the next frame."""
        given = points[known] - self._completed[known]
        at = np.flatnonzero(known)
        motion = self._igl.harmonic(self._first, self._faces, at, given, 2)
        return self._accept(self._completed + motion, points, known)


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
        rest = self._first if self._rest == "first" else self._completed
        data = self._igl.ARAPData()
        self._igl.arap_precomputation(rest, self._faces, 3, vertices, data)
        completed: Floats = self._igl.arap_solve(given, data, self._completed)
        return self._accept(completed, points, known)


_HARMONIC_LIA = partial(LaplacianInterpolation, objective="harmonic")

MOTION = dynmesh_method("motion (dynmesh)", "#0072b2", "-", method="motion")
DETAIL = dynmesh_method("detail (dynmesh)", "#cc79a7", "-", method="detail")
LIA = Method(
    "LIA, least squares", "#d55e00", "-", partial(_OfThePaper, LaplacianInterpolation, False)
)
LIA_HARMONIC = Method("LIA, harmonic", "#e69f00", "-", partial(_OfThePaper, _HARMONIC_LIA, False))
LSM = Method("LSM", "#009e73", "-", partial(_OfThePaper, LeastSquaresMesh, False))
LIA_ON_MOTION = Method(
    "LIA on motion", "#d55e00", "--", partial(_OfThePaper, LaplacianInterpolation, True)
)
LSM_ON_MOTION = Method(
    "LSM on motion", "#009e73", "--", partial(_OfThePaper, LeastSquaresMesh, True)
)
COMPARED = (MOTION, DETAIL, LIA, LIA_HARMONIC, LSM, LIA_ON_MOTION, LSM_ON_MOTION)
"""Both methods of dynmesh, and the baselines of the paper, also applied to motion."""

BIHARMONIC = Method("biharmonic on motion (libigl)", "#000000", "--", Biharmonic)
ARAP = Method("ARAP (libigl)", "#332288", "--", partial(Arap, rest="first"))
ARAP_FROM_PREVIOUS = Method(
    "ARAP from the previous frame (libigl)", "#f0e442", "--", partial(Arap, rest="previous")
)
BASELINES = (BIHARMONIC, ARAP)
"""What libigl offers, in every comparison."""

ONCE = dynmesh_method("motion, once only", "#56b4e9", "--", method="motion", revisit=False)
"""The other reading of the paper's equation 4."""


def trained(training: Positions) -> Method:
    """Return method detail after training, (n, k, 3) complete frames of the same mesh."""
    return dynmesh_method("detail, trained", "#882255", "-", training, method="detail")
