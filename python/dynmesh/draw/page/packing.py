"""Arrays as text for the script of the page, which unpacks them: see data.js."""

import base64
import json
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray


def packed(values: NDArray[np.generic]) -> str:
    """Compresses the bytes of an array, little-endian and row by row."""
    swapped = values.astype(values.dtype.newbyteorder("<"))
    return base64.b64encode(zlib.compress(swapped.tobytes(), 6)).decode()


def packed_bytes(values: NDArray[np.uint8]) -> str:
    """Packs (n, k) bytes as differences between frames, most of which are 0."""
    return packed(np.diff(values, axis=0, prepend=np.zeros_like(values[:1])))


def packed_positions(positions: NDArray[np.int16]) -> str:
    """Packs (n, k, 3) positions as second differences, between frames and between vertices.

    Neighbouring vertices often have similar numbers and move alike, so that most of these are
    small. Their signs are in the lowest bit, and their low bytes come before their high bytes:
    both make zeros of the high bytes. Together this is a quarter of what the positions themselves
    take when compressed.
    """
    rows = positions.transpose(0, 2, 1)
    for axis in (0, 2):
        rows = np.diff(rows, axis=axis, prepend=np.zeros_like(rows.take([0], axis=axis)))
    folded = ((rows << 1) ^ (rows >> 15)).astype(np.uint16)
    return packed(np.stack([folded & 0xFF, folded >> 8]).astype(np.uint8))


def packed_masks(masks: NDArray[np.bool_]) -> str | None:
    """Packs (n, k) masks; returns None if they are True everywhere."""
    if masks.all():
        return None
    return packed(np.packbits(masks, axis=1, bitorder="little"))


def embedded(value: Any) -> str:
    """Encodes JSON such that it cannot end the script that contains it."""
    return json.dumps(value).replace("<", "\\u003c")
