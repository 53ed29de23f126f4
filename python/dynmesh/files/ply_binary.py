"""The elements of a binary PLY file."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .ply_elements import Columns, Element, as_column

Integers = NDArray[np.int64]


def read_binary(elements: list[Element], data: bytes, begin: int) -> dict[str, Columns]:
    """Reads what follows the header.

    Args:
        elements: that the header announces.
        data: the file.
        begin: where its header ends.

    Returns:
        The columns of each element, by its name, in the byte order of the file.

    Raises:
        ValueError: the file is shorter or longer than its elements, or a list is shorter than none.
    """
    columns = {}
    for element in elements:
        kinds = element.properties.values()
        least = element.count * sum((kind.count_dtype or kind.dtype).itemsize for kind in kinds)
        element.check_size(least, len(data) - begin, "bytes")
        columns[element.name], begin = _read_element(element, data, begin)
    if begin < len(data):
        raise ValueError(f"goes on after its last element, for {len(data) - begin} bytes")
    return columns


def _read_element(element: Element, data: bytes, begin: int) -> tuple[Columns, int]:
    """Reads all records and says where they end."""
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
    """Finds the first n records, one after another, as only the lists in one say where it ends.

    Returns:
        (n, p) where the numbers of each property begin, (n, p) how many they are, and the end.
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
                    raise ValueError(f"record {record} of {element.name!r}: has a list of {size}")
            places.append(place)
            sizes.append(size)
            place += size * width
        if place > len(data):
            raise ValueError(
                f"is cut or damaged: record {record} of {element.name!r} ends at byte {place}, "
                f"but the file at byte {len(data)}"
            )
    shape = (n, len(kinds))
    return (
        np.array(places, np.int64).reshape(shape),
        np.array(sizes, np.int64).reshape(shape),
        place,
    )


def _spread(places: Integers, sizes: Integers, width: int) -> Integers:
    """Where each number lies, of lists of these sizes that begin at these places."""
    begins = places - (np.cumsum(sizes) - sizes) * width
    return np.asarray(np.repeat(begins, sizes) + np.arange(sizes.sum()) * width)


def _read_equal(
    element: Element, data: bytes, places: Integers, sizes: Integers, stride: int
) -> Columns | None:
    """Reads records of one length, as most are; None where lists are not as long as the first's."""
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
