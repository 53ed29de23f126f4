"""Takes: files with complete frames of the same mesh, from which it is learned how it varies."""

import contextlib
import os
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TypeAlias

from .. import files
from .._checks import check_path
from .._core import Completer, RehearsalSummary, Tracker, rehearsal_summary
from .._errors import InputError, KindError, SettingError, locating
from ..files import PathLike, Reader
from ..files.scene_files import open_scene
from ..files.scenes import listed
from ..sequence import Positions
from ..settings import Settings
from .beginning import beginning_in, check_same_mesh, check_whole
from .checkpoint import identity

Takes: TypeAlias = PathLike | Iterable[PathLike]
"""The path of a take, or those of several."""

WatchTakes: TypeAlias = Callable[[Iterator[Positions], int], Iterator[Positions]]
"""Is called with the frames of all takes and their number; it must pass the frames on."""

_EXPECTED = "a path or a list of paths"


def check_takes(rehearsal: Takes | None, settings: Settings) -> tuple[Path, ...]:
    """Returns the paths of the takes.

    Raises:
        TypeError, ValueError: they are not paths, there are none, or the method has no rehearsal.
    """
    takes = paths_of(rehearsal)
    if takes and settings["method"] != "detail":
        raise SettingError("requires method='detail'", argument="rehearsal")
    return takes


def paths_of(rehearsal: Takes | None) -> tuple[Path, ...]:
    """Returns the paths of the takes; none for None.

    Raises:
        TypeError, ValueError: they are not paths, or there are none.
    """
    if rehearsal is None:
        return ()
    if isinstance(rehearsal, str | os.PathLike):
        rehearsal = (rehearsal,)
    elif not isinstance(rehearsal, Iterable):
        raise KindError(f"must be {_EXPECTED}, not {rehearsal!r}", argument="rehearsal")
    takes = list(rehearsal)
    for take in takes:
        check_path("rehearsal", take, _EXPECTED)
    if not takes:
        raise InputError("names no file; leave it out if there is none", argument="rehearsal")
    return tuple(map(Path, takes))


def files_in(takes: Iterable[Path]) -> Iterator[Path]:
    """Yields the files of takes that are scenes, and the paths of the others."""
    for take in takes:
        is_scene = files.format_of(take).scene is not None
        yield from open_scene(take).files if is_scene else [take]


class Rehearsal:
    """The frames of all takes, one after another, which are read one at a time."""

    def __init__(
        self,
        takes: tuple[Path, ...],
        reader: Reader,
        watch: WatchTakes | None = None,
    ) -> None:
        """Opens each take and compares its mesh with that of the sequence.

        Args:
            takes: none if there is no rehearsal.
            reader: of the sequence.
            watch: None if nobody watches.

        Raises:
            OSError, ImportError, ValueError: a take cannot be opened, or has another mesh, unit or
                up axis.
        """
        self._takes = takes
        self._reader = reader
        self._watch = watch
        self._n_frames = 0
        self.files: list[Path] = []
        for take in takes:
            with _open(take, reader) as opened:
                check_same_mesh(opened, reader)
                self._n_frames += opened.n_frames
                self.files += opened.files

    def __bool__(self) -> bool:
        """Whether there is a take."""
        return bool(self._takes)

    def described(self) -> dict[str, object]:
        """What a checkpoint remembers of it."""
        return {"rehearsal": list(map(identity, self.files))}

    def completer(self, first_frame: Positions, settings: Settings) -> Completer:
        """Creates the completer of the sequence, which reads the takes."""
        faces = self._reader.faces
        with self._naming():
            if not self._takes:
                return Completer(faces, first_frame, **settings)
            return Completer(faces, first_frame, rehearsal=self._frames(), **settings)

    def tracker(self, template: Positions, *, threads: int, uncertainty: bool) -> Tracker:
        """Creates a tracker of the mesh, which reads the takes."""
        frames = self._frames() if self._takes else None
        with self._naming():
            return Tracker(
                self._reader.faces,
                template,
                threads=threads,
                rehearsal=frames,
                uncertainty=uncertainty,
            )

    def summary(self) -> RehearsalSummary:
        """Reads the takes and says what the completer of the sequence would learn.

        Raises:
            OSError, ValueError: a take cannot be read, or no frame of the sequence is whole.
        """
        first = beginning_in(self._reader, "whole")
        with self._naming():
            return rehearsal_summary(self._reader.faces, first.points, self._frames())

    def _frames(self) -> Iterator[Positions]:
        frames = self._frames_as_read()
        return frames if self._watch is None else self._watch(frames, self._n_frames)

    def _frames_as_read(self) -> Iterator[Positions]:
        for take in self._takes:
            with (
                files.naming(take),
                _open(take, self._reader) as opened,
                contextlib.closing(opened.frames()) as frames,
            ):
                for number, frame in enumerate(frames):
                    with locating(frame=number):
                        check_whole(frame, "; all frames of a rehearsal must be whole")
                    yield frame.points

    @contextlib.contextmanager
    def _naming(self) -> Iterator[None]:
        """Adds the name of the take to what is said of the rehearsal as a whole."""
        try:
            with files.naming(self._reader.path):
                yield
        except SettingError as error:
            if error.argument != "rehearsal" or not self._takes:
                raise
            only = self._takes[0] if len(self._takes) == 1 else self._reader.path
            raise InputError(error.reason, argument="rehearsal", file=only) from error


def _open(take: Path, reader: Reader) -> Reader:
    """Opens a take, which may lack faces.

    Of a scene, it is the mesh at the same path, or else the only one that moves.
    """
    if files.format_of(take).scene is None:
        try:
            return files.open(take)
        except files.NoFacesError:
            return files.open(take, faces=reader.faces)
    meshes, wanted = open_scene(take).moves, reader.header.name
    if wanted in meshes:
        return files.open(take, prim=wanted)
    moving = [mesh for mesh, moves in meshes.items() if moves]
    if len(moving) > 1:
        raise InputError(
            f"has no mesh '{wanted}', as {reader.path} has; those that move are {listed(moving)}",
            file=take,
        )
    return files.open(take)
