"""The interface of the writers of scenes: several meshes in one file."""

from abc import abstractmethod

from ..frames.header import Header
from .writer import Writer


class SceneWriter(Writer):
    """A file that is being written and can hold several meshes, one after another."""

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
