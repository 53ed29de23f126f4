"""The header of a PLY file, and the elements that it declares."""

import re
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

scalar_types = {
    name: np.dtype(code)
    for code, names in {
        "i1": ("char", "int8"),
        "u1": ("uchar", "uint8"),
        "i2": ("short", "int16"),
        "u2": ("ushort", "uint16"),
        "i4": ("int", "int32"),
        "u4": ("uint", "uint32"),
        "f4": ("float", "float32"),
        "f8": ("double", "float64"),
    }.items()
    for name in names
}
"""The names of the types, an older and a newer one each."""


@dataclass(frozen=True)
class Property:
    """A number, or a list of numbers, in each record of an element.

    Attributes:
        dtype: of the numbers, in the byte order of the file.
        count_dtype: of the length, which precedes the numbers of a list; None if it is not a list.
    """

    dtype: np.dtype[Any]
    count_dtype: np.dtype[Any] | None = None


@dataclass(frozen=True)
class Element:
    """Records of the same kind, such as all vertices of a mesh.

    Attributes:
        name: such as "vertex".
        count: number of records.
        properties: by name, in the order of the file.
    """

    name: str
    count: int
    properties: dict[str, Property] = field(default_factory=dict)

    def check_size(self, least: int, left: int, unit: str) -> None:
        """Refuses an element with more bytes than the file has, before memory is allocated."""
        if self.count and not self.properties:
            raise ValueError(f"its element {self.name!r} has no properties")
        if least > left:
            raise ValueError(
                f"is cut or damaged: its {self.count} records of {self.name!r} need {least} {unit} "
                f"or more, but {left} follow"
            )


class Lists(NamedTuple):
    """The numbers of a list property in n records."""

    sizes: NDArray[np.int64]
    """(n,) the length of each list."""
    values: NDArray[Any]
    """(sum of sizes,) the numbers, one list after another."""


Columns = dict[str, NDArray[Any] | Lists]
"""The n records of an element, by the name of the property: (n,) numbers, or lists."""


def as_column(kind: Property, sizes: NDArray[np.int64], values: NDArray[Any]) -> Any:
    """Returns a property in all records: the numbers, or the lists of these sizes."""
    return values if kind.count_dtype is None else Lists(sizes, values)


@dataclass(frozen=True)
class Header:
    """The content of a header.

    Attributes:
        is_text: whether each record is a line of words.
        elements: in the order of the file.
        n_bytes: length of the header.
        n_lines: number of lines of the header.
        comments: without the word "comment".
    """

    is_text: bool
    elements: list[Element]
    n_bytes: int
    n_lines: int
    comments: list[str]


def read_header(data: bytes) -> Header:
    """Reads the header at the beginning of a PLY file, in any encoding and with any line ends.

    Raises:
        ValueError: there is no header, or one of its lines is invalid.
    """
    first = re.match(rb"ply(\r\n|\n|\r)", data)
    if first is None:
        raise ValueError("is not a PLY file: line 1 is not 'ply'")
    end = first[1] + b"end_header" + first[1]
    head, end, _ = data.partition(end)
    if not end:
        raise ValueError("its header is cut or damaged: it has no line 'end_header'")
    order = ""
    elements: dict[str, Element] = {}
    comments = []
    lines = head.split(first[1])
    for number, line in enumerate(lines[1:], start=2):
        try:
            match [word.decode("latin-1") for word in line.split()]:
                case ["comment" | "obj_info", *words]:
                    comments.append(" ".join(words))
                case ["format", format, "1.0"] if not order:
                    order = _byte_order(format)
                case ["element", name, count] if order:
                    _refuse_second("element", name, elements)
                    elements[name] = Element(name, _count(count))
                case ["property", *kind, name] if elements:
                    properties = elements[[*elements][-1]].properties
                    _refuse_second("property", name, properties)
                    properties[name] = _property(kind, order)
                case _:
                    raise ValueError(f"{line[:60]!r} is not valid here")
        except ValueError as error:
            raise ValueError(f"line {number}: {error}") from error
    if not order:
        raise ValueError("its header names no format")
    size = len(head) + len(end)
    return Header(order == "=", list(elements.values()), size, len(lines) + 1, comments)


def _byte_order(format: str) -> str:
    orders = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
    if format not in orders:
        raise ValueError(f"the format must be one of {', '.join(orders)}, not {format!r}")
    return orders[format]


def _count(word: str) -> int:
    if not re.fullmatch("[0-9]{1,15}", word):
        raise ValueError(f"the number of records must be an integer, not {word!r}")
    return int(word)


def _property(kind: list[str], order: str) -> Property:
    match kind:
        case [value]:
            return Property(_dtype(value, order))
        case ["list", count, value]:
            count_dtype = _dtype(count, order)
            if count_dtype.kind == "f":
                raise ValueError(f"the length of a list must be an integer type, not {count}")
            return Property(_dtype(value, order), count_dtype)
    raise ValueError("a property needs a type, or 'list' and two types, and a name")


def _dtype(name: str, order: Any) -> np.dtype[Any]:
    if name not in scalar_types:
        raise ValueError(f"unknown type {name!r}")
    return scalar_types[name].newbyteorder(order)


def _refuse_second(what: str, name: str, others: dict[str, Any]) -> None:
    if name in others:
        raise ValueError(f"there is a second {what} {name!r}")
