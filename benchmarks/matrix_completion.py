"""Matrix completion, the other school that the paper names: all frames at once, with low rank.

The displacements from frame 0 are a matrix with a row for each coordinate of each frame and a
column for each vertex. If parts move rigidly, its rank is low: at most four for each part. The
entries of unknown vertices are those of the matrix X that minimises

    1/2 |P (X - M)|^2 + a |X|_* + b/2 tr(X L X^T),

where P keeps the known entries, |X|_* is the nuclear norm, the sum of the singular values, and L is
the uniform graph Laplacian of the mesh, divided by the mean valence. Without the last term this is
soft-impute (Mazumder, Hastie and Tibshirani 2010) for the problem of Candes and Recht (2012); with
it, graph-regularised matrix completion as Vlachos, Lalos, Moustakas and Berberidis (2017) use it on
animated meshes. The minimum is found by proximal gradients with momentum and restarts.

On a galloping horse, the positions themselves instead of displacements, and a row for each frame
instead of each coordinate, had larger errors. fancyimpute, which has soft-impute, is maintained
only barely, by its own words, and has no graph term; NumPy needs a few lines for both. This method
sees the frames after a frame as well as those before it, so it cannot work live.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array, linalg

from dynmesh.matrices import laplacian
from dynmesh.sequence import Mask, Positions
from dynmesh.study.completion import Faces

Floats = NDArray[np.float64]
T = TypeVar("T", bound=np.generic)

_FIRST_WEIGHT = 0.2  # of a, relative to the largest singular value of the known entries
_WEIGHT_RATIO = 5.0  # from one a to the next
_LEAST_WEIGHT = 2e-4
_STEPS = 40  # for each a, from the solution for the last one
_LAST_STEPS = 100  # with the entries that were held out
_RISE = 1.05  # of the error of the held-out entries, at which no smaller a is tried
_SETTLED = 1e-5  # the relative change of X at which a solution ends


@dataclass
class _Problem:
    """What stays the same while a solution is sought.

    Attributes:
        displacement: M, (3n, k).
        graph: L, (k, k), a sparse matrix.
        stiffness: at least the largest eigenvalue of L.
    """

    displacement: Floats
    graph: csr_array[np.float64]
    stiffness: float

    def solve(self, start: Floats, kept: Floats, a: float, b: float, steps: int) -> Floats:
        """Return X, from a start; `kept` is P, (3n, k) of zeros and ones."""
        step = 1 / (1 + b * self.stiffness)
        x, ahead, momentum = start, start, 1.0
        for _ in range(steps):
            gradient = kept * (ahead - self.displacement)
            if b > 0:
                gradient += b * np.asarray(self.graph @ ahead.T).T
            last, x = x, shrunk(ahead - step * gradient, a * step)
            change = x - last
            if np.vdot(ahead - x, change) > 0:  # the momentum leads uphill
                momentum = 1.0
            following = (1 + np.sqrt(1 + 4 * momentum**2)) / 2
            ahead = x + (momentum - 1) / following * change
            momentum = following
            if np.linalg.norm(change) <= _SETTLED * np.linalg.norm(x):
                break
        return x


def shrunk(matrix: Floats, by: float) -> Floats:
    """Reduce the singular values of a matrix by a number, to not less than zero.

    The eigenvectors of the product of the rows are the left singular vectors. Singular values below
    1e-8 of the largest are lost in rounding.
    """
    if matrix.shape[0] > matrix.shape[1]:
        return shrunk(matrix.T, by).T
    squares, vectors = np.linalg.eigh(matrix @ matrix.T)
    values = np.sqrt(np.clip(squares, 0, None))
    kept = values > max(by, 1e-8 * values[-1])
    vectors = vectors[:, kept]
    result: Floats = (vectors * (1 - by / values[kept])) @ (vectors.T @ matrix)
    return result


def complete_at_once(
    faces: Faces,
    vertices: Positions,
    known: Mask,
    held_out: Mask,
    smoothness: Iterable[float] = (0.0,),
) -> Positions:
    """Complete all frames of a sequence at once.

    a and b are those that estimate best some known entries that are held out, of a number of values
    of a, each a fifth of the last, and of the given values of b. Then the solution is continued
    with all entries that are known.

    Args:
        faces: (m, 3) vertex indices.
        vertices: (n, k, 3) positions; those of unknown vertices are not used, and may be NaN.
        known: (n, k) bool. In frame 0, all vertices are known.
        held_out: (n, k) bool; known vertices among these are held out. In frame 0, none are.
        smoothness: the values of b; 0 leaves out the graph term.

    Returns:
        (n, k, 3) float64; known vertices are as given.

    Raises:
        ValueError: no known vertex is held out, so that nothing can be chosen.
    """
    held_out = held_out & known
    if not held_out.any():
        raise ValueError("held_out: holds no known vertex")
    problem = _problem(faces, vertices, known)
    tested = _rows(np.broadcast_to(held_out[..., None], vertices.shape))
    everything = _rows(np.broadcast_to(known[..., None], vertices.shape)).astype(np.float64)
    without = np.where(tested, 0, everything)
    kept = without * problem.displacement
    scale = np.sqrt(np.linalg.eigvalsh(kept @ kept.T)[-1])
    best, chosen = np.inf, (np.zeros_like(without), 0.0, 0.0)
    for b in smoothness:
        x, a, least = np.zeros_like(without), _FIRST_WEIGHT * scale, np.inf
        while a > _LEAST_WEIGHT * scale:
            x = problem.solve(x, without, a, b, _STEPS)
            error = float(np.linalg.norm((x - problem.displacement)[tested]))
            if error < best:
                best, chosen = error, (x, a, b)
            least = min(least, error)
            if error > _RISE * least:
                break
            a /= _WEIGHT_RATIO
    x, a, b = chosen
    x = problem.solve(x, everything, a, b, _LAST_STEPS)
    first = vertices[0].astype(np.float64)
    estimated = x.reshape(len(vertices), 3, -1).transpose(0, 2, 1) + first
    return np.where(known[..., None], vertices, estimated)


def _problem(faces: Faces, vertices: Positions, known: Mask) -> _Problem:
    graph = laplacian(faces, vertices.shape[1])
    graph.data /= max(float(graph.diagonal().mean()), 1.0)
    stiffness = linalg.norm(graph, np.inf)  # bounds the largest eigenvalue
    moved = np.where(known[..., None], vertices - vertices[0].astype(np.float64), 0.0)
    return _Problem(_rows(moved), graph, float(stiffness))


def _rows(frames: NDArray[T]) -> NDArray[T]:
    """Return (n, k, c) values with a row for each coordinate of each frame, (c n, k)."""
    return np.ascontiguousarray(frames.transpose(0, 2, 1)).reshape(-1, frames.shape[1])
