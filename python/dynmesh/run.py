"""Frames that are made while they are gone through, once, and those of them that are kept."""

import os
import tempfile
from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import replace
from importlib import import_module
from itertools import chain, islice
from pathlib import Path
from typing import Any, Generic, NoReturn, TypeVar, cast

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ._errors import InputError, KindError, naming
from ._report import DoubtfulWarning, Report, warn
from .frame import Frame, Frames, Indices, checked, summary
from .header import ATTRIBUTES, Header, Origin
from .stored import Stored

R = TypeVar("R", bound=Report)


class Run(Frames, Generic[R]):
    """Frames that are made while they are gone through, once: what a verb makes of a file.

    Write them by :meth:`write`, read them into memory by :meth:`read`, or go through them; `report`
    then says what was done. A result that is doubtful is a :class:`dynmesh.DoubtfulWarning`
    as well, and what is made of doubtful frames is doubtful.
    """

    def __init__(
        self,
        header: Header,
        make: Callable[[], Iterator[Frame] | Generator[Frame, None, R]],
        source: Frames | None = None,
        *,
        files: Sequence[Path] = (),
        origin: Origin | None = None,
        wanted: Sequence[str] = (),
        measured: Path | None = None,
        close: Callable[[], object] = lambda: None,
    ) -> None:
        """Takes what makes the frames.

        Args:
            header: of the frames that are made.
            make: returns an iterator over the frames; a generator may return a report.
            source: the frames of which they are made, if there are any.
            files: those that are read beside those of the source.
            origin: the file of their mesh.
            wanted: see :class:`Frames`.
            measured: what a doubtful result is of, if not of the source.
            close: closes what was opened for the frames.
        """
        self.header, self.path, self.files, self.wanted = header, Path("frames"), files, wanted
        if source is not None:
            self.path, self.files, self.lost = source.path, [*source.files, *files], source.lost
        self.origin, self._measured = origin, measured or self.path
        self._make, self._source, self._opened = make, source, close
        self._has_begun, self._report = False, cast(Any, None)

    def __iter__(self) -> Iterator[Frame]:
        """Makes all frames, from the first on.

        The report is there before the last one is yielded, after which nobody may ask for more.
        """
        self._check_open()
        if self._has_begun:
            raise InputError(
                "its frames were gone through, which is possible once; read() keeps them in memory",
                file=self.path,
            )
        self._has_begun = True
        return self._passing()

    def _passing(self) -> Generator[Frame, None, None]:
        frames = iter(self._make())
        yield from islice(frames, self.n_frames - 1)
        last = next(frames, None)
        if last is None:  # there are fewer than the header says, so nothing is reported of them
            return
        try:
            further = next(frames)
        except StopIteration as end:
            done = Report() if end.value is None else end.value
            before = None if self._source is None else self._source.report
            if done.quality == "good" and before is not None:
                done = replace(done, quality=before.quality, reason=before.reason)
            self._report = done
            if done.reason:
                warn(f"{self._measured}: {done.reason}", DoubtfulWarning)
        else:
            frames = chain([further], frames)  # which are too many
        yield last
        yield from frames

    @property
    def report(self) -> R:
        """What was done, as soon as all frames have been made."""
        if self._report is None:
            raise InputError("no report yet: read() or write() the frames first")
        report: R = self._report
        return report

    def write(self, path: str | os.PathLike[str], **options: Any) -> Any:
        """Writes the frames to a file: see :func:`dynmesh.write`."""
        return import_module(".formats", __package__).write(path, self, **options)

    def read(self) -> Any:
        """Reads the frames into memory, as a :class:`dynmesh.Sequence`."""
        return import_module(".sequence", __package__).read(self)

    def _close(self) -> None:
        self._opened()

    def __getitem__(self, frames: object) -> NoReturn:
        raise KindError("frames are made one after another; read() gives all of them")

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NoReturn:
        raise KindError("frames are made one after another; read() gives arrays")

    def __getattr__(self, name: str) -> NoReturn:
        hint = "; read() gives all frames, with arrays" if name in _OF_ARRAYS else ""
        raise AttributeError(f"a Run has no attribute {name!r}{hint}")

    def __repr__(self) -> str:
        counts = summary(self.n_frames, self.n_vertices, len(self.faces), self.dtype)
        return f"{type(self).__name__}({str(self.path)!r}: {counts}, made when gone through)"


_OF_ARRAYS = {"vertices", *ATTRIBUTES}


class Kept(Stored):
    """The frames of a run in an unnamed temporary file, as far as they were wanted."""

    def __init__(self, run: Frames) -> None:
        self._run, self._records, self._n_kept = run, cast(Records | None, None), 0
        self.path, self.files, self.lost = run.path, run.files, run.lost
        self.header, self.origin, self.wanted = run.header, run.origin, run.wanted

    @property
    def report(self) -> Any:
        """That of the run, all frames of which are made for it."""
        self._keep(self.n_frames)
        return self._run.report

    def _frames(self, numbers: Indices) -> Iterator[Frame]:
        for number in numbers:
            yield self._keep(number + 1).frame(number)

    def _keep(self, n: int) -> "Records":
        if self._records is None:
            self._records, self._left = Records(self.header, self.n_frames), checked(self._run)
        while self._n_kept < n:
            self._records.store(self._n_kept, next(self._left))
            self._n_kept += 1
        return self._records

    def _close(self) -> None:
        self._records = None
        self._run.close()


class Records:
    """Space for n frames, in an unnamed temporary file."""

    def __init__(self, header: Header, n: int) -> None:
        k = header.n_vertices
        kinds: list[Any] = [("points", header.dtype, (k, 3))]
        kinds += [(name, ATTRIBUTES[name].dtype, (k,)) for name in header.attributes]
        record = np.dtype(kinds)
        self._rows: NDArray[Any] = np.empty(0, record)
        if n * record.itemsize == 0:
            return
        with naming(Path(tempfile.gettempdir())), tempfile.TemporaryFile() as file:
            if hasattr(os, "posix_fallocate"):  # else a full disk would end the process
                os.posix_fallocate(file.fileno(), 0, n * record.itemsize)
            self._rows = np.memmap(file, record, "w+", shape=(n,))

    def store(self, number: int, frame: Frame) -> None:
        """Keeps a frame."""
        for name in self._rows.dtype.names or ():
            self._rows[name][number] = getattr(frame, name)

    def frame(self, number: int) -> Frame:
        """A frame that was kept."""
        names = self._rows.dtype.names or ()
        return Frame(**{name: np.array(self._rows[name][number]) for name in names})

    def __len__(self) -> int:
        return len(self._rows)
