"""The methods of dynmesh and those that the paper compares with."""

from collections.abc import Callable
from typing import Unpack

from .._core import Completer, LaplacianInterpolation, LeastSquaresMesh
from ..sequence import Mask, Positions
from ..settings import Settings
from .completion import Completion, Faces, Method

Baseline = LaplacianInterpolation | LeastSquaresMesh


class _Streaming(Completion):
    """A dynmesh completer that writes each frame to the same array."""

    def __init__(
        self,
        faces: Faces,
        first_frame: Positions,
        settings: Settings,
        training: Positions | None,
    ) -> None:
        self._completer = Completer(faces, first_frame, training=training, **settings)
        self._completed = first_frame.copy()

    @property
    def iterations(self) -> int:
        return self._completer.report.iterations

    @property
    def prior_weight(self) -> float:
        return self._completer.report.prior_weight

    def complete(self, points: Positions, known: Mask) -> Positions:
        return self._completer.push(points, known, out=self._completed)


class _Baseline(Completion):
    """Completes each frame alone, as in the paper, or the motion since the last completed frame."""

    def __init__(self, system: Baseline, previous: Positions | None) -> None:
        self._system = system
        self._previous = previous

    def complete(self, points: Positions, known: Mask) -> Positions:
        completed = self._system.complete(points, known, previous=self._previous)
        if self._previous is not None:
            self._previous = completed
        return completed


def dynmesh_method(
    key: str,
    label: str,
    colour: str,
    dash: str,
    training: Positions | None = None,
    **settings: Unpack[Settings],
) -> Method:
    """Return a method that is a dynmesh completer with some settings and training frames."""
    return Method(
        key,
        label,
        colour,
        dash,
        lambda faces, first: _Streaming(faces, first, settings, training),
    )


def _alone(make: Callable[[Faces, int], Baseline]) -> Callable[[Faces, Positions], Completion]:
    return lambda faces, first: _Baseline(make(faces, len(first)), None)


def _on_motion(make: Callable[[Faces, int], Baseline]) -> Callable[[Faces, Positions], Completion]:
    return lambda faces, first: _Baseline(make(faces, len(first)), first)


def _harmonic(faces: Faces, n_vertices: int) -> LaplacianInterpolation:
    return LaplacianInterpolation(faces, n_vertices, objective="harmonic")


MOTION = dynmesh_method("motion", "motion (dynmesh)", "#0072b2", "-", method="motion")
DETAIL = dynmesh_method("detail", "detail (dynmesh)", "#cc79a7", "-", method="detail")
LIA = Method("lia", "LIA, least squares", "#d55e00", "-", _alone(LaplacianInterpolation))
LIA_HARMONIC = Method("lia_harmonic", "LIA, harmonic", "#e69f00", "-", _alone(_harmonic))
LSM = Method("lsm", "LSM", "#009e73", "-", _alone(LeastSquaresMesh))
LIA_ON_MOTION = Method(
    "lia_on_motion", "LIA on motion", "#d55e00", "--", _on_motion(LaplacianInterpolation)
)
LSM_ON_MOTION = Method(
    "lsm_on_motion", "LSM on motion", "#009e73", "--", _on_motion(LeastSquaresMesh)
)

COMPARED = (MOTION, DETAIL, LIA, LIA_HARMONIC, LSM, LIA_ON_MOTION, LSM_ON_MOTION)
"""Both methods of dynmesh, and the baselines of the paper, also applied to motion."""
