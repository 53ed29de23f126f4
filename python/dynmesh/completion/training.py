"""Complete frames of the same mesh, from which it is learned how its shape varies."""

import contextlib
import os
from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from .. import formats
from .._arrays import Positions
from .._checks import path_of, refuse_mask
from .._errors import DynmeshError, InputError, KindError, SettingError, locating
from .._progress import tracked
from ..formats import PathLike
from ..formats.comparison import check_same_mesh
from ..frame import Frames, check_whole
from ..polygons import Mesh
from ..sequence import Sequence, as_sequence

TrainingFrames: TypeAlias = PathLike | Frames | Positions | Iterable[PathLike | Frames | Mesh]
"""A file with training frames, frames of :func:`dynmesh.open`, positions (n, k, 3), meshes of
trimesh or PyVista, or several files or frames."""

_EXPECTED = "a path, frames, positions (n, k, 3), or a list of paths or frames"


class Training:
    """All training frames, one after another, which are read one at a time."""

    def __init__(
        self, training: TrainingFrames | None, like: Frames, progress: bool | None
    ) -> None:
        """Compares the mesh of each file with that of the sequence.

        Args:
            training: None if there is none.
            like: the sequence.
            progress: whether to show a bar while they are read.
        """
        self._sources = _sources(training, like)
        self._like = like
        self._progress = progress
        self._n_frames = 0
        self.files: list[Path] = []
        for source in self._sources:
            with _opened(source, like) as frames:
                check_same_mesh(frames, like)
                self._n_frames += frames.n_frames
                self.files += frames.files

    def __bool__(self) -> bool:
        return bool(self._sources)

    @contextlib.contextmanager
    def frames(self) -> Iterator[Iterator[Positions] | None]:
        """Yields all frames, or None without training; names files in errors about them all."""
        read = tracked(self._positions(), self._n_frames, "reading training", self._progress)
        try:
            with formats.naming(self._like.path):
                yield read if self._sources else None
        except SettingError as error:
            if error.argument == "training":
                only = self._sources[0] if len(self._sources) == 1 else None
                error.file = only if isinstance(only, Path) else self._like.path
            raise

    def _positions(self) -> Iterator[Positions]:
        for source in self._sources:
            with (
                _opened(source, self._like) as opened,
                formats.naming(opened.path),
                contextlib.closing(opened.frames()) as frames,
            ):
                for number, frame in enumerate(frames):
                    with locating(frame=opened.header.number(number)):
                        check_whole(frame, "; all frames of a training sequence must be whole")
                    yield frame.points


def _sources(training: TrainingFrames | None, like: Frames) -> list[Path | Frames]:
    """Returns the paths and frames of training; none for None."""
    if training is None:
        return []
    if isinstance(training, np.ndarray):
        refuse_mask("training", training)
        try:
            return [Sequence(training, like.faces).named("training")]
        except DynmeshError as error:
            error.argument = "training"
            raise
    if (own := as_sequence(training)) is not None:  # meshes of other libraries
        return [own.named("training")]
    listed: Any = [training] if isinstance(training, str | os.PathLike | Frames) else training
    if not isinstance(listed, Iterable):
        raise KindError(f"must be {_EXPECTED}, not {training!r}", argument="training")
    sources: list[Path | Frames] = []
    for source in listed:
        if isinstance(source, Frames):
            sources.append(source)
            continue
        sources.append(path_of("training", source, _EXPECTED))
    if not sources:
        raise InputError("names no file; leave it out if there is none", argument="training")
    return sources


def _opened(source: Path | Frames, like: Frames) -> AbstractContextManager[Frames]:
    """Opens training frames, of which a file may lack faces; frames stay open.

    Of a scene, it is the mesh at the same path, or else the only one that moves.
    """
    shared: formats.Source = {"faces": like.faces}
    if not isinstance(source, Frames):
        meshes, name = formats.meshes_of(source), like.header.name
        shared["prim"] = name if name in meshes or sum(meshes.values()) > 1 else None
    return formats.opened(source, "training", shared)
