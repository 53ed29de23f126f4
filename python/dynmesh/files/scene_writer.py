"""The interface of the writers of scenes: several meshes in one file."""

from abc import abstractmethod
from pathlib import Path
from typing import ClassVar, Unpack

from ..frames.header import Header
from ..frames.scenes import Origin
from .writer import Unfinished, Writer


class SceneWriter(Writer):
    """A file that is being written and can hold several meshes, one after another.

    Attributes:
        origin: the scene that the file is made from; None if it holds the meshes alone.
        keeps_scene_of: the format whose scenes the writer keeps around the meshes; None if none.
    """

    keeps_scene_of: ClassVar[str | None] = None

    def __init__(
        self,
        path: Path,
        header: Header,
        *,
        origin: Origin | None = None,
        **unfinished: Unpack[Unfinished],
    ) -> None:
        """Creates the file with its first mesh; see :class:`Writer`."""
        self.origin = origin
        super().__init__(path, header, **unfinished)

    def next_mesh(self, header: Header) -> None:
        """Begins another mesh, after all frames of the one before.

        Raises:
            OSError: the mesh cannot be written.
            ValueError: frames of the mesh before are missing.
        """
        self._check_whole()
        self.header, self._frame = header, 0
        with self._blaming():
            self._begin_mesh()

    @abstractmethod
    def _begin_mesh(self) -> None:
        """Begins the mesh of the header."""
