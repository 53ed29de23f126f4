"""Checks and converts the arrays of scans: points, or depth images with their cameras."""

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from . import _arrays
from ._arrays import Positions
from ._errors import InputError, KindError

Colours: TypeAlias = NDArray[np.uint8] | Positions


def scan_arrays(
    points: Positions,
    normals: Positions | None,
    viewpoints: Positions | None,
    dtype: Any,
    colours: Colours | None = None,
) -> tuple[Positions, Positions | None, Positions | None, Positions | None]:
    """Returns the arrays of a scan as the core takes them."""
    result = _arrays.points("points", points, dtype, "(n, 3)")
    if normals is not None:
        normals = _arrays.points("normals", normals, dtype, "(n, 3)")
    if viewpoints is not None:
        viewpoints = _arrays.points("viewpoints", viewpoints, dtype, "(c, 3)")
    if colours is not None:
        given = _arrays.plain("colours", colours)
        given = given.astype(dtype) if given.dtype.kind in "iu" else given
        given = np.repeat(given[:, None], 3, axis=1) if given.ndim == 1 else given
        colours = _arrays.points("colours", given, dtype, "(n, 3) or (n,)")
    return result, normals, viewpoints, colours


def image_arrays(
    depth: Any, intrinsics: Any, pose: Any, colours: Any = None
) -> list[tuple[NDArray[Any] | None, ...]]:
    """Returns the arrays of depth images, one or several, as the core takes them."""
    images, cameras, poses = (
        _several(name, given)
        for name, given in (("depth", depth), ("intrinsics", intrinsics), ("pose", pose))
    )
    coloured = [None] * len(images) if colours is None else _several("colours", colours, 3)
    for name, given in (("intrinsics", cameras), ("pose", poses), ("colours", coloured)):
        if len(given) != len(images):
            raise InputError(
                f"there are {len(given)}, but {len(images)} depth images", argument=name
            )
    return [
        (
            _depths(image),
            _matrix("intrinsics", camera, 3),
            _matrix("pose", turn, 4),
            None if colour is None else _colours(colour, np.shape(image)),
        )
        for image, camera, turn, colour in zip(images, cameras, poses, coloured, strict=True)
    ]


def _several(name: str, given: Any, dimensions: int = 2) -> list[Any]:
    """The arrays of each camera; one array, or the list of its rows, is that of one camera."""
    if not isinstance(given, np.ndarray | list | tuple):
        raise KindError(
            f"must be an array, or a list of arrays, not {type(given).__name__}", argument=name
        )
    if isinstance(given, np.ndarray):
        is_one = given.ndim <= dimensions
    else:
        is_one = bool(given) and np.ndim(given[0]) < 2
    return [given] if is_one else list(given)


def _depths(image: Any) -> NDArray[np.float32]:
    array = _arrays.plain("depth", image)
    if array.dtype.kind != "f":
        message = f"must be float32 or float64, in the unit of the template, not {array.dtype}"
        raise KindError(message, argument="depth")
    if array.ndim != 2:
        raise InputError(f"must have shape (h, w), not {array.shape}", argument="depth")
    with np.errstate(over="ignore"):
        return np.require(array, np.float32, ["C", "A"])


def _colours(image: Any, size: tuple[int, ...]) -> NDArray[np.uint8]:
    array = _arrays.plain("colours", image)
    if array.dtype != np.uint8:
        raise KindError(f"must be uint8, not {array.dtype}", argument="colours")
    array = np.repeat(array[..., None], 3, axis=2) if array.ndim == 2 else array
    if array.shape != (*size, 3):
        message = f"must have shape {(*size, 3)} or {size}, as the depth image, not {array.shape}"
        raise InputError(message, argument="colours")
    return np.require(array, np.uint8, ["C", "A"])


def _matrix(name: str, given: Any, side: int) -> NDArray[np.float64]:
    array = _arrays.plain(name, given)
    if array.dtype.kind not in "fi":
        raise KindError(f"must be numbers, not {array.dtype}", argument=name)
    if array.shape != (side, side):
        raise InputError(f"must have shape ({side}, {side}), not {array.shape}", argument=name)
    return np.require(array, np.float64, ["C", "A"])
