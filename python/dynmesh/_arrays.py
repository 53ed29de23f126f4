"""Conversion of arguments to the packed arrays of one dtype that the compiled core takes."""

from collections.abc import Iterable
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import DTypeLike, NDArray

from ._checks import as_array, refuse_mask
from ._errors import DynmeshError, InputError, KindError
from .polygons import Faces, mesh_arrays, split_faces

Positions: TypeAlias = NDArray[np.floating[Any]]
"""float32 or float64, x, y, z on the last axis, in any unit of length.

Functions that take positions take no masks with them: a masked array, a frame or a
:class:`dynmesh.Sequence` that says what was not observed is refused with a TypeError.
"""

Mask: TypeAlias = NDArray[np.bool_]
"""True where a position was observed in its frame."""

Integers: TypeAlias = NDArray[np.integer[Any]]

Floats: TypeAlias = NDArray[np.float64]

_Frame = TypeVar("_Frame")

_MOST_ROWS = np.iinfo(np.int32).max


def plain(name: str, given: Any) -> NDArray[Any]:
    """Returns an array as it is, and a list as an array; refuses those with masks."""
    return np.asarray(as_array(name, given))


def frames(name: str, given: Iterable[_Frame]) -> Iterable[_Frame]:
    """Returns frames, or masks of frames, as they are; each is checked when it is reached."""
    refuse_mask(name, given)
    if not isinstance(given, Iterable):
        raise KindError(
            f"must be frames, an array or an iterable, not {type(given).__name__}", argument=name
        )
    return given


def floats(name: str, given: Any) -> Positions:
    """Returns an array as it is, a list of whole numbers as float64."""
    array = np.asarray(as_array(name, given, np.float64))
    if array.dtype.kind != "f" or array.itemsize not in (4, 8):
        may_be_faces = name == "first_frame" and array.dtype.kind in "iu"
        order = "; faces come before it" if may_be_faces else ""
        raise KindError(f"must be float32 or float64, not {array.dtype}{order}", argument=name)
    return array


def points(name: str, given: Any, dtype: DTypeLike, shape: str = "(k, 3)") -> Positions:
    """Returns positions, a row for each, as a packed array of a dtype."""
    if (
        type(given) is np.ndarray
        and given.dtype == dtype
        and given.ndim == 2
        and given.shape[1] == 3
        and given.flags.c_contiguous
        and given.flags.aligned
    ):
        return given
    array = floats(name, given)
    array = array.reshape(0, 3) if array.shape == (0,) else array  # of an empty list
    if array.ndim != 2 or array.shape[1] != 3:
        raise InputError(f"must have shape {shape}, not {array.shape}", argument=name)
    return packed(_countable(name, array), dtype)


def template(faces: Any, points: Any, name: str) -> tuple[Faces, Any]:
    """Returns faces and positions, which may be given as a mesh of another library."""
    mesh = mesh_arrays(faces)
    if points is not None and mesh is None:
        return faces, points
    if points is not None:
        raise InputError("is that of the mesh; give its faces alone for another", argument=name)
    if mesh is None:
        message = f"is missing, as faces are no mesh with positions, but {type(faces).__name__}"
        raise KindError(message, argument=name)
    return mesh


def first_frame(name: str, given: Any) -> Positions:
    """Returns positions as a packed array of their own dtype, which that of all others follows."""
    array = floats(name, given)
    return points(name, array, np.dtype(f"f{array.itemsize}"))


def packed(array: NDArray[Any], dtype: DTypeLike) -> NDArray[Any]:
    """Returns the array itself or a copy.

    A finite number out of the range of float32 becomes the largest, so that it is refused as too
    large and does not count as missing.
    """
    with np.errstate(over="ignore"):
        result = np.require(array, dtype, ["C", "A"])
    if result.itemsize < array.itemsize and (beyond := np.isinf(result) & np.isfinite(array)).any():
        result[beyond] = np.copysign(np.finfo(result.dtype).max, array[beyond])
    return result


