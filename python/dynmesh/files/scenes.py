"""What formats share that hold a whole scene: one mesh of many, frames in time, float32."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ..polygons import Polygons
from ..sequence import Positions


def choose_mesh(meshes: Mapping[str, bool], prim: str | None) -> str:
    """Chooses a mesh by its path, or the only one that moves, or the only one.

    Args:
        meshes: the paths of all meshes, and whether the points of each change.
        prim: the path that was asked for, or None.
    """
    if not meshes:
        raise ValueError("holds no mesh of polygons")
    if prim is not None:
        if prim not in meshes:
            raise ValueError(f"has no mesh '{prim}', but {_listed(list(meshes))}")
        return prim
    candidates = [path for path, moves in meshes.items() if moves] or list(meshes)
    if len(candidates) > 1:
        raise ValueError(f"holds several meshes; choose one with --prim: {_listed(candidates)}")
    return candidates[0]


def _listed(paths: list[str], most: int = 10) -> str:
    rest = [f"and {len(paths) - most} more"] if len(paths) > most else []
    return ", ".join(paths[:most] + rest)


def spacing(times: Sequence[float]) -> float | None:
    """How far apart the times are; None where there is only one or they are not even."""
    if len(times) < 2:
        return None
    step = (times[-1] - times[0]) / (len(times) - 1)
    return float(step) if np.allclose(np.diff(times), step, rtol=1e-6, atol=0) else None


def check_same_faces(first: Polygons, later: Polygons, time: float) -> None:
    """Refuses faces that are others than in the first frame."""
    if not all(np.array_equal(one, other) for one, other in zip(first, later, strict=True)):
        raise ValueError(
            f"time {time:g}: the faces are others than in the first frame, but they must stay"
        )


def rounded(points: Positions, number: int) -> NDArray[np.float32]:
    """The points of frame `number` as float32; refuses what is beyond its range."""
    with np.errstate(over="ignore"):
        single = np.ascontiguousarray(points, np.float32)
    beyond = (np.isinf(single) & np.isfinite(points)).any(axis=1)
    if beyond.any():
        vertex = int(beyond.argmax())
        raise ValueError(
            f"frame {number}: vertex {vertex} at {points[vertex].tolist()} "
            "is out of the range of float32, which is what the format holds"
        )
    return single
