"""What can be asked of a sequence that is written anew: its frames, axis, unit, size and rate."""

from dataclasses import dataclass, replace
from typing import TypedDict, get_args

from .._checks import check_positive
from .._errors import InputError
from ..files.conversion import Axis, Conversion, Unit, cut, stated
from ..files.header import Header
from ..files.times import check_slice, slice_of
from .option import UNIT_NAMES, given, unit_of

CONVERSION = "Frames, axes, units and rates"


@dataclass(frozen=True, kw_only=True)
class ConversionOptions:
    """What can be asked of a conversion; :func:`dynmesh.convert_file` explains the options."""

    frames: slice | range | None = given(
        None,
        "Only the frames from number A to before B, as slices of Python, which may have a step.",
        CONVERSION,
        metavar="A:B",
        parse=slice_of,
    )
    up: Axis | None = given(
        None,
        "The up axis of the input, where it does not state it.",
        CONVERSION,
        choices=get_args(Axis),
    )
    unit: Unit | None = given(
        None,
        f"The unit of length of the input, where it does not state it: {UNIT_NAMES}.",
        CONVERSION,
        metavar="UNIT",
        parse=unit_of,
    )
    to_up: Axis | None = given(
        None, "Turn the points so that this axis is up.", CONVERSION, choices=get_args(Axis)
    )
    to_unit: Unit | None = given(
        None, "Scale the points to this unit.", CONVERSION, metavar="UNIT", parse=unit_of
    )
    scale: float | None = given(
        None, "Multiply the points by this.", CONVERSION, float, metavar="FACTOR"
    )
    fps: float | None = given(
        None,
        "Frames per second. The frames stay as they are. [as the input states]",
        CONVERSION,
        float,
        metavar="RATE",
    )
    retime: float | None = given(
        None,
        "Resample to this rate by linear interpolation.",
        CONVERSION,
        float,
        metavar="RATE",
    )

    def check(self) -> None:
        """Refuses options that no sequence can have; the others are checked with the sequence."""
        if self.frames is not None:
            check_slice("frames", self.frames)
        for name in ("up", "to_up"):
            value = getattr(self, name)
            if value not in (None, *get_args(Axis)):
                raise InputError(f"must be 'x', 'y' or 'z', not {value!r}", argument=name)
        for name in ("fps", "scale", "retime"):
            if getattr(self, name) is not None:
                check_positive(name, getattr(self, name))

    def conversion(self, read: Header) -> tuple[Conversion, range]:
        """What becomes of a sequence with this header, and the indices of the frames it takes.

        Raises:
            TypeError, ValueError: see :func:`stated`, :func:`cut` and :class:`Conversion`.
        """
        indices = range(read.n_frames)
        if self.frames is not None:
            read, indices = cut(read, self.frames)
        read = replace(stated(read, self.up, self.unit), fps=self.fps or read.fps)
        options = {name: getattr(self, name) for name in ("to_up", "to_unit", "scale", "retime")}
        return Conversion.of(read, **options), indices


class ConversionKeywords(TypedDict, total=False):
    """The types of the options as keywords, for editors and type checkers."""

    frames: slice | range | None
    up: Axis | None
    unit: Unit | None
    to_up: Axis | None
    to_unit: Unit | None
    scale: float | None
    fps: float | None
    retime: float | None
