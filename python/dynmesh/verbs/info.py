"""What a sequence is, and what is wrong with it."""

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from textwrap import wrap
from typing import Any

from .. import formats
from .._options import Input, Output
from .._report import Quality, Report, aligned
from ..advice.diagnosis import Diagnosis, diagnose
from ..formats import OneSequence, Source
from ..formats.times import spacing
from ..polygons import Faces

_WIDTH = 80  # of findings, which are long
_ERRORS_OF = {"position": "of coordinates", "surface": "of distances from the surface"}


def _unit(metres: float | None) -> str:
    return "unknown" if metres is None else f"{metres:g} m"


@dataclass(frozen=True, kw_only=True, eq=False)
class InfoReport(Report):
    """What :func:`info` has found.

    Attributes:
        format: the name of the format; "memory" of frames that are no file.
        meshes: the paths of those of a file with several, and whether each moves.
        diagnosis: of the mesh; None if none was chosen.
    """

    format: str
    meshes: Mapping[str, bool]
    diagnosis: Diagnosis | None = None

    def lines(self) -> list[str]:
        """Describes the sequence, and lists the findings with advice."""
        messages = list[str]()
        if self.meshes:
            told = {True: "moves", False: "does not move"}
            messages = aligned([[name, told[moves]] for name, moves in self.meshes.items()])
        if self.diagnosis is None:
            return [*messages, *super().lines()]
        rows = {"format": self.format, **dict(_facts(self.diagnosis))}
        messages += [""] * bool(messages)
        messages += aligned([*rows.items()])
        messages += ["", self.diagnosis.summary]
        for one in self.diagnosis.findings:
            messages += wrap(f"{one.severity}: {one.message}", _WIDTH, subsequent_indent="  ")
            messages += wrap(one.advice, _WIDTH, initial_indent="  ", subsequent_indent="  ")
        return [*messages, *super().lines()]

    def to_dict(self) -> dict[str, Any]:
        """Returns the diagnosis and the meshes as values that JSON has."""
        meshes = {"meshes": dict(self.meshes)} if self.meshes else {}
        if self.diagnosis is None:
            return meshes
        values = self.diagnosis.as_dict() | meshes
        if self.diagnosis.header.has_standard_error:
            values["standard_error_of"] = self.diagnosis.header.standard_error_of
        return values


def info(
    sequence: OneSequence,
    *,
    faces: Input[Faces | None] = None,
    source: Source | None = None,
    strict: Output[bool] = False,
    progress: bool | None = None,
) -> InfoReport:
    """Describes a sequence, and reports problems of its mesh and motion.

    An error prevents completion. A warning means that the result will be less accurate or that the
    data is probably faulty. docs/diagnosis.md explains all of them. Of a file with several meshes
    (USD, Alembic), it lists these and describes the one that moves; if there are several such,
    `prim` in `source` chooses one, or several together.

    Args:
        sequence: a file, a folder, a pattern such as 'scans/*.ply', or frames.
        faces: of positions alone.
        source: how to read the file.
        strict: whether an error or a warning makes the command fail.
        progress: whether to show on standard error how far it is.
    """
    source = source or {}
    name, moves = "memory", dict[str, bool]()
    if isinstance(sequence, str | os.PathLike):
        name = formats.format_of(sequence, source.get("format")).name
        moves = dict(formats.meshes_of(sequence, source.get("format")))
    several = moves if len(moves) > 1 else {}
    if several and source.get("prim") is None and sum(moves.values()) != 1 and not strict:
        message = "`prim` describes one of them, by its path"
        return InfoReport(format=name, meshes=several, remarks=(message,))
    with formats.opened(sequence, shared={"faces": faces}, **source) as reader:
        diagnosis = diagnose(reader, progress=progress)
        remarks = reader.remarks
    quality: Quality = "failed" if strict and diagnosis.findings else "good"
    return InfoReport(
        quality=quality,
        format=name,
        meshes=several,
        diagnosis=diagnosis,
        remarks=remarks,
    )


def _facts(diagnosis: Diagnosis) -> Iterator[tuple[str, str]]:
    header = diagnosis.header
    first = header.number(0)
    yield "frames", str(header.n_frames)
    yield "frames per second", "unknown" if header.fps is None else f"{header.fps:g}"
    if header.times is None:
        yield "first frame", f"{header.start:.15g}"
    else:
        span = f"{header.times[0]:.15g} to {header.times[-1]:.15g}"
        step = spacing(header.times.tolist())
        yield "times of frames", f"{span}, {f'{step:g} apart' if step else 'not evenly spaced'}"
    yield "vertices", f"{header.n_vertices}, {header.dtype}"
    cut = f", of {len(header.polygons.sizes)} polygons" if header.polygons else ""
    yield "triangles", f"{len(header.faces)}{cut}"
    yield "up axis", header.up_axis or f"unknown; probably {diagnosis.likely_up}"
    yield "unit of length", _unit(header.metres_per_unit)
    yield "name", header.name or "unknown"
    yield "known masks", "yes" if header.has_known else "no"
    bars = header.has_standard_error
    yield "generation and age", "yes" if header.has_provenance else "no"
    yield "standard errors", _ERRORS_OF[header.standard_error_of] if bars else "no"
    message = "no further frames"
    if len(shares := diagnosis.known_share[1:]):
        mean, low, high = (100 * share for share in (shares.mean(), shares.min(), shares.max()))
        message = f"{mean:.1f} % ({low:.1f} to {high:.1f} %)"
    yield f"known after frame {first}", message
    yield "bounding-box diagonal", f"{diagnosis.diagonal:g}, of frame {first}"
    if diagnosis.mean_edge is not None:
        yield "mean edge", f"{diagnosis.mean_edge:g}, of frame {first}"
    if (topology := diagnosis.topology) is not None:
        yield "components", str(topology.components)
        yield "isolated vertices", str(topology.isolated_vertices)
        closed = "" if topology.boundary_edges else ", closed"
        yield "boundary edges", f"{topology.boundary_edges}{closed}"
        yield "refused faces", str(len(topology.refused_faces))
