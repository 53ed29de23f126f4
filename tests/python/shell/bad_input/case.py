"""A case of bad input, and the objects that it uses."""

import contextlib
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from meshes import sheet, turned

import dynmesh


class World:
    """A small mesh with 49 vertices, a sequence of it, and a folder of files."""

    def __init__(self, folder: Path) -> None:
        mesh = sheet(7)
        self.faces: Any = mesh.faces
        self.vertices: Any = mesh.vertices
        self.points: Any = turned(mesh.vertices, 0.2)
        self.known: Any = np.arange(49) % 3 != 0
        self.completer = self.make()
        self.completer.push(turned(mesh.vertices, 0.1), self.known)
        self.single = dynmesh.Completer(self.faces, self.vertices.astype(np.float32))
        self.cameras = dynmesh.losses.orbit(self.vertices, 1)
        self.folder = folder
        vertices = np.stack([self.vertices, self.points, self.points])
        self.sequence = dynmesh.Sequence(vertices, self.faces, fps=30.0)
        self.empty: Any = np.zeros((0, 3))

    def make(self, **settings: Any) -> dynmesh.Completer:
        """Creates a completer of this mesh."""
        return dynmesh.Completer(self.faces, self.vertices, **settings)

    def with_value(self, value: float, row: int = 4) -> Any:
        """Returns the points with one coordinate replaced."""
        points = self.points.copy()
        points[row, 1] = value
        return points

    def snapshot(self) -> Any:
        """Returns everything that a refused call must leave unchanged."""
        arrays = (self.faces, self.vertices, self.points, self.known)
        files = {path: path.stat() for path in sorted(self.folder.rglob("*"))}
        return (
            self.completer.state(),
            self.single.state(),
            [array.tobytes() for array in arrays],
            [(str(path), stat.st_size, stat.st_mtime_ns) for path, stat in files.items()],
        )


@dataclass(frozen=True)
class Case:
    """A call with bad input.

    Attributes:
        call: the called function.
        given: what is wrong, in words.
        run: makes the call.
        error: the class of the expected error; subclasses are accepted.
        names: what the message must contain: the argument, the place, the value.
    """

    call: str
    given: str
    run: Callable[[World], Any]
    error: type[Exception]
    names: tuple[str, ...]

    def answer(self, world: World) -> Exception:
        """Runs the case in the folder of the world and returns its error.

        Raises:
            AssertionError: nothing.
        """
        with contextlib.chdir(world.folder):
            try:
                result = self.run(world)
            except Exception as error:
                return error
        raise AssertionError(f"{self.call}, {self.given}: was accepted, and gave {result!r}")


class Printed(Exception):  # noqa: N818 (no error of this project)
    """The message of an error that is printed or returned instead of raised."""


@contextlib.contextmanager
def without_rights() -> Iterator[None]:
    """Drops the rights of a superuser for a while."""
    if os.geteuid() != 0:
        yield
        return
    os.seteuid(65534)  # the user nobody
    try:
        yield
    finally:
        os.seteuid(0)


def _others(faces: Any) -> dict[str, Any]:
    """Faces that are not these; all but the last have the same edges."""
    flipped = faces.copy()
    flipped[3] = flipped[3, ::-1]
    begun_elsewhere = faces.copy()
    begun_elsewhere[3] = np.roll(faces[3], 1)
    return {
        "with a flipped one": flipped,
        "all turned over": faces[:, ::-1],
        "in reverse order": faces[::-1],
        "one of which begins at another corner": begun_elsewhere,
        "one of which is missing": faces[1:],
    }


OTHER_FACES = _others(sheet(7).faces)
"""By how they differ from those of a World."""
