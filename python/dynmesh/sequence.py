"""A dynamic mesh in memory, and what can be done with it."""

import contextlib
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from . import formats
from ._extras import require
from .arrays import ArrayFrames
from .computed import ComputedFrames
from .draw.notebook import shown
from .draw.page import Page
from .evaluation.report import Evaluation
from .formats import PathLike, Source, Written
from .frames import Frames, checked
from .polygons import as_polygons
from .verbs.complete import CompletionReport, complete
from .verbs.evaluate import evaluate
from .verbs.picture import picture
from .verbs.view import view

if TYPE_CHECKING:
    from PIL import Image


class Sequence(ArrayFrames):
    """Frames of one fixed connectivity, in memory.

    ``len(sequence)`` is the number of frames n, and iteration yields one :class:`dynmesh.Frame`
    after another. ``sequence[7]`` is frame 7, ``sequence[-1]`` the last one, and
    ``sequence[10:50:2]`` a Sequence of some of the frames, with their masks, generations and ages,
    which shares the arrays. The frames keep their numbers. NumPy takes a frame as its positions,
    (k, 3), and a sequence as its vertices, NaN where they are not known.

    In a notebook, a sequence shows itself: as a player that needs no network if the extra `view` is
    installed, with a simplified mesh and fewer frames if it is large, and as a table.

    Args:
        vertices: (n, k, 3) float32 or float64. Values are arbitrary where ``known`` is False.
        faces: (m, 3) integers, or other polygons, as :data:`dynmesh.polygons.Faces`.
        known: (n, k) bool, or None if every position was observed.

    :class:`dynmesh.arrays.ArrayFrames` documents these, the other attributes and the errors.
    """

    @classmethod
    def read(cls, path: PathLike | Frames, **source: Unpack[Source]) -> "Sequence":
        """Reads all frames of a file: see :func:`dynmesh.read`."""
        return read(path, **source)

    def write(self, path: PathLike, **options: Any) -> Written:
        """Writes the frames to a file: see :func:`dynmesh.write`."""
        return formats.write(path, self, **options)

    def complete(self, **options: Any) -> ComputedFrames[CompletionReport]:
        """Completes the frames: see :func:`dynmesh.complete`."""
        return complete(self, **options)

    def evaluate(self, reference: PathLike | Frames, **options: Any) -> Evaluation:
        """Measures the errors of the frames: see :func:`dynmesh.evaluate`."""
        return evaluate(self, reference, **options)

    def view(self, out: PathLike | None = None, **options: Any) -> Page:
        """Makes a page that plays the frames: see :func:`dynmesh.view`."""
        return view(self, out, **options)

    def picture(self, out: PathLike | None = None, **options: Any) -> "Image.Image":
        """Draws frames: see :func:`dynmesh.picture`."""
        return picture(self, out, **options)

    def to_pyvista(self, frame: int) -> Any:
        """Returns a frame as a `pyvista.PolyData`, NaN where it is not known."""
        result = self[frame]
        sizes, corners = as_polygons(self.faces, self.polygons)
        padded = np.insert(corners, np.cumsum(sizes) - sizes, sizes)
        mesh = require("pyvista", extra="view").PolyData(np.array(result), padded)
        for name, values in result.attributes().items():
            mesh.point_data[name] = values
        return mesh

    def to_trimesh(self, frame: int) -> Any:
        """Returns a frame as a `trimesh.Trimesh`, NaN where it is not known."""
        result = self[frame]
        return require("trimesh", extra="scans").Trimesh(
            np.array(result),
            np.array(self.faces),
            vertex_attributes=result.attributes(),
            process=False,
        )

    def _repr_html_(self) -> str:
        """A player or a table, as notebooks show it."""
        return shown(self)


def read(path: PathLike | Frames, **source: Unpack[Source]) -> Sequence:
    """Reads all frames into memory, of a file or of any others, as a verb makes them.

    The keywords and errors are those of :func:`dynmesh.open`.
    """
    with contextlib.ExitStack() as stack:
        frames = (
            path if isinstance(path, Frames) else stack.enter_context(formats.open(path, **source))
        )
        header = frames.header
        shape = (header.n_frames, header.n_vertices)
        vertices = np.empty((*shape, 3), header.dtype)
        values: dict[str, Any] = {
            name: np.empty(shape, row.dtype) for name, row in header.attributes.items()
        }
        for number, frame in enumerate(checked(frames)):
            vertices[number] = frame.points
            for name, rows in frame.attributes().items():
                values[name][number] = rows
        return Sequence(vertices, header.faces, **values, **header.described())
