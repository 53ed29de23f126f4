"""What is read before completion begins: the whole frame that it starts from, and training.

The whole frame is one of the sequence, or a template. What a frame of the sequence lacks is put
together from the others.
"""

import contextlib
import os
from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np

from .. import formats
from .._arrays import Positions
from .._checks import path_of, refuse_mask
from .._errors import DynmeshError, InputError, KindError, SettingError, locating
from .._report import counted, tracked
from ..completer import Settings
from ..formats import OneSequence, PathLike
from ..formats.conversion import check_same_mesh
from ..formats.times import index_of
from ..frame import FUSED, Frame, Frames, check_whole, frame_at
from ..header import Header, Origin
from ..polygons import Mesh, Polygons
from ..sequence import Sequence, as_sequence
from ..whole_frames import WholeFrame, whole_frame

Start: TypeAlias = int | Literal["auto", "best"]
"""The frame from which completion starts."""


@dataclass(frozen=True, eq=False)
class StartFrame:
    """A whole frame.

    Attributes:
        points: (k, 3), with the dtype of the sequence.
        number: of the frame in the sequence, counted from 0, or -1 for a template, which stands
            before the first frame.
        files: those that hold a template.
        sought: whether it was found by a search for the first whole frame.
        made: what was put together from other frames; None if the frame was whole.
        header: what a template states, where the sequence does not state it.
        polygons: the faces that the output keeps, of a template.
        origin: the file whose contents the output keeps, of a template.
    """

    points: Positions
    number: int = 0
    files: tuple[Path, ...] = ()
    sought: bool = False
    made: WholeFrame | None = None
    header: Header | None = None
    polygons: Polygons | None = None
    origin: Origin | None = None

    def number_in(self, header: Header) -> float | None:
        """The number of the frame in its file; None for a template."""
        return None if self.number < 0 else header.number(self.number)

    def frame(self, dtype: np.dtype[Any], uncertainty: bool) -> Frame:
        """The frame as the output has it, with positions of this dtype."""
        k, result = len(self.points), self.made
        generation = np.zeros(k, np.int32)
        if result is not None:
            generation[~result.known] = FUSED
        return Frame(
            self.points.astype(dtype),
            generation=generation,
            age=np.zeros(k, np.int32),
            standard_error=np.zeros(k, np.float32) if uncertainty else None,
        )

    def add_errors(self, frame: Frame, number: int) -> Frame:
        """Adds its standard errors to those of a completed frame, by squares.

        Only those of vertices that no frame nearer to that with this `number` knows, whose age is
        the distance between the two frames.
        """
        if self.made is None:
            return frame
        assert frame.age is not None
        distance = abs(number - self.number)
        errors = frame.standard_error
        if errors is not None:
            of_start = np.where(frame.age >= distance, self.made.standard_error, 0)
            errors = np.hypot(errors, of_start).astype(np.float32)
        return replace(frame, age=np.minimum(frame.age, distance), standard_error=errors)

    def remarks(self, header: Header) -> Iterator[str]:
        """Yields where completion started, if that is not clear, and from what."""
        number = self.number_in(header)
        if self.sought:
            yield f"completion started from frame {number}, the first whole one"
        if self.made is None:
            return
        k, known = len(self.points), int(np.count_nonzero(self.made.known))
        others = int(np.count_nonzero(self.made.seen)) - known
        told = f"; {others} were put together from other frames" if others else ""
        yield (
            f"completion started from frame {number}, which knows {known} of "
            f"{counted(k, 'vertex')}{told}"
        )


def check_start(start: object, template: object) -> None:
    """Refuses what cannot name a whole frame."""
    is_number = isinstance(start, int | np.integer) and not isinstance(start, bool)
    is_text = isinstance(start, str)
    if not is_number and not (is_text and start in ("auto", "best")):
        kind = InputError if is_text else KindError
        message = f"must be 'auto', 'best' or the number of a frame, not {start!r}"
        raise kind(message, argument="start", value=start)
    if template is not None and start != "auto":
        raise InputError(
            "stands before frame 0, so completion cannot also start at a frame",
            argument="template",
            value=template,
        )


@contextlib.contextmanager
def open_with_template(
    frames: Any, template: OneSequence | None, faces: Any = None
) -> Iterator[tuple[Frames, StartFrame | None]]:
    """Opens a sequence and, if there is one, the template from which completion starts."""
    if template is None:
        with formats.opened(frames, "sequence", faces=faces) as source:
            yield source, None
        return
    own = getattr(frames, "faces", None) if faces is None else faces
    with formats.opened(template, "template", formats.Shared(own)) as whole:
        shared = formats.Shared(whole.header.polygons or whole.faces)
        with formats.opened(frames, "sequence", shared, faces=faces) as source:
            first = template_of(whole)
            check_same_mesh(whole, source)
            # What the output keeps beside positions: polygons, texture coordinates, materials.
            has_own = source.header.polygons is not None and whole.texture is None
            shown = source if source.texture is not None or has_own else whole
            of_own = source.origin is not None and source.origin.is_scene
            origin = source.origin if of_own else whole.origin or source.origin
            if origin is not None:
                origin = replace(
                    origin, texture=shown.texture, remarks=source.remarks, is_scene=of_own
                )
            start = StartFrame(
                first.astype(source.dtype),
                -1,
                tuple(whole.files),
                header=whole.header,
                polygons=shown.header.polygons,
                origin=origin,
            )
            yield source, start


def start_in(
    reader: Frames, start: Start, settings: Settings, *, progress: bool | None = None
) -> StartFrame:
    """Returns the frame of the sequence from which its completion starts.

    A frame with missing vertices is put together, with the settings of the completer.
    """
    number: int | None = None
    if start == "auto":
        with contextlib.closing(reader.frames()) as frames:
            number = next((n for n, frame in enumerate(frames) if frame.observed.all()), None)
    elif start != "best":
        with formats.naming(reader.path):
            number = index_of(reader.header, start, "start")
    if number is not None:
        frame = frame_at(reader, number)
        if frame.observed.all():
            sought = start == "auto" and number > 0
            return StartFrame(np.array(frame.points), number, sought=sought)
    with locating(file=reader.path):
        result = whole_frame(
            reader.faces,
            reader,
            frame="best" if number is None else number,
            noise=settings.get("noise"),
            outliers=settings.get("reject_outliers", False),
            threads=settings.get("threads", 1),
            progress=progress,
        )
    return StartFrame(result.positions, result.frame, made=result)


def template_of(reader: Frames) -> Positions:
    """Returns a copy of the first frame, which must be whole."""
    frame = frame_at(reader, 0)
    with locating(file=reader.path):
        check_whole(frame, "; a template must be whole")
    return np.array(frame.points)


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
    prim = None
    if not isinstance(source, Frames):
        meshes, name = formats.meshes_of(source), like.header.name
        prim = name if name in meshes or sum(meshes.values()) > 1 else None
    return formats.opened(source, "training", formats.Shared(like.faces, prim))
