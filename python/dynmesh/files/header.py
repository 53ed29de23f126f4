"""A frame of a sequence, and the header that describes all frames."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, cast, get_args

import numpy as np
from numpy.typing import NDArray

from .._checks import check_array, check_integer
from .._errors import InputError
from ..sequence import (
    PROVENANCE,
    Description,
    Mask,
    Positions,
    Provenance,
    Sequence,
    StandardError,
    StandardErrorOf,
    check_corners,
    check_faces,
    check_vertices,
)


@dataclass(frozen=True, eq=False, slots=True)
class Frame:
    """One frame of a sequence. It can be unpacked: ``points, known = frame``.

    Attributes:
        points: (k, 3)
        known: (k,), or None if the sequence has no masks.
        generation: (k,), or None if the sequence has no provenance.
        age: (k,), or None if `generation` is.
        standard_error: (k,), or None if it was not estimated.
    """

    points: Positions
    known: Mask | None = None
    generation: Provenance | None = None
    age: Provenance | None = None
    standard_error: StandardError | None = None

    def provenance(self) -> dict[str, NDArray[Any]]:
        """Returns the generation, the age and the standard error by name, if they are there."""
        found = {name: getattr(self, name) for name in PROVENANCE}
        return {name: values for name, values in found.items() if values is not None}

    def __iter__(self) -> Iterator[Any]:
        """Yields the points and the mask."""
        yield self.points
        yield self.known


@dataclass(frozen=True, eq=False)
class Header(Description):
    """The properties that all frames of a file share.

    Attributes:
        faces: (m, 3) integers, triangles.
        n_frames: n.
        n_vertices: k.
        dtype: of the positions, float32 or float64.
        has_known: whether each frame has a known mask.
        has_provenance: whether each frame has the generation and the age of its vertices.
        has_standard_error: whether each frame has their standard errors as well.

    The attributes of :class:`dynmesh.Description`, from `fps` to `standard_error_of`, are keywords
    as well.

    Raises:
        TypeError, ValueError: an attribute is of the wrong kind or shape.
    """

    faces: NDArray[np.integer[Any]]
    n_frames: int
    n_vertices: int
    dtype: np.dtype[Any]
    has_known: bool = field(default=False, kw_only=True)
    has_provenance: bool = field(default=False, kw_only=True)
    has_standard_error: bool = field(default=False, kw_only=True)

    @property
    def provenance(self) -> tuple[str, ...]:
        """The names of what each frame has of :meth:`Frame.provenance`."""
        has = {"standard_error": self.has_standard_error}
        return tuple(name for name in PROVENANCE if has.get(name, self.has_provenance))

    def __post_init__(self) -> None:
        """Raises an error unless the properties are consistent."""
        check_integer("n_frames", self.n_frames, 0)
        check_integer("n_vertices", self.n_vertices, 0)
        check_array("faces", self.faces)
        object.__setattr__(self, "dtype", np.dtype(self.dtype))  # float is a dtype to numpy
        check_vertices(self.dtype, (self.n_frames, self.n_vertices, 3))
        check_faces(self.faces.dtype, self.faces.shape)
        check_corners(self.faces, self.n_vertices)
        if self.has_standard_error and not self.has_provenance:
            raise ValueError("has_standard_error: requires has_provenance")
        self._check_description(self.n_frames)


def errors_of(text: str | None) -> StandardErrorOf:
    """What a file says that its standard errors are of; files that say nothing hold positions.

    Raises:
        ValueError: it is none of the possible values.
    """
    for known in get_args(StandardErrorOf):
        if text == known:
            return cast(StandardErrorOf, known)
    if text in (None, "place"):  # as earlier versions called a position
        return "position"
    raise InputError(f"must be 'position' or 'surface', not {text!r}", argument="standard_error_of")


def header_of(sequence: Sequence) -> Header:
    """What a file would say of the sequence."""
    n_frames, n_vertices, _ = sequence.vertices.shape
    return Header(
        sequence.faces,
        n_frames,
        n_vertices,
        sequence.vertices.dtype,
        has_known=sequence.known is not None,
        has_provenance=sequence.generation is not None,
        has_standard_error=sequence.standard_error is not None,
        **sequence.described(),
    )


def frame_of(sequence: Sequence, number: int) -> Frame:
    """One frame of the sequence."""
    rows = (sequence.known, *(getattr(sequence, name) for name in PROVENANCE))
    return Frame(sequence.vertices[number], *(row if row is None else row[number] for row in rows))
