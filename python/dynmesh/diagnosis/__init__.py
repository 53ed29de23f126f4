"""Problems of a sequence: of its mesh, of what was observed, and of its motion."""

from contextlib import closing
from itertools import chain
from typing import Unpack

import numpy as np

from .. import formats
from .._errors import InputError
from .._progress import tracked
from ..formats import OneSequence, Source
from ..geometry import likely_up
from .finding import CODES, SEVERITIES, Diagnosis, Finding, Severity, Where
from .mesh import Mesh, examine
from .motion import Motion
from .presence import Presence, plausible

__all__ = ["Diagnosis", "Finding", "Severity", "Where", "diagnose"]


def diagnose(
    source: OneSequence, *, progress: bool | None = None, **how: Unpack[Source]
) -> Diagnosis:
    """Looks for problems of a sequence, in one pass and in constant memory.

    Args:
        source: a file in any format, a reader from :func:`dynmesh.open`, or a sequence in memory.
        progress: whether to show on standard error how far it is.
        **how: how to read a file, the keywords of :func:`dynmesh.open`; they are ignored if
            `source` is a reader or in memory.

    Raises:
        OSError, ImportError, TypeError, ValueError: the sequence cannot be read; see
            :func:`dynmesh.open`. Problems of the mesh and of the positions are findings, not
            errors.
    """
    with (
        formats.opened(source, **how) as reader,
        formats.naming(reader.path),
        closing(reader.frames()) as frames,
    ):
        header = reader.header
        if header.n_vertices == 0:
            raise InputError("has no vertices")
        watched = tracked(frames, header.n_frames, "reading", progress)
        first = next(watched)
        start = Mesh(header.faces, first.points, plausible(first))
        presence = Presence(header, start, first)
        motion = Motion(header, start)
        for number, frame in enumerate(watched, 1):
            motion.watch(number, frame.points, presence.watch(number, frame))
    result = chain(presence.findings(), motion.findings(), examine(start))
    ordered = sorted(result, key=lambda f: (SEVERITIES.index(f.severity), CODES.index(f.code)))
    return Diagnosis(
        findings=tuple(ordered),
        header=header,
        topology=start.topology,
        diagonal=start.diagonal,
        mean_edge=start.mean_edge if np.nansum(start.lengths) > 0 else None,
        known_share=np.array(presence.shares),
        motion=np.array(motion.medians),
        likely_up=likely_up(start.first[start.present], header.up_axis),
    )
