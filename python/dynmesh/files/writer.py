"""The interface of all writers: a file that appears only when it is complete."""

import contextlib
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from .._checks import as_array
from .._errors import InputError, locating, naming
from .._report import listed, some_of
from ..attributes import ATTRIBUTES, as_mask
from ..sequence import Mask, Positions
from .frame import Frame
from .header import TEXTURE, Header
from .new_output import blaming, bytes_of, check_space, exists_already, making


class Writer(ABC):
    """A sequence that is being written: what :func:`dynmesh.create` returns.

    Use it in a ``with`` statement and append every frame. The file appears under its name when the
    statement ends. After an exception, or if frames are missing, it does not appear. Until then
    everything is in a hidden folder beside it, in which no other process writes.

    Attributes:
        path: path of the file.
        header: the properties of all frames.
        folder: contains the file until it is complete.
        remarks: remarks about the file for the user, one line each.
        keeps_known: whether the format stores masks; if not, unknown positions are stored as NaN.
        keeps_provenance: whether the format stores generation and age; if not, they are refused.
        keeps_texture: whether the format stores texture coordinates.
        keeps_float64: whether the format stores float64; if not, positions are rounded to float32,
            and refused if they are out of its range.
    """

    keeps_known: ClassVar[bool] = True
    keeps_provenance: ClassVar[bool] = True
    keeps_texture: ClassVar[bool] = False
    keeps_float64: ClassVar[bool] = True

    def __init__(self, path: Path, header: Header, *, overwrite: bool = True) -> None:
        """Begins the file.

        Args:
            path: path of the file.
            header: the properties of all frames.
            overwrite: whether to replace files that exist. Without it, they are looked for again
                when the file is complete, as another process may have made them.

        Raises:
            BlockingIOError: another process is writing the file.
            OSError: its disk has too little space left.
        """
        self.path = path
        self.header = header
        self._overwrite = overwrite
        self._frame = 0
        self.remarks: list[str] = [*header.remarks]
        self._working = contextlib.ExitStack()
        with self._undoing(), self._blaming():
            self.folder = self._working.enter_context(making(self._made()))
            check_space(self.folder, bytes_of(header))
            # Those that a killed process had put aside are back.
            self.refuse_existing(path, overwrite)
            self._lost = set() if header.mesh_file is None else set(header.mesh_file.holds)
            if self.keeps_texture and header.texture is not None:
                self._lost.discard(TEXTURE)
            self._begin()
            if header.mesh_file is not None and self._lost:
                lost = listed(sorted(self._lost))
                self.remarks.append(f"{lost} of {header.mesh_file.path.name} are not written")

    def _made(self) -> Path:
        """What is made: the path, or the folder of frames that is exchanged as a whole."""
        return self.path

    @abstractmethod
    def _begin(self) -> None:
        """Creates the files in `folder`.

        What is kept of the mesh file of the header is removed from `_lost`, of which a remark says
        that it is not written.
        """

    @abstractmethod
    def _append(self, frame: Frame) -> None:
        """Adds the next frame, already checked against the header and the format."""

    def _finish(self) -> None:
        """Completes and closes the files in `folder` after all frames were appended."""
        self._close()

    @abstractmethod
    def _close(self) -> None:
        """Closes open files, finished or not; may be called more than once."""

    def _destinations(self) -> dict[str, Path]:
        """Returns the destination of each file in `folder`, last the file with the given name."""
        files = sorted(self.folder.iterdir(), key=lambda file: file.name == self.path.name)
        return {file.name: self.path.with_name(file.name) for file in files}

    def _outdated(self) -> list[Path]:
        """Returns other files of an older sequence of that name, which are to be removed."""
        return []

    def _place(self) -> None:
        """Moves the files to their destinations, and removes outdated ones.

        Of a single file, this is atomic. If there are several, the files that they replace are
        removed first, starting with the last. So the files that exist before the last one is moved
        are a beginning of the new or of the older sequence, and never a mixture.
        """
        places, remove = self._destinations(), self._outdated()
        if remove or len(places) > 1:
            remove = [*reversed(places.values()), *remove]
        for file in remove:
            file.unlink(missing_ok=True)
        for name, place in places.items():
            place.parent.mkdir(exist_ok=True)
            (self.folder / name).replace(place)

    @classmethod
    def existing(cls, path: Path) -> list[Path]:
        """Returns those that exist of the files that writing to `path` may make or remove."""
        return [path] if path.exists() else []

    @classmethod
    def refuse_existing(cls, path: Path, overwrite: bool) -> None:
        """Raises a FileExistsError if one of these files exists and is not to be replaced."""
        if not overwrite and (existing := cls.existing(path)):
            raise exists_already(existing[0])

    def append(
        self,
        points: Positions,
        known: Mask | None = None,
        **attributes: NDArray[Any] | None,
    ) -> None:
        """Adds the next frame.

        Args:
            points: (k, 3) of the file's dtype.
            known: (k,) bool, if the file was created `with_known`.
            **attributes: `generation` and `age`, (k,) integers, if the header `has_provenance`, and
                `standard_error`, (k,) floats, if it `has_standard_error`.

        Raises:
            OSError: the frame cannot be written.
            ValueError: the shape or dtype is wrong, a mask is missing or unexpected, or the file
                has all its frames already.
        """
        points = as_array("points", points, np.float64)
        given = {"known": known, **attributes}
        frame = Frame(points, **{name: as_array(name, values) for name, values in given.items()})
        with naming(self.path), self._blaming():
            with locating(frame=self._number):
                self._check(frame)
                if frame.known is not None:
                    known = as_mask(frame.known)
                    if not self.keeps_known:
                        points = np.where(known[:, None], points, points.dtype.type(np.nan))
                    frame = replace(frame, points=points, known=known if self.keeps_known else None)
                if not self.keeps_float64:
                    frame = replace(frame, points=self._rounded(frame.points))
            self._append(frame)
        self._frame += 1

    @property
    def _number(self) -> float:
        """The number of the next frame."""
        past = self._frame >= self.header.n_frames
        return self._frame if past else self.header.number(self._frame)

    def _check(self, frame: Frame) -> None:
        header = self.header
        k = header.n_vertices
        if self._frame == header.n_frames:
            raise ValueError(f"the file was created for {header.n_frames} frames only")
        if frame.points.shape != (k, 3) or frame.points.dtype != header.dtype:
            raise ValueError(
                f"must be {header.dtype} of shape {(k, 3)}, "
                f"not {frame.points.dtype} of shape {frame.points.shape}"
            )
        given = frame.attributes()
        for name, row in ATTRIBUTES.items():
            if (name in given) != (name in header.attributes):
                raise ValueError(f"give {row.what} with every frame or with none")
            if name in given:
                row.check(given[name].dtype, given[name].shape, (k,))

    def _rounded(self, points: Positions) -> NDArray[np.float32]:
        with np.errstate(over="ignore"):
            single = np.ascontiguousarray(points, np.float32)
        beyond = (np.isinf(single) & np.isfinite(points)).any(axis=1)
        if beyond.any():
            vertex = int(beyond.argmax())
            raise ValueError(
                f"vertex {vertex} at {points[vertex].tolist()} "
                "is out of the range of float32, in which this format stores positions"
            )
        return single

    def __enter__(self) -> Self:
        """Returns the writer itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, _: object, __: TracebackType | None
    ) -> None:
        """Finishes the file, or removes the unfinished one."""
        if kind is not None:
            self._undo()
            return
        with self._undoing(), self._blaming():
            if self._frame < self.header.n_frames:
                told = f"only {self._frame} of {self.header.n_frames} frames were appended"
                raise InputError(told, file=self.path)
            self._finish()
            self.refuse_existing(self.path, self._overwrite)
            if outdated := self._outdated():
                names = some_of([file.name for file in outdated], 3)
                self.remarks.append(
                    f"older files that no new ones replace are removed ({len(outdated)}): {names}"
                )
            self._place()
            self._working.close()

    @contextlib.contextmanager
    def _undoing(self) -> Iterator[None]:
        try:
            yield
        except BaseException:
            self._undo()
            raise

    def _undo(self) -> None:
        """Removes everything."""
        with contextlib.suppress(Exception):
            self._close()
        self._working.close()

    def _blaming(self) -> contextlib.AbstractContextManager[None]:
        return blaming(self.path, self._made())
