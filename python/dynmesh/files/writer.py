"""What every writer offers: a file that appears when it is whole, and not before."""

import contextlib
import os
import shutil
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from .._errors import InputError, locating
from ..sequence import Mask, Positions, Provenance, check_known, check_provenance
from .header import Frame, Header
from .naming import naming
from .placing import put_in_place


class Writer(ABC):
    """A sequence on its way into a file: what :func:`dynmesh.create` returns.

    Use it in a ``with`` statement and append every frame. The file appears under its name when the
    statement ends, whole; after an exception, or with frames missing, it does not appear at all.
    Until then everything is in a hidden folder beside it.

    Attributes:
        path: where the file will be.
        header: what it will say of all its frames.
        folder: where it is until it is whole.
        remarks: what a user should know of the file beside what was asked for, a line each.
        resumable: whether a writer can go on with the unfinished file of one that is gone.
        keeps_known: whether the format holds masks; where not, NaN stands for what is not known.
        keeps_provenance: whether the format holds generation and age; where not, they are refused.
        keeps_float64: whether the format holds float64; where not, positions are rounded to float32
            and refused where they are out of its range.
    """

    resumable: ClassVar[bool] = False
    keeps_known: ClassVar[bool] = True
    keeps_provenance: ClassVar[bool] = True
    keeps_float64: ClassVar[bool] = True

    def __init__(
        self, path: Path, header: Header, *, folder: Path | None = None, resume_at: int = 0
    ) -> None:
        """Begins the file, or goes on with an unfinished one.

        Args:
            path: where the file will be.
            header: what it shall say of all its frames.
            folder: where to work, if not in a fresh folder of an unused name; after an exception
                it stays as it is, to go on with, and after the death of the process for
                :func:`dynmesh.files.finish_placing`.
            resume_at: how many frames of the unfinished file in `folder` stand; it must hold at
                least as many, and further ones are forgotten. 0 begins anew.
        """
        self.path = path
        self.header = header
        self.folder = folder or path.with_name(f".{path.name}.{os.getpid()}.part")
        self._keep = folder is not None
        self._frame = resume_at
        self.remarks: list[str] = []
        with self._undoing(), self._blaming():
            if header.has_provenance and not self.keeps_provenance:
                raise ValueError(
                    "this format holds no generation and age; "
                    ".npz, .npy, .h5, .ply, .usd, .abc and .pvd do"
                )
            if resume_at == 0:
                if self.folder.exists():
                    shutil.rmtree(self.folder)
                self.folder.mkdir()
            self._begin(resume_at)

    @abstractmethod
    def _begin(self, kept: int) -> None:
        """Begins the files in `folder`, or opens them and forgets all but the first frames."""

    @abstractmethod
    def _append(self, frame: Frame) -> None:
        """Adds the next frame, which fits the header and what the format keeps."""

    def flush(self) -> None:
        """Makes sure that the frames so far outlive this process."""
        with self._blaming():
            self._flush()

    def _flush(self) -> None:  # noqa: B027 (what cannot be resumed need not)
        """As :meth:`flush`."""

    def _finish(self) -> None:
        """Completes and closes the files in `folder`; all frames were appended."""
        self._close()

    @abstractmethod
    def _close(self) -> None:
        """Closes what is open, finished or not; may be called again."""

    def _destinations(self) -> dict[str, Path]:
        """Where every file in `folder` goes; the one with the name that was asked for last."""
        files = sorted(self.folder.iterdir(), key=lambda file: file.name == self.path.name)
        return {file.name: self.path.with_name(file.name) for file in files}

    def _outdated(self) -> list[Path]:
        """What an older sequence of that name has beside the files that are replaced."""
        return []

    @classmethod
    def new_folder(cls, path: Path) -> Path | None:  # noqa: ARG003 (subclasses use it)
        """The folder that writing to `path` would make; None where it must be there already."""
        return None

    @classmethod
    def existing(cls, path: Path) -> list[Path]:
        """The files there are now that writing to `path` would replace."""
        return [path] if path.exists() else []

    def append(
        self,
        points: Positions,
        known: Mask | None = None,
        *,
        generation: Provenance | None = None,
        age: Provenance | None = None,
    ) -> None:
        """Adds the next frame.

        Args:
            points: (k, 3) of the file's dtype.
            known: (k,) bool, if the file was begun `with_known`.
            generation: (k,) integers, if the file was begun `with_provenance`.
            age: (k,) integers, if the file was begun `with_provenance`.

        Raises:
            OSError: it cannot be written.
            ValueError: for another shape or dtype, a mask too many or too few, a frame too many.
        """
        frame = Frame(points, known, generation, age)
        with naming(self.path), self._blaming():
            with locating(frame=self._frame):
                self._check(frame)
            if known is not None and not self.keeps_known:
                missing = points.dtype.type(np.nan)
                frame = replace(frame, points=np.where(known[:, None], points, missing), known=None)
            if not self.keeps_float64:
                with locating(frame=self._frame):
                    frame = replace(frame, points=self._rounded(frame.points))
            self._append(frame)
        self._frame += 1

    def _check(self, frame: Frame) -> None:
        header = self.header
        k = header.n_vertices
        if self._frame == header.n_frames:
            raise ValueError(f"the file was begun for {header.n_frames} frames")
        if frame.points.shape != (k, 3) or frame.points.dtype != header.dtype:
            raise ValueError(
                f"must be {header.dtype} of shape {(k, 3)}, "
                f"not {frame.points.dtype} of shape {frame.points.shape}"
            )
        if (frame.known is not None) != header.has_known:
            raise ValueError("a mask comes with every frame or with none")
        if frame.known is not None:
            check_known(frame.known.dtype, frame.known.shape, (k,))
        for name in ("generation", "age"):
            values = getattr(frame, name)
            if (values is not None) != header.has_provenance:
                raise ValueError("generation and age come with every frame or with none")
            if values is not None:
                check_provenance(name, values.dtype, values.shape, (k,))

    def _rounded(self, points: Positions) -> NDArray[np.float32]:
        with np.errstate(over="ignore"):
            single = np.ascontiguousarray(points, np.float32)
        beyond = (np.isinf(single) & np.isfinite(points)).any(axis=1)
        if beyond.any():
            vertex = int(beyond.argmax())
            raise ValueError(
                f"vertex {vertex} at {points[vertex].tolist()} "
                "is out of the range of float32, which is what the format holds"
            )
        return single

    def __enter__(self) -> Self:
        """Is the writer itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, _: object, __: TracebackType | None
    ) -> None:
        """Finishes the file, or removes what there is of it."""
        with self._undoing(), self._blaming():
            if kind is not None:
                raise _AbandonedError
            if self._frame < self.header.n_frames:
                n_frames = self.header.n_frames
                raise InputError(
                    f"only {self._frame} of {n_frames} frames were appended", file=self.path
                )
            self._finish()
            put_in_place(self.folder, self._destinations(), self._outdated(), plan=self._keep)
            shutil.rmtree(self.folder, ignore_errors=True)

    @contextlib.contextmanager
    def _undoing(self) -> Iterator[None]:
        """Leaves nothing behind after an exception, unless it is to be kept."""
        try:
            yield
        except BaseException as error:
            with contextlib.suppress(Exception):
                self._close()
            if not self._keep:
                shutil.rmtree(self.folder, ignore_errors=True)
            if not isinstance(error, _AbandonedError):
                raise

    @contextlib.contextmanager
    def _blaming(self) -> Iterator[None]:
        """Says of which file, by the name that the user knows, the system complains."""
        try:
            yield
        except OSError as error:
            if error.errno is None:
                raise OSError(f"{self.path}: {str(error).splitlines()[0]}") from error
            raise OSError(error.errno, os.strerror(error.errno), str(self.path)) from error


class _AbandonedError(Exception):
    """A ``with`` statement ended by an exception of its own, which goes on by itself."""
