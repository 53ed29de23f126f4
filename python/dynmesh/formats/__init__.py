"""Reading and writing frames. Only this package depends on file formats.

Each format is a module with a :class:`dynmesh.formats.format.Format`: two functions and what it
keeps. They process one frame at a time, so memory does not grow with the length of a sequence.
"""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import PurePath
from typing import Any, Literal, TypeAlias, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from .._checks import check_choice, check_finite, path_of
from .._errors import InputError, KindError, naming
from ..frame import Frame, Frames, check_any
from ..polygons import Faces, split_faces
from ..run import Kept, Run
from ..sequence import InMemory, are_arrays, as_sequence, refuse_reading
from ..stored import Stored
from .format import Format, Gaps, NoFacesError, Template, template_of
from .masks import MaskedFrames
from .table import (
    FORMATS,
    PathLike,
    check_format,
    existing_file,
    format_of,
)
from .usd_stage import UsdMeshes
from .writing import Written, write

__all__ = [
    "FORMATS",
    "Format",
    "InFile",
    "InMemory",
    "NoFacesError",
    "OneSequence",
    "PathLike",
    "Shared",
    "Source",
    "Written",
    "check_format",
    "check_source",
    "format_of",
    "meshes_of",
    "naming",
    "open",
    "opened",
    "opened_together",
    "write",
]


class Source(TypedDict, total=False):
    """The keywords of :func:`open`."""

    format: str | None
    faces: Faces | PathLike | None
    prim: str | Iterable[str] | None
    known: NDArray[np.bool_] | PathLike | None
    missing: float | Literal["zero"] | None
    least_confidence: float | None
    gaps: Gaps


def check_source(source: object) -> None:
    """Raises an error unless these are keywords of :func:`open`."""
    if not isinstance(source, dict):
        message = f"must be keywords of dynmesh.open, as {{'prim': '/body'}}, not {source!r}"
        raise KindError(message, argument="source")


_PRIMVARS = "primvars:"
"""What names of primvars begin with."""


def open(
    path: PathLike,
    *,
    format: str | None = None,
    faces: Faces | PathLike | None = None,
    prim: str | Iterable[str] | None = None,
    known: NDArray[np.bool_] | PathLike | None = None,
    missing: float | Literal["zero"] | None = None,
    least_confidence: float | None = None,
    gaps: Gaps = "refuse",
) -> Stored:
    """Opens the frames of a file, which are read one by one, in constant memory.

    Args:
        path: a file, or a sequence in one file per frame: a pattern such as 'scans/*.ply',
            ``frame_%04d.ply`` or ``frame.####.ply``, or a folder.
        format: the format of the file, if its suffix does not say it.
        faces: a mesh with the faces, if the file holds only positions.
        prim: the path of the mesh, if the file holds several (USD, Alembic); or, of USD, several
            paths, or "all": they are one mesh then, in the space of the scene.
        known: which vertices are known, bool (n, k) in a .npy file, or known in a .npz file; or, of
            USD, a primvar, such as ``primvars:tracked``.
        missing: a number, such as -999, or "zero": vertices are missing of which all three
            coordinates are exactly that.
        least_confidence: the least value that counts as known, if the known masks are confidences:
            0 to 255, or 0 to 1.
        gaps: what frames are whose file is missing, or in which a mesh of USD or Alembic has no
            points, or one of USD no mask, or is invisible: "refuse" makes them an error, "lost"
            frames in which nothing was observed.
    """
    path = path_of("path", path)
    missing = 0.0 if missing == "zero" else missing
    if isinstance(missing, str):
        message = f"must be a number or 'zero', not {missing!r}"
        raise InputError(message, argument="missing", value=missing)
    for name, value in (("missing", missing), ("least_confidence", least_confidence)):
        if value is not None:
            check_finite(name, value)
    check_choice("gaps", gaps, Gaps)
    primvar = None
    if isinstance(known, str | PurePath) and PurePath(known).name.startswith(_PRIMVARS):
        primvar, known = PurePath(known).name.removeprefix(_PRIMVARS), None
    with naming(path):
        template, chosen = _template(faces), format_of(path, format)
        path = existing_file(path, chosen)
        frames = chosen.open(path, faces=template, prim=prim, gaps=gaps, primvar=primvar)
    try:
        has_masks = frames.header.has_known or known is not None
        if least_confidence is not None and not (has_masks or frames.each):
            message = "is that of known masks, of which there are none"
            raise InputError(
                message, argument="least_confidence", value=least_confidence, file=path
            )
        return _masked(frames, known, missing, least_confidence)
    except BaseException:
        frames.close()
        raise


