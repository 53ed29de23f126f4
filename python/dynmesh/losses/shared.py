"""What all simulations share: numbered frames, random numbers, and checks of arguments."""

import math
from collections.abc import Iterable, Iterator, Sequence
from enum import IntEnum

import numpy as np

from .. import _arrays
from .._arrays import Integers, Positions
from .._checks import check_array
from .._errors import InputError, KindError, locating
from ..header import check_faces
from ..polygons import Faces, split_faces
from .visibility import Camera


class Purpose(IntEnum):
    """What random numbers are for; different purposes get independent ones from the same seed."""

    # Starts at 1, since NumPy treats a trailing 0 in a seed as absent: :func:`random_known` has
    # none.
    PATCH = 1
    DROPOUT = 2
    NOISE = 3
    OUTLIERS = 4
    SCAN = 5
    DEPTH = 6


def rng_of(purpose: Purpose, seed: int, *numbers: int) -> "np.random.Generator":
    """Returns the random numbers for one purpose and, for example, one frame."""
    return np.random.default_rng([seed, *numbers, purpose])


def numbered(frames: Iterable[Positions]) -> Iterator[tuple[int, Positions]]:
    """Yields frames with their numbers; raises an error for those that do not match frame 0."""
    expected: tuple[int, ...] = ()
    for frame, points in enumerate(_arrays.frames("frames", frames)):
        with locating(frame=frame):
            points = _arrays.first_frame("points", points)
        expected = expected or points.shape
        if points.shape != expected:
            raise InputError(
                f"must have shape {expected} as frame 0, not {points.shape}", frame=frame
            )
        yield frame, points


def round_up(value: float) -> float:
    """Returns the next of 1, 2 or 5 times a power of ten, for positive values."""
    power = math.floor(math.log10(value))
    steps = (float(f"{digit}e{power}") for digit in (1, 2, 5, 10))
    return next(step for step in steps if step >= value * (1 - 1e-9))


def triangles_of(faces: Faces) -> Integers:
    """Returns the triangles, or raises an error; that all corners are vertices is not checked."""
    triangles, _ = split_faces(faces)
    check_array("faces", triangles)
    check_faces(triangles.dtype, triangles.shape)
    return triangles


def check_cameras(cameras: Sequence[Camera], none: str) -> None:
    """Raises an error unless these are cameras; `none` describes an empty sequence."""
    if not isinstance(cameras, Sequence):
        raise KindError(f"must be a sequence of cameras, not {cameras!r}", argument="cameras")
    if len(cameras) == 0:
        raise InputError(f"must be at least one, but {none}", argument="cameras")
    for number, camera in enumerate(cameras):
        if not isinstance(camera, Camera):
            raise KindError(f"item {number} must be a Camera, not {camera!r}", argument="cameras")
