"""Landmarks in files."""

from pathlib import Path
from typing import Any

import numpy as np

from .._checks import check_integer, check_vector
from .._errors import InputError, naming, within
from ..registration import Landmarks
from ..scans.cameras import json_in


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
