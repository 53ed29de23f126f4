"""The trips of a completer to the ends of a window and back, and what they find."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .. import _arrays
from .._arrays import Floats, Mask
from ..baselines import LaplacianInterpolation
from ..completer import Completer
from ..topology import components_of
from .window import Lengths, Mesh, Window, deviation_of


def known_parts(mesh: Mesh, window: Window) -> tuple[Floats, Mask]:
    """The known vertices of the base, and which these are.

    A component of which it knows fewer than four vertices comes from the frame that knows most of
    them, moved rigidly to the vertices that both frames know.
    """
    k = window.known.shape[1]
    component = components_of(mesh.edges, k)
    fixed = window.known[window.base].copy()
    positions = np.where(fixed[:, None], window.positions[window.base], 0).astype(np.float64)
    most = here = np.bincount(component[fixed], minlength=k)
    best = np.full(k, window.base)
    for t, known in enumerate(window.known):
        count = np.bincount(component[known], minlength=k)
        better = (here < 4) & (count > most)
        best, most = np.where(better, t, best), np.where(better, count, most)
    for t in np.unique(best[best != window.base]):
        taken = window.known[t] & ~fixed & (best[component] == t)
        positions[taken] = _moved_to_base(window, int(t), taken)
        fixed |= taken
    return positions, fixed


def _moved_to_base(window: Window, t: int, taken: Mask) -> Floats:
    """Vertices of a frame, moved rigidly by the vertices that it and the base know (Kabsch 1976).

    Where these lie on a line, the rotation is not determined, and they are shifted.
    """
    both = window.known[t] & window.known[window.base]
    points: Floats = window.positions[t][taken].astype(np.float64)
    if not both.any():
        return points
    there, here = (window.positions[i][both].astype(np.float64) for i in (t, window.base))
    arms = points - there.mean(axis=0)
    left, spread, right = np.linalg.svd((here - here.mean(axis=0)).T @ (there - there.mean(axis=0)))
    if spread[1] > 1e-10 * spread[0]:
        left[:, 2] *= np.sign(np.linalg.det(left @ right))
        arms = arms @ (left @ right).T
    return np.asarray(arms + here.mean(axis=0))


def _smooth_fill(mesh: Mesh, positions: Floats, fixed: Mask) -> Floats:
    """Solves L^2 x = 0 for the vertices that are not fixed, where L is the uniform Laplacian.

    Components without any fixed vertex shrink to the mean of the fixed vertices, as nothing is
    known of them.
    """
    middle = positions[fixed].mean(axis=0)
    from_middle = np.where(fixed[:, None], positions - middle, 0)
    fill = LaplacianInterpolation(mesh.triangles, len(positions))
    filled = middle + fill.complete(from_middle, fixed | (mesh.edges_to(fixed) < 0))
    return np.asarray(np.where(fixed[:, None], positions, filled))


@dataclass(frozen=True)
class Attempt:
    """The base as the last trips to both sides found it, y, the weighted mean of their y_q.

    Attributes:
        positions: y.
        disagreement: the mean of |y_q - y|^2 / 3.
        error_of_sides: the mean of s_q^2, infinity where all are.
        deviation: how far edges with an end that is not known are from their usual length.
        is_doubtful: whether that is more than rounding, smoothing and the motion explain.
        seen: (k,) which vertices the frames know of which it is made.
    """

    positions: Floats
    disagreement: Floats
    error_of_sides: Floats
    deviation: float
    is_doubtful: bool
    seen: Mask

    def is_better(self, other: "Attempt") -> bool:
        """Whether its edges are clearly nearer to their usual length."""
        return self.deviation < 0.8 * other.deviation


_Side = tuple[Floats, Floats, Mask]
"""The base as a trip found it, standard errors, and which vertices it or these frames know."""


def completed_base(
    mesh: Mesh,
    window: Window,
    usual: Lengths,
    settings: dict[str, Any],
    show: Callable[[int, int], None],
) -> Attempt:
    """Completes the base by trips from a smooth fill, with what they learn from the frames.

    If the result is doubtful, also without; if that is hardly better than the fill, returns it.
    """
    known = window.known[window.base]
    k = len(known)
    start = _smooth_fill(mesh, *known_parts(mesh, window))
    fill = _combined([(start, np.zeros(k), np.ones(k, np.bool_))], mesh, usual, known, known)
    sides = [range(window.base, -1, -1), range(window.base, len(window.numbers))]
    sides = [side for side in sides if len(side) > 1]
    if not sides or (known.all() and settings["noise"] is None):
        return fill  # there is nothing to improve
    # At least five trips, and on short ways so many that they complete 300 frames, but no more than
    # fifteen; the last one goes where the first did.
    per_trip = sum(2 * (len(side) - 1) // len(sides) for side in sides)
    n_trips = min(max(-(-300 // per_trip), 5), 15) | 1
    trips = [sides[trip % len(sides)] for trip in range(n_trips)]
    n_steps = sum(2 * (len(side) - 1) for side in trips)
    done = 0

    def attempt(learn: bool, n_all: int) -> Attempt:
        nonlocal done
        frame = _arrays.packed(start, window.positions.dtype)
        completer = Completer(mesh.triangles, frame, learn=learn, uncertainty=True, **settings)
        results: dict[range, _Side] = {}
        for side in trips:
            for way in (side[1:], side[-2::-1]):
                completer.reset(frame)
                for t in way:
                    show(done, n_all)
                    done += 1
                    frame = completer.push(window.positions[t], window.known[t])
            errors = completer.standard_error.astype(np.float64)
            results[side] = (frame.astype(np.float64), errors, window.seen(side))
        return _combined(list(results.values()), mesh, usual, known, window.seen())

    best = attempt(True, n_steps)
    if not best.is_doubtful:
        return best
    other = attempt(False, 2 * n_steps)
    best = other if other.is_better(best) else best
    return best if not best.is_doubtful or best.is_better(fill) else replace(fill, is_doubtful=True)


def _combined(sides: list[_Side], mesh: Mesh, usual: Lengths, known: Mask, seen: Mask) -> Attempt:
    """The mean of the sides with weights s_q^(-3/2), where s_q is the standard error.

    A millionth of that if the vertex was never seen on that side, and equal where no side is
    better. The exponent would be -2 if standard errors were exact.
    """
    found, errors, on_side = (np.stack(arrays) for arrays in zip(*sides, strict=True))
    with np.errstate(divide="ignore", invalid="ignore"):
        weights = np.where(on_side, 1, 1e-6) * errors**-1.5
        total = weights.sum(axis=0)
        # Both sides know the vertex exactly, or neither knows anything of it.
        is_equal = ~(total > 0) | np.isinf(total)
        weights = np.where(is_equal, 1 / len(sides), weights / total)
        positions = (weights[..., None] * found).sum(axis=0)
        difference = ((found - positions) ** 2).sum(axis=2) / 3
        disagreement = np.where(weights > 0, weights * difference, 0).sum(axis=0)
        of_sides = np.where(weights > 0, weights * errors**2, 0).sum(axis=0)
    deviation, expected = deviation_of(mesh, usual, positions, known)
    return Attempt(
        positions,
        disagreement,
        of_sides,
        deviation,
        deviation > max(0.05, 3 * expected) or expected > 0.5,
        seen,
    )


def standard_errors(
    mesh: Mesh, known: Mask, usual: Lengths, made: Attempt, has_noise: bool
) -> Floats:
    """(k,) the standard errors.

    0.92 sqrt(0.3 S + D) sqrt(r) (1 + 2 / min(u, 20)), with D the disagreement and S the error of
    the sides, where r is the number of edges to the nearest vertex that the frame knows, and u that
    to the nearest one that no frame knows, 20 if there is none. For such a vertex itself, it is at
    least 2.5 times that without the last factor, and at least 0.5 h min(r', 6)^0.85, where h is the
    typical length of an edge and r' the number of edges to the nearest vertex that any frame knows.
    Infinity for disconnected vertices. Known vertices have 0, or with noise the root of S.
    """
    to_known, to_seen = mesh.edges_to(known), mesh.edges_to(made.seen)
    to_unseen = mesh.edges_to(~made.seen)
    to_unseen = np.where(to_unseen < 0, 20, np.clip(to_unseen, 1, 20))
    typical_length = np.exp(np.nan_to_num(usual.typical().median))
    guessed = 0.5 * typical_length * np.clip(to_seen, 0, 6) ** 0.85
    of_sides = made.error_of_sides
    with np.errstate(invalid="ignore"):  # infinity times 0, at disconnected vertices
        error = 0.92 * np.sqrt(0.3 * of_sides + made.disagreement) * np.sqrt(to_known)
        errors = np.where(made.seen, error * (1 + 2 / to_unseen), np.maximum(2.5 * error, guessed))
    errors[to_known < 0] = np.inf
    errors[known] = np.sqrt(of_sides[known]) if has_noise else 0
    return np.asarray(errors)
