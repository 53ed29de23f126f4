"""What is odd about a sequence: its mesh, what was observed of it, and how it moves."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from itertools import chain
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from .. import files
from ..files import Frame, Header, PathLike, Reader
from ..sequence import Sequence
from . import shape, surface
from .diagnosis import Diagnosis
from .finding import CODES, SEVERITIES, Finding, Severity, Where
from .mesh import Mesh
from .motion import Motion
from .placement import Placement
from .presence import Presence, observed_in

__all__ = ["Diagnosis", "Finding", "Severity", "Where", "diagnose"]

Watch = Callable[[Iterable[Frame], int], Iterable[Frame]]


def diagnose(
    source: PathLike | Reader | Sequence,
    *,
    watch: Watch | None = None,
    format: str | None = None,
    faces: NDArray[np.integer[Any]] | PathLike | None = None,
    prim: str | None = None,
    known: NDArray[np.bool_] | PathLike | None = None,
    missing: Literal["zero"] | None = None,
) -> Diagnosis:
    """Looks for what is odd about a sequence, in one pass and in constant memory.

    Args:
        source: a file in any format, what :func:`dynmesh.open` returned, or a sequence in memory.
        watch: gets the frames and how many there are, and passes them on while they are read.
        format: of a file. This and what follows are for :func:`dynmesh.open`, which explains them,
            and have no meaning where `source` is open or in memory.
        faces: of a file that holds positions alone.
        prim: the mesh, where a file holds several.
        known: the masks, in place of those in the file.
        missing: "zero": positions of exactly (0, 0, 0) were not observed.

    Raises:
        OSError, ImportError, TypeError, ValueError: it cannot be read, as :func:`dynmesh.open`
            says. Whatever is wrong with the mesh and the positions is a finding instead.
    """
    if isinstance(source, Sequence):
        n_frames = len(source.vertices)
        if n_frames == 0:
            raise ValueError("holds no frame, but frame 0 is needed")
        frames_in_memory = (files.frame_of(source, number) for number in range(n_frames))
        return _diagnose(files.header_of(source), frames_in_memory, watch)
    if isinstance(source, Reader):
        with files.naming(source.path), closing(source.frames()) as frames:
            return _diagnose(source.header, frames, watch)
    with files.open(
        source, format=format, faces=faces, prim=prim, known=known, missing=missing
    ) as reader:
        return diagnose(reader, watch=watch)


def _diagnose(header: Header, frames: Iterator[Frame], watch: Watch | None) -> Diagnosis:
    if header.n_vertices == 0:
        raise ValueError("holds no vertices, only frames without any")
    watched = iter(frames if watch is None else watch(frames, header.n_frames))
    first = next(watched)
    start = Mesh.of(header.faces, first.points, observed_in(first))
    presence, motion, placement = Presence(start, first), Motion(start), Placement(header, start)
    for number, frame in enumerate(watched, 1):
        observed = presence.watch(number, frame, observed_in(frame))
        motion.watch(number, frame.points, observed)
        placement.watch(number, frame.points, observed)
    found = chain(
        presence.findings(),
        motion.findings(),
        placement.findings(),
        surface.examine(start),
        shape.examine(start),
    )
    return Diagnosis(
        findings=tuple(sorted(found, key=_importance)),
        header=header,
        topology=start.topology,
        first_frame=np.where(start.observed[:, None], start.first, np.nan).astype(header.dtype),
        diagonal=start.diagonal,
        mean_edge=start.mean_edge if np.nansum(start.lengths) > 0 else None,
        known_share=np.array(presence.shares),
        motion=np.array(motion.medians),
        likely_up=placement.likely_up,
        likely_unit=placement.likely_unit,
    )


def _importance(finding: Finding) -> tuple[int, int]:
    return SEVERITIES.index(finding.severity), CODES.index(finding.code)
