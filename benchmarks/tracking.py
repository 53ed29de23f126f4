"""The errors of tracking."""

import numpy as np
from numpy.typing import NDArray

from dynmesh.degrade.shared import mean_edge_of
from dynmesh.sequence import Positions

from .subjects import Subject


def errors(subject: Subject, tracked: Positions, truth: Positions) -> NDArray[np.float64]:
    """Return (k,) distances from the true vertices, in mean edges of frame 0 of a subject."""
    edge = mean_edge_of(subject.vertices[0], subject.faces)
    return np.asarray(np.linalg.norm(tracked - truth, axis=1) / edge)
