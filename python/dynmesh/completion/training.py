"""Files with complete frames of the same mesh, from which it is learned how its shape varies."""

import contextlib
import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TypeAlias

from .. import files
from .._checks import check_path
from .._errors import InputError, KindError, SettingError, locating
from .._progress import tracked
from .._report import some_of
from ..files import PathLike, Reader
from ..files.frame import check_whole
from ..files.reader import check_same_mesh
from ..sequence import Positions

TrainingFiles: TypeAlias = PathLike | Iterable[PathLike]
"""The path of a training file, or those of several."""

_EXPECTED = "a path or a list of paths"


def paths_of(training: TrainingFiles | None) -> tuple[Path, ...]:
    """Returns the paths of the training files; none for None.

    Raises:
        TypeError, ValueError: they are not paths, or there are none.
    """
    if training is None:
        return ()
    given = [training] if isinstance(training, str | os.PathLike) else training
    if not isinstance(given, Iterable):
        raise KindError(f"must be {_EXPECTED}, not {training!r}", argument="training")
    training_files = list(given)
    for training_file in training_files:
        check_path("training", training_file, _EXPECTED)
    if not training_files:
        raise InputError("names no file; leave it out if there is none", argument="training")
    return tuple(map(Path, training_files))


class Training:
    """The frames of all training files, one after another, which are read one at a time."""

    def __init__(self, training_files: tuple[Path, ...], reader: Reader, progress: bool) -> None:
        """Opens each training_file and compares its mesh with that of the sequence.

        Args:
            training_files: none if there is no training.
            reader: of the sequence.
            progress: whether to show a bar while they are read.

        Raises:
            OSError, ImportError, ValueError: a training file cannot be opened, or has another mesh,
                unit or up axis.
        """
        self._training_files = training_files
        self._reader = reader
        self._progress = progress
        self._n_frames = 0
        self.files: list[Path] = []
        for training_file in training_files:
            with _open(training_file, reader) as opened:
                check_same_mesh(opened, reader)
                self._n_frames += opened.n_frames
                self.files += opened.files

    @contextlib.contextmanager
    def frames(self) -> Iterator[Iterator[Positions] | None]:
        """Yields all frames, or None without training; names files in errors about them all."""
        read = tracked(self._frames_as_read(), self._n_frames, "reading training", self._progress)
        try:
            with files.naming(self._reader.path):
                yield read if self._training_files else None
        except SettingError as error:
            if error.argument == "training":
                several = len(self._training_files) > 1
                error.file = self._reader.path if several else self._training_files[0]
            raise

    def _frames_as_read(self) -> Iterator[Positions]:
        for training_file in self._training_files:
            with (
                files.naming(training_file),
                _open(training_file, self._reader) as opened,
                contextlib.closing(opened.frames()) as frames,
            ):
                for number, frame in enumerate(frames):
                    with locating(frame=opened.header.number(number)):
                        check_whole(frame, "; all frames of a training sequence must be whole")
                    yield frame.points


def _open(training_file: Path, reader: Reader) -> Reader:
    """Opens a training file, which may lack faces.

    Of a scene, it is the mesh at the same path, or else the only one that moves.
    """
    if not (meshes := files.meshes_of(training_file)):
        try:
            return files.open(training_file)
        except files.NoFacesError:
            return files.open(training_file, faces=reader.faces)
    wanted = reader.header.name
    if wanted in meshes:
        return files.open(training_file, prim=wanted)
    moving = [mesh for mesh, moves in meshes.items() if moves]
    if len(moving) > 1:
        raise InputError(
            f"has no mesh '{wanted}', as {reader.path} has; those that move are {some_of(moving)}",
            file=training_file,
        )
    return files.open(training_file)
