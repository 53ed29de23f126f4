"""What other libraries offer in place of dynmesh, and a plain copy.

All but those in `OFFLINE` work online: a frame is completed from its known vertices and from the
frame that the same method completed last. All but ARAP complete the motion since that frame, which
is more accurate than completing positions. To add a baseline, define it here and add it to
`BASELINES` or `OFFLINE`; it then appears in `dynmesh reproduce`, one of `BASELINES` also in
`script/bench` and `python -m benchmarks.methods_table`.
"""

from functools import partial

import numpy as np

from .._core import cells
from .._extras import require
from ..matrices import laplacian
from ..sequence import Mask, Positions
from .completion import Completion, Faces, Method, OfflineMethod
from .libigl import Arap, Harmonic
from .matrix_completion import complete_at_once
from .methods import DETAIL


class Scipy(Completion):
    """`spsolve` of the uniform graph Laplacian of the unknown vertices, on motion vectors."""

    def __init__(self, faces: Faces, first_frame: Positions) -> None:
        """Build the Laplacian of all vertices.

        Raises:
            ImportError: SciPy is not installed.
        """
        self._solve = require("scipy.sparse.linalg", extra="reproduce").spsolve
        self._laplacian = laplacian(faces, len(first_frame))
        self._first = first_frame.astype(np.float64)
        self.reset()

    def reset(self) -> None:
        """Begin again with frame 0."""
        self._completed = self._first

    def complete(self, points: Positions, known: Mask) -> Positions:
        """Complete the next frame."""
        motion = points[known] - self._completed[known]
        rows = self._laplacian[~known]
        solution = self._solve(rows[:, ~known].tocsc(), -(rows[:, known] @ motion))
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
    "harmonic_on_motion",
    "harmonic on motion (libigl)",
    "#cc3311",
    "--",
    lambda faces, first: Harmonic(faces, first, order=1),
)
BIHARMONIC = Method(
    "biharmonic_on_motion",
    "biharmonic on motion (libigl)",
    "#000000",
    "--",
    lambda faces, first: Harmonic(faces, first, order=2),
)
ARAP = Method(
    "arap",
    "ARAP (libigl)",
    "#332288",
    "--",
    lambda faces, first: Arap(faces, first, rest="first"),
)
ARAP_FROM_PREVIOUS = Method(
    "arap_from_previous",
    "ARAP from the previous frame (libigl)",
    "#f0e442",
    "--",
    lambda faces, first: Arap(faces, first, rest="previous"),
)

MATRIX_COMPLETION = OfflineMethod(
    "matrix_completion", "matrix completion, offline", complete_at_once
)
GRAPH_COMPLETION = OfflineMethod(
    "graph_completion",
    "matrix completion with the graph, offline",
    partial(complete_at_once, smoothness=(0.01, 0.1, 1.0)),
)

OFFLINE = (MATRIX_COMPLETION, GRAPH_COMPLETION)
"""The baselines that see all frames at once."""

BASELINES = (BIHARMONIC, ARAP)
"""The baselines that every comparison includes, in this order."""

BEYOND = (DETAIL, *BASELINES)
"""The methods of the evaluation that the paper does not have."""
