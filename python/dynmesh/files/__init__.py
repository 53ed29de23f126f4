"""Reading and writing sequences: the one place that knows file formats.

Each format has a module with a reader and a writer; all of them work one frame at a time, so memory
does not grow with the length of a sequence. `interface.py` says what they have in common.
"""

import os
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..polygons import Polygons
from ..sequence import Sequence
from .alembic import alembic
from .hdf5 import hdf5
from .interface import Format, Frame, Header, Reader, Template, Writer, naming
from .masks import MaskedReader
from .mdd import mdd
from .npy import npy
from .npz import npz
from .numbered import files_in
from .obj import obj
from .paraview import pvd
from .pc2 import pc2
from .ply import ply
from .usd import usd, usdz

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
    "formats",
    "naming",
    "new_folder",
    "open",
    "read",
    "write",
]

PathLike: TypeAlias = str | os.PathLike[str]

formats: dict[str, Format] = {
    format.name: format for format in (npz, hdf5, npy, pc2, mdd, ply, obj, pvd, usd, usdz, alembic)
}
"""All formats by name."""


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
        path: a file, or the files of a sequence in one file per frame: a pattern as
            ``frame_%04d.ply``, a glob as ``*.ply``, or their folder.
        format: one of :data:`dynmesh.files.formats`; None goes by the suffix.
        faces: (m, 3) integers, or a file with the same mesh, for formats that hold positions alone.
            None: from the file that :func:`write` put beside it.
        prim: the path of the mesh, where a file holds several (USD, Alembic).
        known: (n, k) bool, or a `.npy` file with it: the known masks, in place of those in `path`.
        missing: "zero": positions of exactly (0, 0, 0) were not observed, except in frame 0.

    Raises:
        OSError: the file cannot be opened.
        ImportError: a library is needed for this format; the message says how to install it.
        ValueError: it is no sequence; the message names the file and what is wrong.
    """
    path = Path(path)
    if missing not in (None, "zero"):
        raise ValueError(f"missing: must be 'zero' or None, not {missing!r}")
    with naming(path):
        reader = _format_of(path, format).reader(path, _template(faces), prim)
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
    with_known: bool = False,
    with_provenance: bool = False,
    format: str | None = None,
) -> Writer:
    """Begins a file to which a sequence is written frame by frame, in constant memory.

    Args:
        path: an existing file is replaced when the new one is whole.
        faces: (m, 3) integers.
        n_frames: how many frames will be appended.
        n_vertices: of each frame.
        dtype: of the positions, float32 or float64.
        fps: frames per second, if known.
        polygons: the faces before they were cut into triangles, if they were no triangles.
        up_axis: "y" or "z", if known.
        name: of the mesh in the file, for formats that hold several.
        start: the number of the first frame in the file; see :class:`dynmesh.Sequence`.
        with_known: whether each frame comes with its mask.
        with_provenance: whether each frame comes with the generation and age of its vertices.
        format: one of :data:`dynmesh.files.formats`; None goes by the suffix.

    Raises:
        OSError: the file cannot be written.
        ImportError: a library is needed for this format; the message says how to install it.
        TypeError, ValueError: an argument is of the wrong kind or shape.
    """
    header = Header(
        faces, n_frames, n_vertices, dtype, fps, polygons, up_axis, name, start, with_known,
        with_provenance,
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
    """As :func:`create`, with a header; `folder` and `resume_at` as :class:`Writer` says."""
    path = Path(path)
    with naming(path):
        return _writer_of(path, format)(path, header, folder=folder, resume_at=resume_at)


def existing(path: PathLike, format: str | None = None) -> list[Path]:
    """The files there are now that writing to `path` would replace."""
    path = Path(path)
    with naming(path):
        return _writer_of(path, format).existing(path)


def new_folder(path: PathLike, format: str | None = None) -> Path | None:
    """The folder that writing to `path` would make; None where it must be there already."""
    path = Path(path)
    with naming(path):
        return _writer_of(path, format).new_folder(path)


def create_like(
    reader: Reader,
    path: PathLike,
    *,
    with_known: bool = False,
    with_provenance: bool = False,
    format: str | None = None,
) -> Writer:
    """Begins a file for the sequence of `reader`, changed. As :func:`create`."""
    header = replace(reader.header, has_known=with_known, has_provenance=with_provenance)
    return begin(path, header, format=format)


def read(path: PathLike, **options: Any) -> Sequence:
    """Reads a whole sequence into memory. Takes and raises what :func:`open` does."""
    with open(path, **options) as reader:
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
            header.name, header.start, generation, age,
        )  # fmt: skip


def write(path: PathLike, sequence: Sequence, *, format: str | None = None) -> None:
    """Writes a whole sequence. An existing file is replaced when the new one is whole.

    Raises what :func:`create` does.
    """
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
        with_known=sequence.known is not None,
        with_provenance=sequence.generation is not None,
        format=format,
    ) as writer:
        for i in range(n_frames):
            writer.append(
                sequence.vertices[i],
                None if sequence.known is None else sequence.known[i],
                generation=None if sequence.generation is None else sequence.generation[i],
                age=None if sequence.age is None else sequence.age[i],
            )


def _format_of(path: Path, name: str | None) -> Format:
    """The format of that name, or that the path shows."""
    if name is not None:
        if name not in formats:
            raise ValueError(f"the format '{name}' is not known, but {_listed(formats)}")
        return formats[name]
    if path.is_dir():
        return _format_in(path)
    suffix = path.suffix.lower()
    for format in formats.values():
        if suffix in format.suffixes:
            return format
    suffixes = [suffix for format in formats.values() for suffix in format.suffixes]
    raise ValueError(f"the format '{path.suffix}' is not known, but {_listed(suffixes)}")


def _format_in(folder: Path) -> Format:
    """The format of the frames in a folder."""
    found = [format for format in (ply, obj) if files_in(folder, format.suffixes[0])]
    if len(found) == 1:
        return found[0]
    what = "both .ply and .obj files" if found else "no .ply or .obj files"
    raise ValueError(f"is a folder with {what}: name the format with --format, in Python format=")


def _writer_of(path: Path, format: str | None) -> type[Writer]:
    chosen = _format_of(path, format)
    if chosen.writer is None:
        raise ValueError(f"{chosen.name} files are only read")
    return chosen.writer


def _listed(names: Any) -> str:
    *others, last = names
    return f"{', '.join(others)} and {last}" if others else str(last)


def _template(faces: Any) -> Template | None:
    if faces is None:
        return None
    if isinstance(faces, np.ndarray):
        return Template(faces, None, None)
    with open(faces) as reader:
        return Template(reader.header.faces, reader.header.polygons, reader.n_vertices)
