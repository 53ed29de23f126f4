"""Landmarks in files."""

from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import Positions
from .._checks import check_integer, check_vector
from .._errors import InputError, naming, within
from ..registration import Landmarks
from ..scans.cameras import json_in

_BETTER = 0.3
"""Landmarks are exchanged if exchanging them leaves so little of the squared distances."""
_ALIKE = 2.0
"""Of several pairs that leave at most so many times as much as the best, each may be meant: hands
that are exchanged look like feet that are, from behind."""


def read_landmarks(path: Path) -> Landmarks:
    """Reads the landmarks of a JSON file."""
    with naming(path):
        given = json_in(path)
        if not isinstance(given, list) or not given:
            raise InputError("must be a list of landmarks, with at least one")
        for number, one in enumerate(given):
            with within(f"landmark {number}"):
                _check(one)
    return (
        np.array([one["vertex"] for one in given]),
        np.array([one["position"] for one in given], np.float64),
    )


def _check(given: Any) -> None:
    if not isinstance(given, dict) or given.keys() != {"vertex", "position"}:
        raise InputError(f"must have a vertex and a position and nothing else, not {given!r}")
    check_integer("vertex", given["vertex"], 0, 2**31 - 1)
    check_vector("position", given["position"])


def exchanged(template: Positions, landmarks: Landmarks) -> str:
    """Says which landmarks are probably exchanged; empty if none are.

    Landmarks, other ones for two of them, and their mirror image are compared with the vertices of
    the template, (k, 3), after the best rigid motion of each (Kabsch 1976).
    """
    vertices, positions = landmarks
    ours, theirs = (
        np.asarray(points - points.mean(axis=0), np.float64)
        for points in (template[vertices], positions)
    )
    most = _BETTER * _residual(ours, theirs)
    left = {}
    for one, other in combinations(range(len(vertices)), 2):
        swapped = theirs.copy()
        swapped[[one, other]] = theirs[[other, one]]
        left[f"{vertices[one]} and {vertices[other]}"] = _residual(ours, swapped)
    least = min(left.values(), default=most)
    if len(vertices) > 3 and _residual(ours, -theirs) < min(most, least):
        return "left and right are probably exchanged in the landmarks"
    if least >= most:
        return ""
    pairs = [pair for pair, residual in left.items() if residual <= min(most, _ALIKE * least)]
    return f"the landmarks of vertices {', or of '.join(pairs)} are probably exchanged"


def _residual(ours: NDArray[np.float64], theirs: NDArray[np.float64]) -> float:
    """The sum of the squared distances after the best rotation around the common middle."""
    left, sizes, right = np.linalg.svd(ours.T @ theirs)
    sizes[2] *= np.sign(np.linalg.det(left @ right))
    return float((ours**2).sum() + (theirs**2).sum() - 2 * sizes.sum())
