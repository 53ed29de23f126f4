"""The methods that are compared, behind one call."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from .._core import Completer, LaplacianInterpolation, LeastSquaresMesh
from ..sequence import Mask, Positions
from ..settings import Settings
from .libigl import Arap, Harmonic

Faces = NDArray[np.integer[Any]]


class Completion:
    """A method at work on one sequence.

    Attributes:
        complete: (points, known) -> the completed frame.
        iterations: -> of the last frame, where the method iterates; else 0.
    """

    def __init__(
        self,
        complete: Callable[[Positions, Mask], Positions],
        iterations: Callable[[], int] = lambda: 0,
    ) -> None:
        """Takes both calls."""
        self.complete = complete
        self.iterations = iterations


@dataclass(frozen=True)
class Method:
    """A method by name.

    Attributes:
        key: in results.json.
        label: in figures.
        colour: of the Okabe-Ito palette, which colour-blind readers can tell apart.
        dash: of its line: "--" for rivals that the paper does not have, "-" for the rest.
        begin: (faces, first frame) -> a completion.
    """

    key: str
    label: str
    colour: str
    dash: str
    begin: Callable[[Faces, Positions], Completion]


def _dynmesh(**settings: Unpack[Settings]) -> Callable[[Faces, Positions], Completion]:
    def begin(faces: Faces, first_frame: Positions) -> Completion:
        completer = Completer(faces, first_frame, **settings)
        return Completion(completer.push, lambda: completer.report.iterations)

    return begin


def _by_itself(
    make: Callable[[Faces, int], LaplacianInterpolation | LeastSquaresMesh],
) -> Callable[[Faces, Positions], Completion]:
    """Each frame without memory, as the paper uses the baselines."""

    def begin(faces: Faces, first_frame: Positions) -> Completion:
        return Completion(make(faces, len(first_frame)).complete)

    return begin


def _on_motion(
    make: Callable[[Faces, int], LaplacianInterpolation | LeastSquaresMesh],
) -> Callable[[Faces, Positions], Completion]:
    """The baseline on motion from the frame that it completed last."""

    def begin(faces: Faces, first_frame: Positions) -> Completion:
        system = make(faces, len(first_frame))
        previous: Positions = first_frame

        def complete(points: Positions, known: Mask) -> Positions:
            nonlocal previous
            previous = system.complete(points, known, previous=previous)
            return previous

        return Completion(complete)

    return begin


def _libigl(
    make: Callable[[Faces, Positions], Harmonic | Arap],
) -> Callable[[Faces, Positions], Completion]:
    """Positions in the precision in which they came."""

    def begin(faces: Faces, first_frame: Positions) -> Completion:
        completion = make(faces, first_frame)
        return Completion(
            lambda points, known: completion.complete(points, known).astype(first_frame.dtype)
        )

    return begin


def _harmonic(faces: Faces, n_vertices: int) -> LaplacianInterpolation:
    return LaplacianInterpolation(faces, n_vertices, objective="harmonic")


MOTION = Method("motion", "motion (dynmesh)", "#0072b2", "-", _dynmesh())
ONCE = Method("once_only", "motion, once only", "#56b4e9", "--", _dynmesh(revisit=False))
LIA = Method("lia", "LIA, least squares", "#d55e00", "-", _by_itself(LaplacianInterpolation))
HARMONIC = Method("lia_harmonic", "LIA, harmonic", "#e69f00", "-", _by_itself(_harmonic))
LSM = Method("lsm", "LSM", "#009e73", "-", _by_itself(LeastSquaresMesh))
LIA_ON_MOTION = Method(
    "lia_on_motion", "LIA on motion", "#d55e00", "--", _on_motion(LaplacianInterpolation)
)
LSM_ON_MOTION = Method(
    "lsm_on_motion", "LSM on motion", "#009e73", "--", _on_motion(LeastSquaresMesh)
)

COMPARED = (MOTION, LIA, HARMONIC, LSM, LIA_ON_MOTION, LSM_ON_MOTION)
"""The paper's comparison, and the same rivals with a memory."""

DETAIL = Method("detail", "detail (dynmesh)", "#cc79a7", "-", _dynmesh(method="detail"))
BIHARMONIC = Method(
    "biharmonic_on_motion",
    "biharmonic on motion (libigl)",
    "#000000",
    "--",
    _libigl(lambda faces, first: Harmonic(faces, first, order=2)),
)
ARAP = Method(
    "arap",
    "ARAP (libigl)",
    "#999999",
    "--",
    _libigl(lambda faces, first: Arap(faces, first, rest="first")),
)
ARAP_FROM_PREVIOUS = Method(
    "arap_from_previous",
    "ARAP from the previous frame (libigl)",
    "#f0e442",
    "--",
    _libigl(lambda faces, first: Arap(faces, first, rest="previous")),
)

BEYOND = (DETAIL, BIHARMONIC, ARAP)
"""What the paper does not have. Those of libigl need that library."""
