"""The attributes of a vertex in a frame, besides its position: one table for all formats."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._errors import InputError, KindError

FUSED = -2
"""The generation of a vertex that was put together from other frames: see
:func:`dynmesh.whole_frame`."""

_ACCEPTED = {
    "b": ("biu", "bool, or integers 0 and 1, not {}"),
    "i": ("iu", "integers, not {}"),
    "f": ("f", "floats, not {}"),
}
"""By the kind of the dtype in files: the kinds that are accepted, and what must be."""


@dataclass(frozen=True, eq=False)
class Attribute:
    """One value of every vertex in every frame.

    Attributes:
        name: in Python and in all files.
        dtype: of the values in files.
        absent: the value in a frame in which nothing was observed.
        flag: the attribute of a :class:`Header` that says whether frames have it.
        what: the name, in messages, of all attributes with this flag.
        needs: the names of others without which it has no meaning.
    """

    name: str
    dtype: np.dtype[Any]
    absent: float
    flag: str
    what: str
    needs: tuple[str, ...] = ()

    def check(
        self, dtype: np.dtype[Any], shape: tuple[int, ...], expected: tuple[int, ...]
    ) -> None:
        """Raises an error unless this describes values for vertices of the ``expected`` shape."""
        kinds, must_be = _ACCEPTED[self.dtype.kind]
        if dtype.kind not in kinds:
            raise KindError(f"must be {must_be.format(dtype)}", argument=self.name)
        if shape != expected:
            raise InputError(
                f"must have shape {expected} to match vertices, not {shape}", argument=self.name
            )


_INTEGERS = np.dtype(np.int32)

ATTRIBUTES = {
    row.name: row
    for row in (
        Attribute("known", np.dtype(np.bool_), False, "has_known", "known masks"),
        Attribute("generation", _INTEGERS, -1, "has_provenance", "generation and age", ("age",)),
        Attribute("age", _INTEGERS, 0, "has_provenance", "generation and age", ("generation",)),
        Attribute(
            "standard_error",
            np.dtype(np.float32),
            np.inf,
            "has_standard_error",
            "standard errors",
            ("generation", "age"),
        ),
    )
}
"""By name. A row here, its flag and its field below are all that formats need of an attribute."""


@dataclass(frozen=True, eq=False, kw_only=True)
class VertexAttributes:
    """What is known of the origin of positions, for all vertices of a frame or of all frames.

    Attributes:
        generation: integers, 0 for anchors, g for satellites, -1 for disconnected vertices, -2 for
            those that were put together from other frames, where completion starts.
        age: integers, frames since the vertex was last observed; None if `generation` is.
        standard_error: floats, in the unit of the positions: how far each vertex may be off, see
            :data:`dynmesh.sequence.StandardErrorOf`; None if they were not estimated.
    """

    generation: NDArray[np.integer[Any]] | None = None
    age: NDArray[np.integer[Any]] | None = None
    standard_error: NDArray[np.floating[Any]] | None = None

    def attributes(self) -> dict[str, NDArray[Any]]:
        """Returns the attributes that are there by name, the known mask included."""
        result = {name: getattr(self, name) for name in ATTRIBUTES}
        return {name: values for name, values in result.items() if values is not None}


def as_mask(known: NDArray[Any]) -> NDArray[np.bool_]:
    """Returns (k,) or (n, k) integers that are 0 or 1 as bool, and bool as it is.

    Raises:
        ValueError: an integer is another one.
    """
    if known.dtype == np.bool_:
        return known
    mask = known.astype(np.bool_)
    if len(others := np.argwhere(known != mask)):
        *frame, vertex = others[0].tolist()
        raise InputError(
            f"must be 0 or 1 for each vertex, but vertex {vertex} has {known[*frame, vertex]}",
            argument="known",
            frame=frame[0] if frame else None,
        )
    return mask


def flags_of(names: Collection[str]) -> dict[str, Any]:
    """Returns the keywords of a header whose frames have the attributes with these names."""
    return {row.flag: name in names for name, row in ATTRIBUTES.items()}


def with_all_needed(names: Collection[str]) -> list[str]:
    """Returns the names of the attributes among these that have all the others that they need."""
    return [name for name, row in ATTRIBUTES.items() if name in names and {*row.needs} <= {*names}]


def check_needed(names: Collection[str]) -> None:
    """Raises an error if an attribute is there without another one that it needs."""
    for name, row in ATTRIBUTES.items():
        for other in row.needs:
            if name in ATTRIBUTES[other].needs and (name in names) != (other in names):
                raise InputError(f"{name}, {other}: must be given both or neither")
        if name in names and not {*row.needs} <= {*names}:
            raise InputError(f"{name}: requires {' and '.join(row.needs)}")
