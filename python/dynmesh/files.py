"""Reading and writing sequences: the one place that knows file formats.

A sequence in `.npz` holds `vertices`, `faces` and, optionally, `known` and `fps`, as
:class:`dynmesh.Sequence` describes them. It is read and written one frame at a time, so memory does
not grow with its length.
"""

import contextlib
import os
import shutil
import tempfile
import zipfile
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import IO, Any, NamedTuple, Self

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from .sequence import (
    Mask,
    Positions,
    Sequence,
    check_faces,
    check_fps,
    check_known,
    check_vertices,
)


class Frame(NamedTuple):
    """One frame of a sequence."""

    points: Positions
    """(k, 3)"""
    known: Mask | None
    """(k,), or None where the sequence has no masks."""


class _ArrayStream:
    """The rows of one `.npy` member of an archive, read one after another."""

    def __init__(self, archive: zipfile.ZipFile, name: str) -> None:
        self._row = 0
        self._whole: NDArray[Any] | None = None
        with contextlib.ExitStack() as stack:
            self._file = stack.enter_context(archive.open(f"{name}.npy"))
            version = npy.read_magic(self._file)
            read_header = (
                npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
            )
            self.shape, by_columns, self.dtype = read_header(self._file)
            if self.dtype.hasobject:
                raise ValueError(f"{name}: holds Python objects, not numbers")
            if by_columns:  # no row lies in one piece
                with archive.open(f"{name}.npy") as file:
                    self._whole = npy.read_array(file)
            stack.pop_all()

    def read_row(self) -> NDArray[Any]:
        row_shape = self.shape[1:]
        if self._whole is not None:
            row = np.ascontiguousarray(self._whole[self._row])
        else:
            size = self.dtype.itemsize * int(np.prod(row_shape))
            data = self._file.read(size)
            if len(data) < size:
                raise ValueError(f"ends in the middle of frame {self._row} of {self.shape[0]}")
            row = np.frombuffer(data, self.dtype).reshape(row_shape)
        self._row += 1
        return row.astype(self.dtype.newbyteorder("="), copy=False)

    def close(self) -> None:
        self._file.close()


