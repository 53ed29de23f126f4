"""Conversion of sequences: other formats, frames, axes, units and rates."""

import contextlib
from collections.abc import Generator
from contextlib import closing
from dataclasses import replace
from typing import Any

from .. import formats
from .._errors import naming, numbering
from .._options import Input, Method
from .._report import Report, tracked
from ..formats import OneSequence
from ..formats.conversion import Changes, Unit
from ..frame import Frame
from ..header import Axis
from ..polygons import Faces
from ..run import Run
from ..sequence import result_of


def convert(
    sequence: OneSequence,
    faces: Faces | None = None,
    *,
    frames: Input[slice | range | None] = None,
    up: Input[Axis | None] = None,
    unit: Input[Unit | None] = None,
    to_up: Method[Axis | None] = None,
    to_unit: Method[Unit | None] = None,
    scale: Method[float | None] = None,
    fps: Method[float | None] = None,
    progress: bool | None = None,
) -> Run[Report] | Any:
    """Changes the format of a sequence, its frames, axes, units or rate.

    Points are turned and scaled by `to_up`, `to_unit` and `scale` alone. docs/formats.md says what
    each format keeps.

    Args:
        sequence: a file, frames, a sequence in memory, positions (n, k, 3) or meshes.
        faces: of positions alone.
        frames: from the number of the first frame to that after the last one, such as 1001:1050;
            the frames keep their numbers.
        up: the up axis of a file that states none.
        unit: the unit of length of a file that states none: m, cm, mm, km, inch, foot, yard, or a
            number of metres.
        to_up: turn the points so that this axis is up.
        to_unit: scale the points to this unit.
        scale: multiply the points by this.
        fps: frames per second; the frames stay as they are.
        progress: whether to show on standard error how far it is; None for what takes long, in a
            terminal.

    Returns:
        The converted frames: a :class:`dynmesh.Sequence` of frames in memory; of others, a
        :class:`dynmesh.frames.Run`, whose frames are made when they are gone through.
    """
    given: dict[str, Any] = {"frames": frames, "up": up, "unit": unit, "to_up": to_up}
    given |= {"to_unit": to_unit, "scale": scale, "fps": fps}
    changes = Changes(**given)
    with contextlib.ExitStack() as stack:
        source = stack.enter_context(formats.opened(sequence, shared={"faces": faces}))
        with naming(source.path):
            conversion, indices = changes.of(source.header)

        def make() -> Generator[Frame, None, Report]:
            chosen = source.frames(indices.start, indices.stop, indices.step)
            with numbering(source.path, source.header.number), closing(chosen):
                yield from conversion.frames(tracked(chosen, len(indices), "converting", progress))
            before: Report | None = source.report
            return Report() if before is None else replace(before, remarks=())

        origin = source.origin
        if origin is not None and conversion.changed:
            origin = origin.after(conversion.changed)
        close = stack.pop_all().close
        run: Run[Report] = Run(conversion.header, make, source, origin=origin, close=close)
    return result_of(run, source)
