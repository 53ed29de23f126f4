"""Errors of completed frames (section 4 of the paper, "Metrics")."""

import numpy as np

from ._checks import as_array
from ._core import ErrorSummary, nmsve, summary, vertex_error
from .sequence import Positions

__all__ = ["ErrorSummary", "bounding_box_diagonal", "nmsve", "summary", "vertex_error"]


def bounding_box_diagonal(frame: Positions) -> float:
    """Returns the length of the diagonal of the axis-aligned bounding box of a (k, 3) frame."""
    points = np.asarray(as_array("frame", frame), np.float64)
    return float(np.linalg.norm(np.ptp(points, axis=0)))
