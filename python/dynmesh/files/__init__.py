"""Reading and writing sequences. Only this package depends on file formats.

Each format has a module with a reader and a writer. They process one frame at a time, so memory
does not grow with the length of a sequence. `reader.py` and `writer.py` document their common
interface.
"""

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal, TypeAlias, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from .._checks import check_path
from .._errors import InputError, KindError, naming
from ..polygons import Faces, split_faces
from ..sequence import Sequence
from .choice import PathLike, existing_file, format_of, formats, named_like, target_of, target_over
from .format import Gaps, NoFacesError, Template, template_of
from .frame import Frame
from .header import Header
from .masks import MaskedReader
from .memory import Collected, SequenceReader
from .reader import Reader
from .writer import Writer

__all__ = [
    "Frame",
    "Header",
    "NoFacesError",
    "OneSequence",
    "PathLike",
    "Reader",
    "Source",
    "Writer",
    "create",
    "format_of",
    "formats",
    "meshes_of",
    "named_like",
    "naming",
    "open",
    "opened",
    "opened_beside",
    "read",
    "target_of",
    "target_over",
    "write",
]


class Source(TypedDict, total=False):
    """How to read a file.

    Attributes:
        faces: a mesh with the faces, if the file holds only positions.
        prim: the path of the mesh, if the file holds several (USD, Alembic).
        known: which vertices are known, bool (n, k) in a .npy file, or `known` in a .npz file; or a
            text file of vertices that are not, in lines "frame vertex vertex ...", where the frame
            ``*`` stands for all.
        missing: "zero" if vertices at exactly (0, 0, 0) are missing.
        gaps: what frames are whose file is missing: "refuse" makes them an error, "lost" frames in
            which nothing was observed.
    """

    faces: Faces | PathLike | None
    prim: str | None
    known: NDArray[np.bool_] | PathLike | None
    missing: Literal["zero"] | None
    gaps: Gaps


def open(path: PathLike, *, format: str | None = None, **source: Unpack[Source]) -> Reader:
    """Opens a sequence to read it frame by frame, in constant memory.

    Args:
        path: a file, or a sequence in one file per frame: a pattern such as ``frame_%04d.ply`` or
            ``frame.####.ply``, a glob such as ``*.ply``, or a folder.
        format: one of :data:`dynmesh.files.formats`; None means the format of the suffix.
        **source: `faces`, (m, 3) integers, other polygons, or a file with the same mesh, for
            formats that hold only positions; else from the file that :func:`write` put beside it.
            `prim`, the path of the mesh, if a file holds several (USD, Alembic). `known`, (n, k)
            bool, or a `.npy` or `.npz` file with it: known masks that replace those in `path`; or a
            text file of vertices that are not known, in lines "frame vertex vertex ...", where the
            frame ``*`` stands for all. `missing`, "zero" if positions of exactly (0, 0, 0) were not
            observed. `gaps`, "lost" if nothing was observed in frames whose file is missing, in a
            sequence with one file per frame; "refuse", the default, refuses such a sequence.

    Raises:
        OSError: the file cannot be opened.
        ImportError: the library for this format is not installed; the message names its extra.
        ValueError: the file is not a valid sequence; the message names the file and the problem.
    """
    check_path("path", path)
    path = Path(path)
    known, missing, gaps = source.get("known"), source.get("missing"), source.get("gaps", "refuse")
    if missing not in (None, "zero"):
        raise InputError(f"must be 'zero' or None, not {missing!r}", argument="missing")
    if gaps not in ("refuse", "lost"):
        raise InputError(f"must be 'refuse' or 'lost', not {gaps!r}", argument="gaps")
    with naming(path):
        faces, chosen = _template(source.get("faces")), format_of(path, format)
        path = existing_file(path, chosen)
        reader = chosen.open(path, faces=faces, prim=source.get("prim"), gaps=gaps)
    if known is None and missing is None:
        return reader
    try:
        return MaskedReader(reader, known, zero_is_missing=missing == "zero")
    except BaseException:
        reader.close()
        raise