def _masked(
    frames: Stored, known: Any, missing: float | None, least_confidence: float | None
) -> Stored:
    """The frames with masks as they are given; of several meshes, each before it is moved."""
    if isinstance(frames, UsdMeshes):
        if known is not None:
            message = "is of a single mesh; of several, name a primvar, as primvars:known"
            raise InputError(message, argument="known")
        each = frames.each.items()
        frames.each = {name: _masked(one, None, missing, least_confidence) for name, one in each}
        return frames
    if least_confidence is not None and known is None and frames.header.has_known:
        frames.least_confidence = least_confidence
    if known is None and missing is None:
        return frames
    return MaskedFrames(frames, known, missing, least_confidence)


def meshes_of(path: PathLike, format: str | None = None) -> Mapping[str, bool]:
    """The paths of all meshes in a file that can hold several, and whether each moves.

    It is empty for files that hold a single mesh. The errors are those of :func:`open`.
    """
    path = path_of("path", path)
    with naming(path):
        chosen = format_of(path, format)
        return {} if chosen.meshes is None else chosen.meshes(path)


InFile: TypeAlias = PathLike | Frames
OneSequence: TypeAlias = InMemory | InFile
"""A file in any format, frames of :func:`open` or of a verb, a sequence in memory, positions (n, k,
3) beside faces, or meshes of trimesh or PyVista, one for each frame."""


class Shared:
    """What those of several sequences get that need it; others do without.

    Attributes:
        faces: for arrays and files that hold none.
        prim: for files with several meshes.
    """

    def __init__(self, faces: Any = None, prim: str | Iterable[str] | None = None) -> None:
        self.faces, self.prim, self._unused = faces, prim, {"faces": faces, "prim": prim}

    def take(self, name: str) -> Any:
        """Returns one of them for a sequence that needs it."""
        self._unused[name] = None
        return getattr(self, name)

    def refuse_unused(self) -> None:
        """Raises an error if one was given that none of the sequences needs."""
        for name, why in _NOT_NEEDED.items():
            if self._unused[name] is not None:
                raise InputError(f"has no effect, as {why}", argument=name)


_NOT_NEEDED = {"faces": "all have their own", "prim": "no file can hold several meshes"}


@contextmanager
def opened(
    sequence: OneSequence,
    name: str = "sequence",
    shared: Shared | None = None,
    **source: Unpack[Source],
) -> Iterator[Frames]:
    """Yields the frames of a sequence, wherever it is; frames that are open stay so.

    Those of a run are kept in a temporary file when the first of them is wanted.

    Args:
        sequence: the sequence.
        name: what messages call a sequence in memory.
        shared: what it gets if it needs it.
        **source: how to read a file, the keywords of :func:`open`.
    """
    shared = shared or Shared()
    faces = source.pop("faces", None) if are_arrays(sequence, source.get("faces")) else None
    if faces is None and are_arrays(sequence, shared.faces):
        faces = shared.take("faces")
    own = as_sequence(sequence, faces)
    frames = sequence if own is None or own.name else own.named(name)
    if isinstance(frames, Frames):
        refuse_reading(source)
    if isinstance(frames, Run):
        frames = Kept(frames)
    if isinstance(frames, Frames):
        check_any(frames)
        yield frames
        return
    if isinstance(sequence, Frame):
        message = "is a Frame, which has no faces; a slice, such as sequence[:1], has them"
        raise KindError(message, argument=name)
    sequence = path_of(name, sequence, "a path, frames, a Sequence, arrays or meshes")
    if shared.prim and format_of(sequence, source.get("format")).meshes is not None:
        source["prim"] = shared.take("prim")
    try:
        reader = open(sequence, **source)
    except NoFacesError:
        if shared.faces is None:
            raise
        source["faces"] = shared.take("faces")
        reader = open(sequence, **source)
    with reader:
        yield reader


@contextmanager
def opened_together(source: Source, **sequences: OneSequence | None) -> Iterator[list[Any]]:
    """Opens several sequences, by names that messages call them by; None stays None.

    The `faces` and `prim` of the source are for all that need them, and its other keywords for
    `input` if that is given, else for the first one.
    """
    check_source(source)
    how: Source = {**source}
    shared = Shared(how.pop("faces", None), how.pop("prim", None))
    read = "input" if sequences.get("input") is not None else next(iter(sequences))
    with ExitStack() as stack:
        result: list[Any] = [
            None
            if one is None
            else stack.enter_context(opened(one, name, shared, **(how if name == read else {})))
            for name, one in sequences.items()
        ]
        shared.refuse_unused()
        yield result


def _template(faces: Any) -> Template | None:
    if faces is None:
        return None
    if isinstance(faces, np.ndarray | list | tuple):
        return Template(*split_faces(faces), None)
    with open(path_of("faces", faces, "an array, a list or a path")) as reader:
        return template_of(reader)