class Reader:
    """A sequence in a file: what :func:`open` returns.

    Iterating yields :class:`Frame`, always from frame 0 on. Use it in a ``with`` statement.

    Attributes:
        faces: (m, 3) integers.
        n_frames: n.
        n_vertices: k.
        dtype: of the positions, float32 or float64.
        has_known: whether there are known masks.
        fps: frames per second, or None.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        """Opens `path`; see :func:`open`."""
        self.path = Path(path)
        _check_format(self.path)
        with contextlib.ExitStack() as stack, naming(self.path):
            self._archive = stack.enter_context(zipfile.ZipFile(self.path))
            arrays = {name.removesuffix(".npy") for name in self._archive.namelist()}
            for needed in ("vertices", "faces"):
                if needed not in arrays:
                    raise ValueError(
                        f"has no array '{needed}': a sequence holds vertices, faces and, "
                        f"optionally, known and fps; this file holds {', '.join(sorted(arrays))}"
                    )
            vertices = stack.enter_context(contextlib.closing(self._stream("vertices")))
            check_vertices(vertices.dtype, vertices.shape)
            self.n_frames, self.n_vertices, _ = vertices.shape
            self.dtype = vertices.dtype.newbyteorder("=")
            self.faces = self._array("faces")
            check_faces(self.faces.dtype, self.faces.shape)
            self.has_known = "known" in arrays
            if self.has_known:
                known = stack.enter_context(contextlib.closing(self._stream("known")))
                check_known(known.dtype, known.shape, vertices.shape[:2])
            self.fps = self._fps() if "fps" in arrays else None
            stack.pop_all()  # the archive stays open
            vertices.close()

    def _stream(self, name: str) -> _ArrayStream:
        return _ArrayStream(self._archive, name)

    def _array(self, name: str) -> NDArray[Any]:
        with self._archive.open(f"{name}.npy") as file:
            return npy.read_array(file, allow_pickle=False)

    def _fps(self) -> float:
        fps = self._array("fps")
        if fps.size != 1 or fps.dtype.kind not in "fiu":
            raise ValueError(f"fps: must be one number, not {fps.dtype} of shape {fps.shape}")
        check_fps(float(fps.reshape(())))
        return float(fps.reshape(()))

    def __iter__(self) -> Iterator[Frame]:
        """Yields the frames, from frame 0 on."""
        with contextlib.ExitStack() as stack, naming(self.path):
            vertices = stack.enter_context(contextlib.closing(self._stream("vertices")))
            known = None
            if self.has_known:
                known = stack.enter_context(contextlib.closing(self._stream("known")))
            for _ in range(self.n_frames):
                yield Frame(vertices.read_row(), None if known is None else known.read_row())

    def close(self) -> None:
        """Closes the file."""
        self._archive.close()

    def __enter__(self) -> Self:
        """Is the reader itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Closes the file."""
        self.close()


class Writer:
    """A sequence on its way into a file: what :func:`create` returns.

    Use it in a ``with`` statement and append every frame. The file appears under its name when the
    statement ends, whole; after an exception, or with frames missing, it does not appear at all.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        faces: NDArray[np.integer[Any]],
        shape: tuple[int, int],
        dtype: np.dtype[Any],
        fps: float | None,
        with_known: bool,
    ) -> None:
        """Begins the file; see :func:`create`."""
        self.path = Path(path)
        _check_format(self.path)
        self._n_frames, self._n_vertices = shape
        self._dtype = dtype
        self._frame = 0
        check_vertices(dtype, (*shape, 3))
        check_faces(faces.dtype, faces.shape)
        if fps is not None:
            check_fps(fps)
        self._partial = self.path.with_name(f".{self.path.name}.{os.getpid()}.part")
        with contextlib.ExitStack() as stack:
            self._archive = stack.enter_context(self._open_archive())
            stack.callback(self._partial.unlink)
            self._write_array("faces", faces)
            if fps is not None:
                self._write_array("fps", np.float64(fps))
            # An archive is written one member at a time: the masks wait in a file of their own.
            self._known = stack.enter_context(self._spool()) if with_known else None
            self._vertices = self._begin_array("vertices", dtype, (*shape, 3))
            self._undo = stack.pop_all()

    def _open_archive(self) -> zipfile.ZipFile:
        try:
            return zipfile.ZipFile(self._partial, "w", zipfile.ZIP_STORED)
        except OSError as error:  # of the name that the user knows
            raise type(error)(error.errno, error.strerror, str(self.path)) from error

    def _spool(self) -> IO[bytes]:
        return tempfile.TemporaryFile(dir=self.path.parent)

    def _write_array(self, name: str, array: Any) -> None:
        with self._archive.open(f"{name}.npy", "w") as file:
            npy.write_array(file, np.asanyarray(array), allow_pickle=False)

    def _begin_array(self, name: str, dtype: np.dtype[Any], shape: tuple[int, ...]) -> IO[bytes]:
        file = self._archive.open(f"{name}.npy", "w", force_zip64=True)
        header = {"descr": npy.dtype_to_descr(dtype), "fortran_order": False, "shape": shape}
        npy.write_array_header_1_0(file, header)
        return file

    def append(self, points: Positions, known: Mask | None = None) -> None:
        """Adds the next frame.

        Args:
            points: (k, 3) of the file's dtype.
            known: (k,) bool, if the file was begun `with_known`.

        Raises:
            ValueError: for another shape or dtype, a mask too many or too few, a frame too many.
        """
        place = f"{self.path}: frame {self._frame}"
        if self._frame == self._n_frames:
            raise ValueError(f"{place}: the file was begun for {self._n_frames} frames")
        if points.shape != (self._n_vertices, 3) or points.dtype != self._dtype:
            raise ValueError(
                f"{place}: must be {self._dtype} of shape {(self._n_vertices, 3)}, "
                f"not {points.dtype} of shape {points.shape}"
            )
        if (known is not None) != (self._known is not None):
            raise ValueError(f"{place}: a mask comes with every frame or with none")
        if known is not None and self._known is not None:
            check_known(known.dtype, known.shape, (self._n_vertices,))
            self._known.write(known.tobytes())
        self._vertices.write(points.tobytes())
        self._frame += 1

    def __enter__(self) -> Self:
        """Is the writer itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, _: object, __: TracebackType | None
    ) -> None:
        """Finishes the file, or removes what there is of it."""
        with self._undo as undo:
            self._vertices.close()
            if kind is not None:
                return
            if self._frame < self._n_frames:
                raise ValueError(
                    f"{self.path}: only {self._frame} of {self._n_frames} frames were appended"
                )
            if self._known is not None:
                shape = (self._n_frames, self._n_vertices)
                with self._begin_array("known", np.dtype(np.bool_), shape) as file:
                    self._known.seek(0)
                    shutil.copyfileobj(self._known, file)
                self._known.close()
            self._archive.close()
            self._partial.replace(self.path)
            undo.pop_all()


@contextlib.contextmanager
def naming(path: Path) -> Iterator[None]:
    """Puts the file's name before what went wrong with it."""
    try:
        yield
    except zipfile.BadZipFile as error:
        raise ValueError(f"{path}: is damaged or no .npz archive: {error}") from error
    except (ValueError, TypeError, EOFError) as error:
        if str(error).startswith(f"{path}: "):
            raise
        raise ValueError(f"{path}: {error}") from error


