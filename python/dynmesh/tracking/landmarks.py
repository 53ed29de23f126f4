"""Landmarks in files."""

from pathlib import Path
from typing import Any

import numpy as np

from ..files.naming import naming
from ..registration import Landmarks
from ..scans.cameras import json_in


def read_landmarks(path: Path) -> Landmarks:
    """Reads the landmarks of a JSON file.

    Raises:
        OSError: it cannot be read.
        ValueError: it is not as :func:`register_file` describes; the message names the landmark.
    """
    with naming(path):
        given = json_in(path)
        if not isinstance(given, list) or not given:
            raise ValueError("must be a list of landmarks, with at least one")
        rows = [_landmark(number, one) for number, one in enumerate(given)]
    return np.array([vertex for vertex, _ in rows]), np.array([place for _, place in rows])


def _landmark(number: int, given: Any) -> tuple[int, list[float]]:
    if not isinstance(given, dict) or given.keys() != {"vertex", "position"}:
        raise ValueError(
            f"landmark {number} must have a vertex and a position and nothing else, not {given!r}"
        )
    vertex, position = given["vertex"], given["position"]
    if isinstance(vertex, bool) or not isinstance(vertex, int) or not 0 <= vertex < 2**31:
        raise ValueError(f"landmark {number}: the vertex must be an index, not {vertex!r}")
    is_place = isinstance(position, list) and len(position) == 3
    if not is_place or not all(
        isinstance(x, int | float) and not isinstance(x, bool) for x in position
    ):
        raise ValueError(f"landmark {number}: the position must be three numbers, not {position!r}")
    return vertex, [float(x) for x in position]
