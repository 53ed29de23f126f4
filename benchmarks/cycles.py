"""The error of a sequence that is played once, or again and again."""

from collections.abc import Iterator
from itertools import islice

import numpy as np

import dynmesh
from dynmesh.metrics import bounding_box_diagonal
from dynmesh.settings import Settings


def error_of_cycles(
    sequence: dynmesh.Sequence, share: float, settings: Settings, *, cycles: int = 1, seed: int = 0
) -> Iterator[float]:
    """The mean NMSVE of each cycle, its first frame left out, in bounding-box diagonals of frame 0.

    Vertices are known at random, `share` of them, picked anew in each frame.
    """
    truth = sequence.vertices.astype(np.float64)
    truth = truth / bounding_box_diagonal(truth[0])
    n_frames, n_vertices, _ = truth.shape
    masks = dynmesh.degrade.random_known(cycles * n_frames, n_vertices, share, seed=seed)
    frames = (frame for _ in range(cycles) for frame in truth)
    completed = dynmesh.complete(sequence.faces, frames, masks, **settings)
    for _ in range(cycles):
        cycle = np.stack(list(islice(completed, n_frames)))
        yield float(dynmesh.metrics.nmsve(sequence.faces, truth[1:], cycle[1:]).mean())
