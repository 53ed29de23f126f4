"""Scenes: files that hold several meshes, each with constant faces."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ..polygons import Polygons
from .unchanged import Unchanged

every_mesh = "all"
"""What stands for every mesh of a scene that moves, instead of the path of one."""


class Scene(ABC):
    """A file with several meshes, opened once for all of them.

    Attributes:
        format: the name of its format.
        path: of the file.
        moves: the paths of the meshes, and whether the points of each change. Copies of a mesh by
            reference (instances) are not among them if the format cannot change a copy alone.
        unchanged: tells whether its files are what they were when it was opened.
    """

    format: ClassVar[str]

    def __init__(self, path: Path, moves: Mapping[str, bool]) -> None:
        """Called by subclasses when the file is open."""
        self.path = path
        self.moves = moves
        self.unchanged = Unchanged(self.files)

    @property
    @abstractmethod
    def files(self) -> list[Path]:
        """The files that are read."""

    @abstractmethod
    def times(self, mesh: str) -> list[float]:
        """The times of the frames of a mesh: time codes in USD, seconds in Alembic."""

    @abstractmethod
    def place(self, mesh: str, time: float) -> NDArray[np.float64]:
        """The matrix (4, 4) that takes points of a mesh, as rows, to their place in the scene."""


@dataclass(frozen=True)
class Origin:
    """The scene that a file is made from, and the paths of the meshes that the file replaces.

    It must stay open until the file is complete.
    """

    scene: Scene
    meshes: tuple[str, ...]


def choose_mesh(meshes: Mapping[str, bool], prim: str | None) -> str:
    """Chooses a mesh by its path, else the only one that moves, else the only one."""
    if not meshes:
        raise ValueError("contains no polygon mesh")
    if prim is not None:
        if prim == every_mesh:
            raise ValueError(
                "'all' stands for every mesh: dynmesh complete, convert, view and picture take "
                "--prim all, in Python complete_scene and convert_file; "
                f"here, choose one: {listed(list(meshes))}"
            )
        if prim not in meshes:
            raise ValueError(f"has no mesh '{prim}'; the meshes are {listed(list(meshes))}")
        return prim
    candidates = [path for path, moves in meshes.items() if moves] or list(meshes)
    if len(candidates) > 1:
        every = f"; dynmesh complete takes all of them with --prim {every_mesh}, to USD or Alembic"
        raise ValueError(
            f"contains several meshes; choose one with --prim: {listed(candidates)}"
            f"{every if any(meshes.values()) else ''}"
        )
    return candidates[0]


def listed(paths: list[str], most: int = 10) -> str:
    """Joins paths to a list, which is cut off if it is long."""
    rest = [f"and {len(paths) - most} more"] if len(paths) > most else []
    return ", ".join(paths[:most] + rest)


def check_same_faces(first: Polygons, later: Polygons, when: str) -> None:
    """Raises an error, with `when`, unless later faces equal those of the first frame."""
    if not all(np.array_equal(one, other) for one, other in zip(first, later, strict=True)):
        raise ValueError(
            f"{when}: the faces differ from those of the first frame, but must not change"
        )
