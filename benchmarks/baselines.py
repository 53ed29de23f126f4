"""What other libraries offer in place of dynmesh, a plain copy, and variants of the methods.

Each works online: a frame is completed from its known vertices and from the frame that the same
method completed last. All but ARAP complete the motion since that frame, which is more accurate
than completing positions. To add a baseline, define it here and add it to `BASELINES`; it is then
part of every comparison.
"""

from functools import partial

import numpy as np
from scipy.sparse.linalg import spsolve

from dynmesh import cells
from dynmesh.matrices import laplacian
from dynmesh.sequence import Mask, Positions
from dynmesh.study.completion import Completion, Faces, Method
from dynmesh.study.methods import dynmesh_method

from .libigl import Arap, Harmonic


class Scipy(Completion):
    """`spsolve` of the uniform graph Laplacian of the unknown vertices, on motion vectors."""

    def __init__(self, faces: Faces, first_frame: Positions) -> None:
        """Build the Laplacian of all vertices."""
        self._laplacian = laplacian(faces, len(first_frame))
        self._completed = first_frame.astype(np.float64)

    def complete(self, points: Positions, known: Mask) -> Positions:
        """Complete the next frame."""
        motion = points[known] - self._completed[known]
        rows = self._laplacian[~known]
        solution = np.asarray(spsolve(rows[:, ~known].tocsc(), -(rows[:, known] @ motion)))
        completed = self._completed.copy()
        completed[known] = points[known]
        # spsolve returns a vector if a single vertex is unknown.
        completed[~known] += solution.reshape(-1, 3)
        self._completed = completed
        return completed


class Copy(Completion):
    """Copies the data that a frame must at least touch: points, previous frame, mask and cells."""

    def __init__(self, faces: Faces, first_frame: Positions) -> None:
        """Allocate the copies."""
        _, self._neighbours = cells(faces, len(first_frame))
        self._previous = first_frame.copy()
        self._completed = first_frame.copy()
        known = np.zeros(len(first_frame), bool)
        self._copies = first_frame.copy(), self._neighbours.copy(), known

    def complete(self, points: Positions, known: Mask) -> Positions:
        """Copy the data; no vertex is completed."""
        previous, neighbours, mask = self._copies
        np.copyto(self._completed, points)
        np.copyto(previous, self._previous)
        np.copyto(neighbours, self._neighbours)
        np.copyto(mask, known)
        return self._completed


SCIPY = Method("scipy", "harmonic on motion (SciPy)", "#009e73", "--", Scipy)
COPY = Method("copy", "copy of the bytes", "#888888", "--", Copy, completes=False)
HARMONIC = Method(
    "harmonic_on_motion", "harmonic on motion (libigl)", "#cc3311", "--", partial(Harmonic, order=1)
)
BIHARMONIC = Method(
    "biharmonic_on_motion",
    "biharmonic on motion (libigl)",
    "#000000",
    "--",
    partial(Harmonic, order=2),
)
ARAP = Method("arap", "ARAP (libigl)", "#332288", "--", partial(Arap, rest="first"))
ARAP_FROM_PREVIOUS = Method(
    "arap_from_previous",
    "ARAP from the previous frame (libigl)",
    "#f0e442",
    "--",
    partial(Arap, rest="previous"),
)

BASELINES = (BIHARMONIC, ARAP)
"""The baselines that every comparison includes, in this order."""

ONCE = dynmesh_method(
    "once_only", "motion, once only", "#56b4e9", "--", method="motion", revisit=False
)
"""The other reading of the paper's equation 4."""


def trained(key: str, label: str, training: Positions) -> Method:
    """Return method detail after training, (n, k, 3) complete frames of the same mesh."""
    return dynmesh_method(key, label, "#882255", "-", training, method="detail")
