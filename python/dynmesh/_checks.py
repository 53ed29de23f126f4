"""Checks of arguments: TypeError for the wrong kind, ValueError for a value out of range."""

import math
import os
import sys
from itertools import pairwise
from numbers import Real
from pathlib import Path
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from ._errors import InputError, KindError
from ._report import listed


def check_integer(name: str, value: object, least: float, most: float = math.inf) -> None:
    """Raises an error unless the value is an integer from `least` to `most`."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise KindError(f"must be an integer, not {value!r}", argument=name, value=value)
    if not least <= value <= most:
        bounds = f"at least {least}" if most == math.inf else f"from {least} to {most}"
        raise InputError(f"must be {bounds}, not {value!r}", argument=name, value=value)


def check_resolution(value: object) -> None:
    """Raises an error unless the value is a resolution of a tracker."""
    if isinstance(value, str) and value == "best":
        return
    allowed = "must be 'best' or a number of vertices, at least 1"
    if isinstance(value, int | np.integer) and not isinstance(value, bool):
        if not 1 <= value <= np.iinfo(np.int32).max:
            raise InputError(f"{allowed}, not {value!r}", argument="resolution", value=value)
        return
    refusal = InputError if isinstance(value, str) else KindError
    raise refusal(f"{allowed}, not {value!r}", argument="resolution", value=value)


def check_flags(**flags: object) -> None:
    """Raises an error unless the values are True or False."""
    for name, value in flags.items():
        if not isinstance(value, bool | np.bool_):
            raise KindError(f"must be True or False, not {value!r}", argument=name, value=value)


def check_number(name: str, value: object) -> None:
    """Raises an error unless the value is a number."""
    if isinstance(value, bool) or not isinstance(value, Real):
        raise KindError(f"must be a number, not {value!r}", argument=name, value=value)


def check_between(name: str, value: float, low: float, high: float) -> None:
    """Raises an error unless the value is above `low` and below `high`."""
    check_number(name, value)
    if not low < value < high:
        raise InputError(
            f"must be above {low} and below {high}, not {value}", argument=name, value=value
        )


def check_choice(name: str, value: object, choices: Any) -> None:
    """Raises an error unless the value is one of a Literal."""
    check_text(name, value)
    if value not in get_args(choices):
        expected = listed(map(repr, get_args(choices)), "or")
        raise InputError(f"must be {expected}, not {value!r}", argument=name, value=value)


def check_text(name: str, value: object) -> None:
    """Raises an error unless the value is text."""
    if not isinstance(value, str):
        raise KindError(f"must be text, not {value!r}", argument=name, value=value)


def check_finite(name: str, value: float) -> None:
    """Raises an error if the value is infinite or NaN."""
    check_number(name, value)
    try:
        is_finite = math.isfinite(value)
    except OverflowError:  # an integer
        is_finite = False
    if not is_finite:
        raise InputError(f"must be finite, not {value!s:.40}", argument=name, value=value)


def check_not_negative(name: str, value: float) -> None:
    """Raises an error unless the value is finite and at least 0."""
    check_finite(name, value)
    if value < 0:
        raise InputError(f"must be at least 0, not {value}", argument=name, value=value)


def check_positive(name: str, value: float) -> None:
    """Raises an error unless the value is finite and above 0."""
    check_number(name, value)
    if not 0 < value <= sys.float_info.max:
        raise InputError(f"must be positive and finite, not {value}", argument=name, value=value)


def check_vector(name: str, value: tuple[float, float, float]) -> None:
    """Raises an error unless the value is three finite numbers."""
    if not hasattr(value, "__len__"):
        raise KindError(f"must be three numbers, not {value!r}", argument=name, value=value)
    if len(value) != 3:
        raise InputError(f"must be three numbers, not {value}", argument=name, value=value)
    for coordinate in value:
        check_finite(name, coordinate)


def check_array(name: str | None, value: object) -> None:
    """Raises an error unless the value is an array, which has no mask."""
    refuse_mask(name, value)
    if not isinstance(value, np.ndarray):
        raise KindError(f"must be a numpy array, not {type(value).__name__}", argument=name)


def refuse_mask(name: str | None, value: object) -> None:
    """Raises an error if a value, or one in a list, says itself what of it was not observed.

    Functions that take positions would ignore that: the mask of a masked array, and `known` and
    `generation` of a :class:`dynmesh.Sequence` or of a frame. Those that take a Sequence as such
    carry them.
    """
    if isinstance(value, list | tuple):
        for one in value:
            if not isinstance(one, float | int):  # most are
                refuse_mask(name, one)
        return
    claimed = getattr(value, "claimed", None)
    if claimed is not None and claimed.all():  # of a frame of which all was observed
        return
    lost = ["mask"] if isinstance(value, np.ma.MaskedArray) else []
    lost += [one for one in ("known", "generation") if getattr(value, one, None) is not None]
    if lost:
        raise KindError(
            f"the {lost[0]} of a {type(value).__name__} would be ignored; pass what is complete, "
            "or a plain array and, where it is taken, `known`, true where one was observed",
            argument=name,
        )


def native(array: NDArray[Any]) -> NDArray[Any]:
    """Returns numbers as the processor has them: in its byte order, and aligned."""
    if array.dtype.isnative and array.flags.aligned:
        return array
    return np.require(array, array.dtype.newbyteorder("="), ["A"])


def as_array(name: str, value: Any, whole: type | None = None) -> Any:
    """Returns a list as an array, whole numbers as the type `whole`, and all else as it is.

    Arrays become native. Refuses what :func:`refuse_mask` does.
    """
    refuse_mask(name, value)
    if isinstance(value, np.ndarray):
        return native(value)
    if not isinstance(value, list | tuple):
        return value
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise InputError(f"cannot be converted to an array: {error}", argument=name) from error
    return array.astype(whole) if whole is not None and array.dtype.kind in "iu" else array


def path_of(name: str, value: object, expected: str = "a path", folder: Path | None = None) -> Path:
    """Returns a path as it is meant now: seen from the current folder, or from home if it has a ~.

    One in a table is seen from the folder of the table, which is then given.

    Every path that users give passes through here, since most are used later, when the current
    folder may be another one.
    """
    if not isinstance(value, str | os.PathLike) or not isinstance(os.fspath(value), str):
        raise KindError(f"must be {expected}, not {type(value).__name__}", argument=name)
    if not os.fspath(value):  # which pathlib takes for the current folder
        raise InputError("is empty", argument=name, value=value)
    # Unlike that of pathlib, this leaves the name of no user as it is, such as ~backup.obj.
    path = Path(folder or "", os.path.expanduser(value)).absolute()  # noqa: PTH111
    if ".." in path.parts:
        shorter = os.path.normpath(path)
        if os.path.realpath(shorter) == os.path.realpath(path):  # no folder before .. is a link
            return Path(shorter)
    return path


def check_complete(name: str | None, points: NDArray[np.floating[Any]]) -> None:
    """Raises an error unless there are positions, and all are finite."""
    if len(points) == 0:
        raise InputError("must have at least one vertex", argument=name)
    finite = np.isfinite(points).all(axis=1)
    if not finite.all():
        vertex = int(finite.argmin())
        position = tuple(points[vertex].tolist())
        raise InputError(f"must be finite, but vertex {vertex} is at {position}", argument=name)


def frame_index(frame: int | np.integer[Any], n_frames: int) -> int:
    """Returns the number of a frame, counted from 0, or raises an error if it does not exist."""
    if isinstance(frame, bool) or not isinstance(frame, int | np.integer):
        raise KindError(
            f"must be an integer or a slice, not {type(frame).__name__}", argument="frame"
        )
    if not -n_frames <= frame < n_frames:
        exist = f"must be from {-n_frames} to {n_frames - 1}" if n_frames else "there are none"
        raise IndexError(f"frame: {exist}, not {frame}")
    return int(frame) % n_frames


def indices_among(frames: Any, n_frames: int) -> range | list[int]:
    """Returns the indices, from 0, that a slice or a list of them chooses among n frames."""
    if isinstance(frames, slice):
        if frames.step is not None:
            check_integer("step", frames.step, 1)
        return range(n_frames)[frames]
    array = np.asarray(frames)
    if array.ndim != 1 or (array.dtype.kind not in "iu" and array.size):
        message = (
            f"must be an integer, a slice or indices, not {type(frames).__name__} of {array.dtype}"
        )
        raise KindError(message, argument="frame")
    indices = [frame_index(index, n_frames) for index in array.tolist()]
    if any(later <= one for one, later in pairwise(indices)):
        raise InputError(f"must ascend, not {indices}", argument="frames")
    return indices


def selected(n_frames: int, start: int, stop: int | None, step: int) -> range:
    """Returns the indices of the frames ``[start:stop:step]`` of n."""
    for name, value in (("start", start), ("stop", stop), ("step", step)):
        if value is not None:
            check_integer(name, value, -math.inf)
    if step == 0:
        raise InputError("must not be 0", argument="step")
    return range(n_frames)[start:stop:step]


def check_times(times: NDArray[np.float64] | None, n_frames: int) -> None:
    """Raises an error unless these are the times of n frames."""
    if times is None:
        return
    check_array("times", times)
    if times.dtype != np.float64:
        raise KindError(f"must be float64, not {times.dtype}", argument="times")
    if times.shape != (n_frames,):
        raise InputError(
            f"must have shape {(n_frames,)} to match vertices, not {times.shape}", argument="times"
        )
    wrong = ~np.isfinite(times)
    wrong[1:] |= ~(times[1:] > times[:-1])
    if wrong.any():
        frame = int(wrong.argmax())
        raise InputError(
            f"must be finite and ascending, but frame {frame} is at {times[frame]}",
            argument="times",
        )
