"""Reads the elements of a PLY file in text: a line for each record, a word for each number."""

from typing import Any

import numpy as np

from .ply_elements import Columns, Element, Property, as_column


def read_text(elements: list[Element], text: bytes, first_line: int) -> dict[str, Columns]:
    """Reads the text after the header.

    Args:
        elements: declared in the header.
        text: the text after the header.
        first_line: number of the first line of the text.

    Returns:
        The columns of each element by name.

    Raises:
        ValueError: there are too few or too many lines or words, or a word is not a number of its
            type.
    """
    lines = text.splitlines()
    if lines and not text.endswith((b"\n", b"\r")):
        raise ValueError(
            f"is cut in line {first_line + len(lines) - 1}, or lacks the end of its last line"
        )
    columns = {}
    begin = 0
    for element in elements:
        element.check_size(element.count, len(lines) - begin, "lines")
        records = lines[begin : begin + element.count]
        columns[element.name] = _read_element(element, records, first_line + begin)
        begin += element.count
    for number, line in enumerate(lines[begin:], first_line + begin):
        if line.strip():
            raise ValueError(f"line {number}: continues after its last element")
    return columns


def _read_element(element: Element, lines: list[bytes], first_line: int) -> Columns:
    kinds = [*element.properties.values()]
    sizes: list[list[int]] = [[] for _ in kinds]
    numbers: list[list[float]] = [[] for _ in kinds]
    for line_number, line in enumerate(lines, first_line):
        try:
            row = _numbers(line)
            place = 0
            for i, kind in enumerate(kinds):
                size = 1
                if kind.count_dtype is not None:
                    size = _size(row[place : place + 1], kind.count_dtype)
                    place += 1
                sizes[i].append(size)
                numbers[i] += row[place : place + size]
                place += size
            if place != len(row):
                raise ValueError(f"has {len(row)} words, but {element.name!r} needs {place}")
        except ValueError as error:
            raise ValueError(f"line {line_number}: {error}") from error
    return {
        name: _column(kind, sizes[i], numbers[i], first_line)
        for i, (name, kind) in enumerate(element.properties.items())
    }


def _numbers(line: bytes) -> list[float]:
    try:
        if b"_" in line:  # which Python would accept in a number
            raise ValueError(f"{line!r} contains a '_'")
        return [float(word) for word in line.split()]
    except ValueError as error:
        raise ValueError(
            str(error)[:80]
        ) from error  # the message contains the word, which may be very long


def _size(count: list[float], dtype: np.dtype[Any]) -> int:
    if not count:
        raise ValueError("has too few words")
    if not (0 <= count[0] <= np.iinfo(dtype).max and count[0].is_integer()):
        raise ValueError(f"the list length {count[0]} is not a value of {dtype}")
    return int(count[0])


def _column(kind: Property, sizes: list[int], numbers: list[float], first_line: int) -> Any:
    values = np.array(numbers, np.float64)
    with np.errstate(over="ignore", invalid="ignore"):
        typed = values.astype(kind.dtype)
    wrong = np.isinf(typed) & ~np.isinf(values) if kind.dtype.kind == "f" else typed != values
    if wrong.any():
        record = np.repeat(np.arange(len(sizes)), sizes)[wrong][0]
        raise ValueError(
            f"line {first_line + record}: {values[wrong][0]} is not a value of {kind.dtype}"
        )
    return as_column(kind, np.array(sizes, np.int64), typed)
