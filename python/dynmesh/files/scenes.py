"""Files that hold several meshes, each with constant faces."""

from collections.abc import Mapping

import numpy as np

from .._errors import InputError
from ..polygons import Polygons


def choose_mesh(meshes: Mapping[str, bool], prim: str | None) -> str:
    """Chooses a mesh by its path, else the only one that moves, else the only one."""
    if not meshes:
        raise ValueError("contains no polygon mesh")
    if prim is not None:
        if prim not in meshes:
            raise InputError(
                f"has no mesh {prim!r}; the meshes are {some_of(list(meshes))}",
                argument="prim",
                value=prim,
            )
        return prim
    candidates = [path for path, moves in meshes.items() if moves] or list(meshes)
    if len(candidates) > 1:
        raise InputError(
            f"contains several meshes; choose one by its path: {some_of(candidates)}",
            argument="prim",
        )
    return candidates[0]


def some_of(paths: list[str], most: int = 10) -> str:
    """Joins paths to a list, which is cut off if it is long."""
    rest = [f"and {len(paths) - most} more"] if len(paths) > most else []
    return ", ".join(paths[:most] + rest)


def check_same_faces(first: Polygons, later: Polygons, when: str) -> None:
    """Raises an error, with `when`, unless later faces equal those of the first frame."""
    if not all(np.array_equal(one, other) for one, other in zip(first, later, strict=True)):
        raise ValueError(
            f"{when}: the faces differ from those of the first frame, but must not change"
        )
