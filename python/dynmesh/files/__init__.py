"""Reading and writing sequences. Only this package depends on file formats.

Each format has a module with a reader and a writer. They process one frame at a time, so memory
does not grow with the length of a sequence. `reader.py` and `writer.py` document their common
interface.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from .._checks import check_path
from ..polygons import Polygons
from ..sequence import Sequence
from .choice import (
    PathLike,
    existing,
    format_of,
    formats,
    keeps_provenance,
    listed,
    new_folder,
    resumable,
    writer_of,
)
from .format import Template, template_of
from .header import Frame, Header
from .masks import MaskedReader
from .naming import naming
from .placing import finish_placing
from .reader import Reader
from .writer import Writer

__all__ = [
    "Frame",
    "Header",
    "PathLike",
    "Reader",
    "Writer",
    "begin",
    "create",
    "create_like",
    "existing",
    "finish_placing",
    "format_of",
    "formats",
    "keeps_provenance",
    "listed",
    "naming",
    "new_folder",
    "open",
    "read",
    "resumable",
    "write",
]


def open(
    path: PathLike,
    *,
    format: str | None = None,
    faces: NDArray[np.integer[Any]] | PathLike | None = None,
    prim: str | None = None,
    known: NDArray[np.bool_] | PathLike | None = None,
    missing: Literal["zero"] | None = None,
) -> Reader:
    """Opens a sequence to read it frame by frame, in constant memory.

    Args:
        path: a file, or a sequence in one file per frame: a pattern such as ``frame_%04d.ply``, a
            glob such as ``*.ply``, or a folder.
        format: one of :data:`dynmesh.files.formats`; None means the format of the suffix.
        faces: (m, 3) integers, or a file with the same mesh, for formats that hold only positions.
            None: from the file that :func:`write` put beside it.
        prim: the path of the mesh, if a file holds several (USD, Alembic).
        known: (n, k) bool, or a `.npy` file with it: known masks that replace those in `path`.
        missing: "zero" if positions of exactly (0, 0, 0) after frame 0 were not observed.

    Raises:
        OSError: the file cannot be opened.
        ImportError: the library for this format is not installed; the message names its extra.
        ValueError: the file is not a valid sequence; the message names the file and the problem.
    """
    check_path("path", path)
    path = Path(path)
    if missing not in (None, "zero"):
        raise ValueError(f"missing: must be 'zero' or None, not {missing!r}")
    with naming(path):
        reader = format_of(path, format).reader(path, _template(faces), prim)
    if known is None and missing is None:
        return reader
    try:
        return MaskedReader(reader, known, zero_is_missing=missing == "zero")
    except BaseException:
        reader.close()
        raise


def create(
    path: PathLike,
    *,
    faces: NDArray[np.integer[Any]],
    n_frames: int,
    n_vertices: int,
    dtype: np.dtype[Any],
    fps: float | None = None,
    polygons: Polygons | None = None,
    up_axis: str | None = None,
    name: str | None = None,
    start: float = 0,
    times: NDArray[np.float64] | None = None,
    metres_per_unit: float | None = None,
    with_known: bool = False,
    with_provenance: bool = False,
    derived: Mapping[str, str] | None = None,
    format: str | None = None,
) -> Writer:
    """Creates a file to which a sequence is written frame by frame, in constant memory.

    Args:
        path: an existing file is replaced when the new one is complete.
        faces: (m, 3) integers.
        n_frames: number of frames that will be appended.
        n_vertices: number of vertices of each frame.
        dtype: of the positions, float32 or float64.
        fps: frames per second, if known.
        polygons: the faces before they were cut into triangles, if not all of them were triangles.
        up_axis: "y" or "z", if known.
        name: path of the mesh in the file, for formats that can hold several.
        start: the number of the first frame in the file; see :class:`dynmesh.Sequence`.
        times: (n,) the number of each frame in the file, if they do not follow from `start`.
        metres_per_unit: length of a unit of the positions, if known.
        with_known: whether each frame is appended with its known mask.
        with_provenance: whether each frame is appended with generation and age.
        derived: what to compute from the positions; see :class:`dynmesh.Sequence`.
        format: one of :data:`dynmesh.files.formats`; None means the format of the suffix.

    Raises:
        OSError: the file cannot be written.
        ImportError: the library for this format is not installed; the message names its extra.
        TypeError, ValueError: an argument has the wrong kind or shape.
    """
    header = Header(
        faces, n_frames, n_vertices, np.dtype(dtype), fps, polygons, up_axis, name, start, times,
        metres_per_unit, with_known, with_provenance, derived,
    )  # fmt: skip
    return begin(path, header, format=format)


def begin(
    path: PathLike,
    header: Header,
    *,
    format: str | None = None,
    folder: Path | None = None,
    resume_at: int = 0,
) -> Writer:
    """Does the same as :func:`create` for a header; :class:`Writer` explains the other options."""
    check_path("path", path)
    path = Path(path)
    with naming(path):
        return writer_of(path, format)(path, header, folder=folder, resume_at=resume_at)


def create_like(
    reader: Reader,
    path: PathLike,
    *,
    with_known: bool = False,
    with_provenance: bool = False,
    format: str | None = None,
) -> Writer:
    """Creates a file for the sequence of `reader` with changes; see :func:`create`."""
    header = replace(reader.header, has_known=with_known, has_provenance=with_provenance)
    return begin(path, header, format=format)


def read(
    path: PathLike,
    *,
    format: str | None = None,
    faces: NDArray[np.integer[Any]] | PathLike | None = None,
    prim: str | None = None,
    known: NDArray[np.bool_] | PathLike | None = None,
    missing: Literal["zero"] | None = None,
) -> Sequence:
    """Reads a whole sequence into memory. The arguments and errors are those of :func:`open`."""
    with open(path, format=format, faces=faces, prim=prim, known=known, missing=missing) as reader:
        header = reader.header
        shape = (header.n_frames, header.n_vertices)
        vertices = np.empty((*shape, 3), header.dtype)
        known = np.empty(shape, np.bool_) if header.has_known else None
        generation = np.empty(shape, np.int32) if header.has_provenance else None
        age = np.empty(shape, np.int32) if header.has_provenance else None
        for i, frame in enumerate(reader):
            vertices[i] = frame.points
            if known is not None:
                known[i] = frame.known
            if generation is not None and age is not None:
                generation[i] = np.asarray(frame.generation)
                age[i] = np.asarray(frame.age)
        return Sequence(
            vertices, header.faces, known, header.fps, header.polygons, header.up_axis,
            header.name, header.start, header.times, header.metres_per_unit, generation, age,
            header.derived,
        )  # fmt: skip


def write(path: PathLike, sequence: Sequence, *, format: str | None = None) -> None:
    """Writes a whole sequence. An existing file is replaced when the new one is complete.

    The errors are those of :func:`create`.
    """
    if not isinstance(sequence, Sequence):
        raise TypeError(f"sequence: must be a Sequence, not {type(sequence).__name__}")
    n_frames, n_vertices, _ = sequence.vertices.shape
    with create(
        path,
        faces=sequence.faces,
        n_frames=n_frames,
        n_vertices=n_vertices,
        dtype=sequence.vertices.dtype,
        fps=sequence.fps,
        polygons=sequence.polygons,
        up_axis=sequence.up_axis,
        name=sequence.name,
        start=sequence.start,
        times=sequence.times,
        metres_per_unit=sequence.metres_per_unit,
        with_known=sequence.known is not None,
        with_provenance=sequence.generation is not None,
        derived=sequence.derived,
        format=format,
    ) as writer:
        for i in range(n_frames):
            writer.append(
                sequence.vertices[i],
                None if sequence.known is None else sequence.known[i],
                generation=None if sequence.generation is None else sequence.generation[i],
                age=None if sequence.age is None else sequence.age[i],
            )


def _template(faces: Any) -> Template | None:
    if faces is None:
        return None
    if isinstance(faces, np.ndarray):
        return Template(faces, None, None)
    check_path("faces", faces, "a numpy array or a path")
    with open(faces) as reader:
        return template_of(reader)
