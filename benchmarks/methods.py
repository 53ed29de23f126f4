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
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from dynmesh import Completer
from dynmesh._arrays import Mask, Positions
from dynmesh.baselines import LaplacianInterpolation, LeastSquaresMesh
from dynmesh.completer import Settings

Faces = NDArray[np.integer[Any]]
Floats = NDArray[np.float64]


Completion = Callable[[Positions, Mask], tuple[Positions, int]]
"""Completes the next frame of a sequence, from its points and known mask.

It returns the frame, which the next call may overwrite, and the number of iterations, 0 if the
method does not iterate. It raises RuntimeError if the method cannot complete this frame.
"""


@dataclass(frozen=True, eq=False)
class Method:
    """A method and how it is shown.

    Attributes:
        label: the name in tables and figures.
        colour: the colour in figures, chosen so that colour-blind readers can tell it from others.
        dash: "--" for methods of other libraries and variants that the paper does not have, or "-".
        begin: a function of the faces and frame 0 that begins a completion. It raises
            ImportError if a library is missing, and ValueError if the method cannot run here.
    """

    label: str
    colour: str
    dash: str
    begin: Callable[[Faces, Positions], Completion]


def _streaming(
    settings: Settings, training: Positions | None, faces: Faces, first_frame: Positions
) -> Completion:
    """A dynmesh completer that writes each frame to the same array."""
    completer = Completer(faces, first_frame, training=training, **settings)
    out = first_frame.copy()

    def complete(points: Positions, known: Mask) -> tuple[Positions, int]:
        return completer.push(points, known, out=out), completer.report.iterations

    return complete


def dynmesh_method(
    label: str,
    colour: str,
    dash: str,
    training: Positions | None = None,
    **settings: Unpack[Settings],
) -> Method:
    """Return a method that is a dynmesh completer with some settings and training frames."""
    return Method(label, colour, dash, partial(_streaming, settings, training))


def _of_the_paper(
    make: Callable[[Faces, int], LaplacianInterpolation | LeastSquaresMesh],
    on_motion: bool,
    faces: Faces,
    first_frame: Positions,
) -> Completion:
    """Completes each frame alone, as in the paper, or the motion since the last completed frame."""
    system = make(faces, len(first_frame))
    previous = first_frame if on_motion else None

    def complete(points: Positions, known: Mask) -> tuple[Positions, int]:
        nonlocal previous
        completed = system.complete(points, known, previous=previous)
        previous = completed if on_motion else None
        return completed, 0

    return complete


def _of_libigl(
    solve: Callable[[Any, NDArray[np.int64], Floats, Floats, Positions, Mask], Floats],
    faces: Faces,
    first_frame: Positions,
) -> Completion:
    """Completes each frame from the last one as `solve` does, with known vertices as given.

    Every connected part of the mesh needs a known vertex.
    """
    # libigl would use all cores for some of its steps. It reads this variable when it first runs.
    os.environ.setdefault("IGL_NUM_THREADS", "1")
    igl, triangles = import_module("igl"), np.array(faces, np.int64)
    first = last = np.array(first_frame, np.float64)

    def complete(points: Positions, known: Mask) -> tuple[Positions, int]:
        nonlocal last
        completed = solve(igl, triangles, first, last, points, known)
        if not np.isfinite(completed).all():
            raise RuntimeError("its solution is not finite")
        completed[known] = points[known]
        last = completed
        return completed, 0

    return complete


def _biharmonic(
    igl: Any, faces: Faces, first: Floats, last: Floats, points: Positions, known: Mask
) -> Floats:
    """``igl.harmonic`` with k = 2 on motion vectors, with the operator of frame 0."""
    motion = points[known] - last[known]
    return np.asarray(last + igl.harmonic(first, faces, np.flatnonzero(known), motion, 2))


def _arap(
    igl: Any, faces: Faces, rest: Floats, last: Floats, points: Positions, known: Mask
) -> Floats:
    """``igl.ARAP``, as rigid as possible, which preserves the shape of `rest`, from the last frame.

    The matrix that libigl factors depends on the known mask, so every frame needs a new one.
    """
    data = igl.ARAPData()
    igl.arap_precomputation(rest, faces, 3, np.flatnonzero(known).astype(np.int32), data)
    return np.asarray(igl.arap_solve(points[known].astype(np.float64), data, last))


def _arap_from_previous(
    igl: Any, faces: Faces, _: Floats, last: Floats, points: Positions, known: Mask
) -> Floats:
    return _arap(igl, faces, last, last, points, known)


_HARMONIC_LIA = partial(LaplacianInterpolation, objective="harmonic")

MOTION = dynmesh_method("motion (dynmesh)", "#0072b2", "-", method="motion")
DETAIL = dynmesh_method("detail (dynmesh)", "#cc79a7", "-", method="detail")
LIA = Method(
    "LIA, least squares", "#d55e00", "-", partial(_of_the_paper, LaplacianInterpolation, False)
)
LIA_HARMONIC = Method("LIA, harmonic", "#e69f00", "-", partial(_of_the_paper, _HARMONIC_LIA, False))
LSM = Method("LSM", "#009e73", "-", partial(_of_the_paper, LeastSquaresMesh, False))
LIA_ON_MOTION = Method(
    "LIA on motion", "#d55e00", "--", partial(_of_the_paper, LaplacianInterpolation, True)
)
LSM_ON_MOTION = Method(
    "LSM on motion", "#009e73", "--", partial(_of_the_paper, LeastSquaresMesh, True)
)
COMPARED = (MOTION, DETAIL, LIA, LIA_HARMONIC, LSM, LIA_ON_MOTION, LSM_ON_MOTION)
"""Both methods of dynmesh, and the baselines of the paper, also applied to motion."""

BIHARMONIC = Method(
    "biharmonic on motion (libigl)", "#000000", "--", partial(_of_libigl, _biharmonic)
)
ARAP = Method("ARAP (libigl)", "#332288", "--", partial(_of_libigl, _arap))
ARAP_FROM_PREVIOUS = Method(
    "ARAP from the previous frame (libigl)",
    "#f0e442",
    "--",
    partial(_of_libigl, _arap_from_previous),
)
BASELINES = (BIHARMONIC, ARAP)
"""What libigl offers, in every comparison."""

ONCE = dynmesh_method("motion, once only", "#56b4e9", "--", method="motion", revisit=False)
"""The other reading of the paper's equation 4."""


def trained(training: Positions) -> Method:
    """Return method detail after training, (n, k, 3) complete frames of the same mesh."""
    return dynmesh_method("detail, trained", "#882255", "-", training, method="detail")
