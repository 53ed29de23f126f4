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
        self.tracker = dynmesh.Tracker(self.faces, self.vertices)
        self.tracker.push(self.vertices, np.tile([0.0, 0, 1], (49, 1)))
        self.folder = folder
        vertices = np.stack([self.vertices, self.points, self.points])
        self.sequence = dynmesh.Sequence(vertices, self.faces, fps=30.0)

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
            [stream.state() for stream in (self.completer, self.single, self.tracker)],
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
    error: type[Exception] | tuple[type[Exception], ...]
    names: tuple[str, ...]

    def answer(self, world: World) -> Exception:
        """Runs the case in the folder of the world and returns its error."""
        with contextlib.chdir(world.folder):
            try:
                result = self.run(world)
            except Exception as error:
                return error
        raise AssertionError(f"{self.call}, {self.given}: was accepted, and gave {result!r}")


class Printed(Exception):  # noqa: N818 (no error of this project)
    """The message of an error that is printed instead of raised."""


def of(call: str) -> Callable[..., Case]:
    """Makes cases of one call."""

    def case(given: str, run: Callable[[World], Any], error: type[Exception], *names: str) -> Case:
        return Case(call, given, run, error, names)

    return case


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