def _check_format(path: Path) -> None:
    if path.suffix.lower() != ".npz":
        raise ValueError(f"{path}: the format '{path.suffix}' is not known; .npz is")


def open(path: str | os.PathLike[str]) -> Reader:
    """Opens a sequence to read it frame by frame, in constant memory.

    Raises:
        OSError: the file cannot be opened.
        ValueError: it is no sequence; the message names the file and what is wrong.
    """
    return Reader(path)


def create(
    path: str | os.PathLike[str],
    *,
    faces: NDArray[np.integer[Any]],
    n_frames: int,
    n_vertices: int,
    dtype: np.dtype[Any],
    fps: float | None = None,
    with_known: bool = False,
) -> Writer:
    """Begins a file to which a sequence is written frame by frame, in constant memory.

    Args:
        path: an existing file is replaced when the new one is whole.
        faces: (m, 3) integers.
        n_frames: how many frames will be appended.
        n_vertices: of each frame.
        dtype: of the positions, float32 or float64.
        fps: frames per second, if known.
        with_known: whether each frame comes with its mask.

    Raises:
        OSError: the file cannot be written.
        TypeError, ValueError: an argument is of the wrong kind or shape.
    """
    return Writer(path, faces, (n_frames, n_vertices), dtype, fps, with_known)


def create_like(
    reader: Reader, path: str | os.PathLike[str], *, with_known: bool = False
) -> Writer:
    """Begins a file for the sequence of `reader`, changed. As :func:`create`."""
    shape = (reader.n_frames, reader.n_vertices)
    return Writer(path, reader.faces, shape, reader.dtype, reader.fps, with_known)


def read(path: str | os.PathLike[str]) -> Sequence:
    """Reads a whole sequence into memory. Raises what :func:`open` does."""
    with open(path) as reader:
        vertices = np.empty((reader.n_frames, reader.n_vertices, 3), reader.dtype)
        known = np.empty(vertices.shape[:2], np.bool_) if reader.has_known else None
        for i, frame in enumerate(reader):
            vertices[i] = frame.points
            if known is not None:
                known[i] = frame.known
        return Sequence(vertices, reader.faces, known, reader.fps)


def write(path: str | os.PathLike[str], sequence: Sequence) -> None:
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
        with_known=sequence.known is not None,
    ) as writer:
        for i in range(n_frames):
            known = None if sequence.known is None else sequence.known[i]
            writer.append(sequence.vertices[i], known)
