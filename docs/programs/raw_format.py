"""A file format of its own."""

import numpy as np

from dynmesh import Sequence
from dynmesh.formats import Format


def read(path):
    """Returns a sequence."""
    with path.open("rb") as file:
        n, k, m = np.fromfile(file, np.int32, 3)
        faces = np.fromfile(file, np.int32, 3 * m).reshape(m, 3)
        return Sequence(np.fromfile(file, np.float32).reshape(n, k, 3), faces)


def write(path, header, frames):
    """Writes the frames one after another."""
    with path.open("wb") as file:
        np.int32([header.n_frames, header.n_vertices, len(header.faces)]).tofile(file)
        header.faces.astype(np.int32).tofile(file)
        for frame in frames:
            frame.points.tofile(file)


raw = Format("raw", (".raw",), read, write)