def meshes_of(path: PathLike, format: str | None = None) -> Mapping[str, bool]:
    """The paths of all meshes in a file that can hold several, and whether each moves.

    It is empty for files that hold a single mesh. The errors are those of :func:`open`.
    """
    with naming(Path(path)):
        chosen = format_of(path, format)
        return {} if chosen.meshes is None else chosen.meshes(Path(path))


OneSequence: TypeAlias = PathLike | Reader | Sequence
"""A file in any format, a reader from :func:`open`, or a sequence in memory."""


@contextmanager
def opened(
    sequence: OneSequence,
    name: str = "sequence",
    template: Faces | PathLike | None = None,
    **source: Unpack[Source],
) -> Iterator[Reader]:
    """Yields a reader of a sequence, wherever it is; a reader is not closed.

    Args:
        sequence: the sequence.
        name: what messages call a sequence in memory.
        template: the faces of a file that holds none, or a mesh file with them.
        **source: how to read a file, the keywords of :func:`open`.
    """
    if isinstance(sequence, Reader):
        yield sequence
        return
    reader: Reader
    if isinstance(sequence, Sequence):
        reader = SequenceReader(sequence, name)
    else:
        check_path(name, sequence, "a path, a reader, or a Sequence(vertices, faces)")
        theirs = _template(template)
        try:
            reader = open(sequence, **source)
        except NoFacesError:
            if theirs is None:
                raise
            source["faces"] = template
            reader = open(sequence, **source)
    with reader:
        yield reader


@contextmanager
def opened_beside(sequence: OneSequence, name: str, source: Source) -> Iterator[Reader]:
    """As :func:`opened`, for one of several files that share faces and the path of their mesh.

    The faces are for a file that holds none, and the path for one with several meshes.
    """
    own: Source = {**source}
    faces, prim = own.pop("faces", None), own.pop("prim", None)
    if isinstance(sequence, str | os.PathLike) and format_of(sequence).meshes is not None:
        own["prim"] = prim
    with opened(sequence, name, faces, **own) as reader:
        yield reader


def create(path: PathLike, header: Header, *, format: str | None = None) -> Writer:
    """Creates a file to which a sequence is written frame by frame, in constant memory.

    Args:
        path: an existing file is replaced when the new one is complete.
        header: the properties that all frames of the file share.
        format: one of :data:`dynmesh.files.formats`; None means the format of the suffix.

    Raises:
        OSError: the file cannot be written.
        ImportError: the library for this format is not installed; the message names its extra.
        TypeError, ValueError: the format cannot hold such a sequence.
    """
    check_path("path", path)
    if not isinstance(header, Header):
        raise KindError(f"must be a Header, not {type(header).__name__}", argument="header")
    return target_of(path, format).create(header)


def read(path: PathLike, *, format: str | None = None, **source: Unpack[Source]) -> Sequence:
    """Reads a whole sequence into memory. The arguments and errors are those of :func:`open`."""
    with open(path, format=format, **source) as reader:
        made = Collected(reader.header)
        for frame in reader:
            made.append(frame.points, **frame.attributes())
        return made.sequence()


def write(path: PathLike, sequence: Sequence, *, format: str | None = None) -> None:
    """Writes a whole sequence. An existing file is replaced when the new one is complete.

    The errors are those of :func:`create`.
    """
    if not isinstance(sequence, Sequence):
        raise KindError(f"must be a Sequence, not {type(sequence).__name__}", argument="sequence")
    check_path("path", path)
    target_of(path, format).write(sequence)


def _template(faces: Any) -> Template | None:
    if faces is None:
        return None
    if isinstance(faces, np.ndarray | list | tuple):
        return Template(*split_faces(faces), None)
    check_path("faces", faces, "an array, a list or a path")
    with open(faces) as reader:
        return template_of(reader)
