"""How far completed frames are from the truth (paper, section 4, "Metrics")."""

import numpy as np

from ._core import ErrorSummary, nmsve, summary, vertex_error
from .sequence import Positions

__all__ = ["ErrorSummary", "bounding_box_diagonal", "nmsve", "summary", "vertex_error"]


def bounding_box_diagonal(frame: Positions) -> float:
    """The length of the diagonal of a (k, 3) frame's axis-aligned bounding box."""
    return float(np.linalg.norm(np.ptp(frame.astype(np.float64), axis=0)))
