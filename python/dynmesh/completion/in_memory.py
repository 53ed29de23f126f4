"""Completion of frames in memory: of a stream, one after another, or of a whole sequence."""

import warnings
from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import repeat, zip_longest
from pathlib import Path
from typing import Any, Unpack, overload

import numpy as np

from .. import _arrays
from .._errors import InputError, KindError, locating
from ..attributes import ATTRIBUTES
from ..completer import Completer
from ..files.memory import Collected, SequenceReader
from ..polygons import Faces
from ..sequence import Mask, Positions, Sequence
from ..settings import Settings
from .start import check_start, start_in
from .ways import OF_SEQUENCES, SequenceSettings, complete_frames, verdict, with_implied


@overload
def complete(
    faces: Faces,
    frames: Iterable[Positions],
    known: Iterable[Mask] | None = None,
    *,
    training: Iterable[Positions] | None = None,
    **settings: Unpack[Settings],
) -> Iterator[Positions]: ...
@overload
def complete(
    faces: Sequence,
    *,
    training: Iterable[Positions] | None = None,
    **settings: Unpack[SequenceSettings],
) -> Sequence: ...
def complete(
    faces: Faces | Sequence,
    frames: Iterable[Positions] | None = None,
    known: Iterable[Mask] | None = None,
    *,
    training: Iterable[Positions] | None = None,
    **settings: Unpack[SequenceSettings],
) -> Iterator[Positions] | Sequence:
    """Completes frames one after another, in constant memory, or a whole sequence.

    Of frames, this is an iterator: nothing is read or checked before the first is requested. A
    sequence is completed at once, as :func:`dynmesh.complete_file` completes a file. In one that
    was completed before, what was estimated is estimated again.

    Args:
        faces: (m, 3) integers, other polygons, or a :class:`dynmesh.Sequence`, which has frames and
            masks itself.
        frames: (k, 3) positions each. The first frame must be complete and is yielded unchanged. Of
            a sequence with masks, give these as `known`, or the sequence alone.
        known: (k,) bool for each frame, or None if rows that are not finite are missing.
        training: complete frames of the same mesh, seen before, from which method detail learns;
            see :class:`dynmesh.Completer`. They are read when the first frame is requested.
        **settings: `method`, `noise` and the other settings of :class:`dynmesh.Completer`, which
            explains them; and of a sequence `start`, `bidirectional` and others, which
            :func:`dynmesh.complete_file` explains. None of its frames need be whole.

    Returns:
        An iterator over (k, 3) completed frames, each a new array with the dtype of the first
        frame; or a sequence with generation, age and, with `uncertainty`, standard errors.

    Raises:
        ValueError, TypeError: the errors of :class:`dynmesh.Completer`, with the number of the
            frame; also if there is no frame, or if frames and masks differ in number.

    Warns:
        UserWarning: a completed sequence is doubtful or probably ruined, by its own measure.
    """
    if isinstance(faces, Sequence):
        for name, given in (("frames", frames), ("known", known)):
            if given is not None:
                raise InputError("is that of the sequence; leave it out", argument=name)
        return _complete_sequence(faces, training, settings)
    if frames is None or isinstance(frames, str | Path):
        kind = type(faces if frames is None else frames).__name__
        told = f"must be positions, unless faces is a Sequence, not {kind}"
        raise KindError(f"{told}; complete_file completes files", argument="frames")
    if of_sequences := settings.keys() & OF_SEQUENCES:
        raise InputError(
            f"{', '.join(of_sequences)}: for a Sequence, whose frames can be read more than once, "
            "not for a stream of frames",
            argument="frames",
        )
    of_completer: Any = settings
    return _complete_frames(faces, frames, known, training, of_completer)


def _complete_frames(
    faces: Faces,
    frames: Iterable[Positions],
    known: Iterable[Mask] | None,
    training: Iterable[Positions] | None,
    settings: Settings,
) -> Iterator[Positions]:
    pairs = _pair(frames, known)
    first = next(pairs, None)
    if first is None:
        raise InputError("is empty, but frame 0 is needed, complete", argument="frames")
    points, mask = first
    given = None if mask is None else _arrays.known_mask(mask)
    if given is not None and not given.all():
        told = f"vertex {given.argmin()} is missing, but frame 0 must be complete"
        raise InputError(told, argument="known")
    completer = Completer(faces, points, training=training, **settings)
    if given is not None:
        ATTRIBUTES["known"].check(given.dtype, given.shape, (completer.n_vertices,))
    yield np.array(points, completer.dtype)
    for number, (points, mask) in enumerate(pairs, 1):
        with locating(frame=number):
            completed = completer.push(points, mask)
        yield completed


def _complete_sequence(
    sequence: Sequence, training: Iterable[Positions] | None, given: SequenceSettings
) -> Sequence:
    start = given.get("start", "auto")
    check_start(start, None)
    settings = with_implied(given, trained=training is not None)
    reader = SequenceReader(sequence)
    whole = start_in(reader, start, settings)
    completer = Completer(sequence.faces, whole.points, training=training, **settings)
    made = Collected(
        replace(
            reader.header,
            has_known=given.get("drop_above") is not None,
            has_provenance=True,
            has_standard_error=completer.settings["uncertainty"],
            standard_error_of="position",
        )
    )
    tally = complete_frames(reader, whole, completer, made, given)
    _, reason = verdict(tally, whole, reader.header)
    if reason:
        warnings.warn(reason, stacklevel=3)
    return made.sequence()


def _pair(
    frames: Iterable[Positions], known: Iterable[Mask] | None
) -> Iterator[tuple[Positions, Mask | None]]:
    positions = _arrays.frames("frames", frames)
    if known is None:
        yield from zip(positions, repeat(None), strict=False)
        return
    missing: Any = object()
    masks = _arrays.frames("known", known)
    pairs: Iterator[tuple[Any, Any]] = zip_longest(positions, masks, fillvalue=missing)
    for number, (points, mask) in enumerate(pairs):
        if points is missing or mask is missing:
            short, long = ("frames", "known") if points is missing else ("known", "frames")
            raise InputError(f"ends before frame {number}, but {long} goes on", argument=short)
        yield points, mask
