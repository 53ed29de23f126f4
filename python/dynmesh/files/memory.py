"""A sequence in memory, as a reader and as a writer."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..attributes import flags_of
from ..sequence import Positions, Sequence
from .frame import Frame
from .header import Header
from .reader import Reader


class SequenceReader(Reader):
    """A sequence in memory that is read like a file."""

    def __init__(self, sequence: Sequence, name: str = "sequence") -> None:
        """Takes a sequence, and the name that stands for the file in messages."""
        self._sequence = sequence
        self._rows: dict[str, Any] = sequence.attributes()
        n_frames, n_vertices, _ = sequence.vertices.shape
        what = {**flags_of(self._rows), **sequence.described()}
        header = Header(sequence.faces, n_frames, n_vertices, sequence.vertices.dtype, **what)
        super().__init__(Path(name), header, files=())

    def _frames(self, numbers: range) -> Iterator[Frame]:
        for number in numbers:
            rows = {name: rows[number] for name, rows in self._rows.items()}
            yield Frame(self._sequence.vertices[number], **rows)


class Collected:
    """What a writer would write, as arrays."""

    def __init__(self, header: Header) -> None:
        """Begins a sequence with this header."""
        self.header = header
        shape = (header.n_frames, header.n_vertices)
        self._next = 0
        self._vertices = np.empty((*shape, 3), header.dtype)
        self._values: dict[str, Any] = {
            name: np.empty(shape, row.dtype) for name, row in header.attributes.items()
        }

    def append(self, points: Positions, **values: NDArray[Any]) -> None:
        """Takes the next frame, with the attributes of the header."""
        self._vertices[self._next] = points
        for name, given in values.items():
            self._values[name][self._next] = given
        self._next += 1

    def sequence(self) -> Sequence:
        """The sequence, after its last frame."""
        header = self.header
        return Sequence(self._vertices, header.faces, **self._values, **header.described())
