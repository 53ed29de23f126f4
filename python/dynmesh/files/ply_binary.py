"""Reads the elements of a binary PLY file."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .ply_elements import Columns, Element, as_column

Integers = NDArray[np.int64]


def read_binary(elements: list[Element], data: bytes, begin: int) -> dict[str, Columns]:
    """Reads the data after the header.

    Args:
        elements: declared in the header.
        data: the file.
        begin: offset of the end of the header.

    Returns:
        The columns of each element by name, in the byte order of the file.

    Raises:
        ValueError: the size of the file does not match its elements, or a list has a negative
            length.
    """
    columns = {}
    for element in elements:
        kinds = element.properties.values()
        least = element.count * sum((kind.count_dtype or kind.dtype).itemsize for kind in kinds)
        element.check_size(least, len(data) - begin, "bytes")
        columns[element.name], begin = _read_element(element, data, begin)
    if begin < len(data):
        raise ValueError(f"continues for {len(data) - begin} bytes after its last element")
    return columns


def _read_element(element: Element, data: bytes, begin: int) -> tuple[Columns, int]:
    """Reads all records and returns where they end."""
    if element.count:
        places, sizes, first_end = _find_records(element, data, begin, 1)
        end = begin + (first_end - begin) * element.count
        if end <= len(data):
            columns = _read_equal(element, data, places[0], sizes[0], first_end - begin)
            if columns is not None:
                return columns, end
    places, sizes, end = _find_records(element, data, begin, element.count)
    columns = {}
    for i, (name, kind) in enumerate(element.properties.items()):
        width = kind.dtype.itemsize
        octets = _spread(places[:, i], sizes[:, i], width)[:, None] + np.arange(width)
        values = np.frombuffer(data, np.uint8)[octets].view(kind.dtype)
        columns[name] = as_column(kind, sizes[:, i], values.reshape(-1))
    return columns, end


def _find_records(
    element: Element, data: bytes, begin: int, n: int
) -> tuple[Integers, Integers, int]:
    """Finds n records one after another, as a record with lists determines where the next begins.

    Returns:
        (n, p) offsets of the numbers of each property, (n, p) their counts, and the end.
    """
    kinds = [(kind.dtype.itemsize, kind.count_dtype) for kind in element.properties.values()]
    places, sizes, place = [], [], begin
    for record in range(n):
        for width, count in kinds:
            size = 1
            if count is not None:
                digits = data[place : place + count.itemsize]
                order: Any = "big" if count.str[0] == ">" else "little"
                size = int.from_bytes(digits, order, signed=count.kind == "i")
                place += count.itemsize
                if size < 0:
                    raise ValueError(
                        f"record {record} of {element.name!r}: has a list of length {size}"
                    )
            places.append(place)
            sizes.append(size)
            place += size * width
        if place > len(data):
            raise ValueError(
                f"is cut or damaged: record {record} of {element.name!r} ends at byte {place}, "
                f"but the file ends at byte {len(data)}"
            )
    shape = (n, len(kinds))
    return (
        np.array(places, np.int64).reshape(shape),
        np.array(sizes, np.int64).reshape(shape),
        place,
    )


def _spread(places: Integers, sizes: Integers, width: int) -> Integers:
    """Returns the offset of each number in lists of these sizes that begin at these offsets."""
    begins = places - (np.cumsum(sizes) - sizes) * width
    return np.asarray(np.repeat(begins, sizes) + np.arange(sizes.sum()) * width)


def _read_equal(
    element: Element, data: bytes, places: Integers, sizes: Integers, stride: int
) -> Columns | None:
    """Reads records of equal length, the usual case; None if lists differ in length."""
    n = element.count
    columns = {}
    for (name, kind), place, size in zip(element.properties.items(), places, sizes, strict=True):
        if kind.count_dtype is not None:
            begin = place - kind.count_dtype.itemsize
            counts: Any = np.ndarray(n, kind.count_dtype, data, begin, (stride,))
            if (counts != size).any():
                return None
        strides = (stride, kind.dtype.itemsize)
        values: Any = np.ndarray((n, size), kind.dtype, data, place, strides)
        columns[name] = as_column(kind, np.full(n, size), values.reshape(-1))
    return columns