def as_mask(known: NDArray[Any]) -> Mask:
    """Returns (k,) or (n, k) integers 0 and 1, or bytes 0 and 255, as bool, and bool as it is."""
    if known.dtype == np.bool_:
        return known
    if known.dtype.kind not in "iu":
        raise KindError(f"must be bool, or integers 0 and 1, not {known.dtype}", argument="known")
    mask = known.astype(np.bool_)
    is_image = known.dtype == np.uint8 and known.max(initial=0) == 255
    if len(others := np.argwhere(known != (255 * mask if is_image else mask))):
        *frame, vertex = others[0].tolist()
        raise InputError(
            f"must be 0 or 1 for each vertex, but vertex {vertex} has {known[*frame, vertex]}",
            argument="known",
            frame=frame[0] if frame else None,
        )
    return mask


def mask_in_file(known: NDArray[Any], least_confidence: float | None) -> Mask:
    """Returns a mask of a file as bool; one of confidences, where they are at least that."""
    if least_confidence is not None and known.dtype != np.bool_:
        return np.asarray(known >= least_confidence)
    try:
        return as_mask(known)
    except DynmeshError as error:
        error.reason += "; of confidences, `least_confidence` is the least that counts as known"
        raise


def known_mask(given: Any) -> Mask:
    """Returns a known mask (k,) as a packed array."""
    mask = plain("known", given)
    if mask.ndim != 1:
        raise InputError(f"must have shape (k,), not {mask.shape}", argument="known")
    return np.ascontiguousarray(as_mask(mask))


def indices(name: str, given: Any, shape: str = "(n,)") -> NDArray[np.int32]:
    """Returns integers as a packed array of int32; with the shape "(m, 3)", triangles."""
    array = plain(name, given)
    if array.dtype.kind not in "iu" and array.size:  # an empty list becomes float64
        raise KindError(f"must be integers, not {array.dtype}", argument=name)
    if array.shape[1:] != (() if shape == "(n,)" else (3,)) or array.ndim == 0:
        raise InputError(f"must have shape {shape}, not {array.shape}", argument=name)
    narrow = packed(_countable(name, array), np.int32)
    if (wrong := narrow != array).any():
        place = tuple(np.argwhere(wrong)[0])
        raise InputError(
            f"row {place[0]} holds {array[place]}, which cannot be a vertex index", argument=name
        )
    return narrow


def triangles(faces: Faces, n_vertices: int) -> NDArray[np.int32]:
    """Returns the triangles of faces, (m, 3), as a packed array."""
    return indices("faces", split_faces(faces, n_vertices)[0], "(m, 3)")


def output(out: Any, dtype: np.dtype[Any], n_vertices: int) -> Positions:
    """Returns `out`, or a new array if that is None or not packed."""
    if out is None:
        return np.empty((n_vertices, 3), dtype)
    if not isinstance(out, np.ndarray):
        raise KindError(f"must be a numpy array, not {type(out).__name__}", argument="out")
    refuse_mask("out", out)
    if out.dtype != dtype:
        raise KindError(
            f"must be {dtype}, the dtype of first_frame, not {out.dtype}", argument="out"
        )
    if out.ndim != 2 or out.shape[1] != 3:
        raise InputError(f"must have shape (k, 3), not {out.shape}", argument="out")
    if len(out) != n_vertices:
        raise InputError(
            f"has {len(out)} rows, but the mesh has {n_vertices} vertices", argument="out"
        )
    if not out.flags.writeable:
        raise InputError("is read-only", argument="out")
    reach = sum((n - 1) * abs(stride) for n, stride in zip(out.shape, out.strides, strict=True))
    if reach + out.itemsize < out.nbytes:
        raise InputError("has rows or columns that share memory", argument="out")
    return out if out.flags.carray else np.empty((n_vertices, 3), dtype)


def _countable(name: str, array: NDArray[Any]) -> NDArray[Any]:
    if len(array) > _MOST_ROWS:
        raise InputError(
            f"has {len(array)} rows, more than 32-bit indices can count", argument=name
        )
    return array
