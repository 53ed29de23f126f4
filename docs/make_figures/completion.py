"""Built-in sequences, degraded and completed, with all that the pictures show of them."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import dynmesh
from dynmesh.sequence import Mask, Positions
from dynmesh.study.subjects import Subject


@dataclass(frozen=True, eq=False)
class Completed:
    """A completed frame and what is known about it; errors in bounding-box diagonals."""

    points: Positions
    known: Mask
    generation: NDArray[np.int32]
    age: NDArray[np.int32]
    error: NDArray[np.float64]
    nmsve: float


def complete(
    subject: Subject, masks: Iterable[Mask], *, whole_every: int | None = None, **settings: Any
) -> list[Completed]:
    """Completes the frames after the first; entry i is frame i + 1."""
    completer = dynmesh.Completer(subject.faces, subject.vertices[0], **settings)
    rows = []
    for number, known in enumerate(masks):
        if number == 0:
            continue
        whole = whole_every is not None and number % whole_every == 0
        observed = np.full(subject.n_vertices, True) if whole else known
        points = completer.push(subject.vertices[number], observed)
        rows.append((points, observed, completer.generation.copy(), completer.age.copy()))
    truth, completed = subject.vertices[1:], np.stack([points for points, *_ in rows])
    nmsve = dynmesh.metrics.nmsve(subject.faces, truth, completed) / subject.diagonal
    errors = dynmesh.metrics.vertex_error(truth, completed) / subject.diagonal
    return [
        Completed(*row, error, float(mean))
        for row, error, mean in zip(rows, errors, nmsve, strict=True)
    ]
