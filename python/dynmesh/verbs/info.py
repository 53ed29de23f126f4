"""What a sequence is, and what is wrong with it."""

import os
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass
from textwrap import wrap
from typing import Any

import numpy as np

from .. import formats
from .._checks import check_flags
from .._errors import InputError
from .._options import Input, Output
from .._report import Quality, Report, aligned, as_json, counted, few_frames, percent
from ..advice.diagnosis import Diagnosis, diagnose
from ..formats import OneSequence, PathLike, Source
from ..formats.times import spacing
from ..polygons import Faces
from ..whole_frames.window import best_frame

_STATED = (
    "name", "fps", "start", "times", "up_axis", "metres_per_unit", "has_known", "has_provenance"
)  # fmt: skip
_WIDTH = 80  # of findings, which are long
_ERRORS_OF = {"position": "of coordinates", "surface": "of distances from the surface"}


@dataclass(frozen=True, kw_only=True)
class MeshRow:
    """A mesh among several.

    Attributes:
        moves: whether its points change.
        frames: number of frames; 0 if they could not be read, like all that follows.
        first: number of the first frame.
        last: number of the last frame.
        vertices: number of vertices.
        known: the share of them that were observed, on average over the frames after the first, or
            in the only one. Those that a completion has filled in were not.
        metres_per_unit: the unit of length of its points, or None if that is unknown.
    """

    moves: bool
    frames: int = 0
    first: float = 0
    last: float = 0
    vertices: int = 0
    known: float = 0.0
    metres_per_unit: float | None = None

    def cells(self) -> list[str]:
        """Its frames, vertices, how many of them are known, and its unit."""
        if not self.frames:
            return ["moves" if self.moves else "does not move"]
        span = f"{self.first:g} to {self.last:g}" if self.moves else "does not move"
        return [span, str(self.vertices), percent(self.known), _unit(self.metres_per_unit)]


def _unit(metres: float | None) -> str:
    return "unknown" if metres is None else f"{metres:g} m"


@dataclass(frozen=True, kw_only=True, eq=False)
class InfoReport(Report):
    """What :func:`info` has found.

    Attributes:
        format: the name of the format; "memory" of frames that are no file.
        meshes: those of a file with several, by their paths.
        diagnosis: of the mesh; None if none was chosen.
    """

    format: str
    meshes: Mapping[str, MeshRow]
    diagnosis: Diagnosis | None = None

    def lines(self) -> list[str]:
        """Describes the sequence, and lists the findings."""
        messages = list[str]()
        if self.meshes:
            head = ["mesh", "frames", "vertices", "known after the first", "unit"]
            messages = aligned([head, *([name, *row.cells()] for name, row in self.meshes.items())])
        if self.diagnosis is None:
            return [*messages, *super().lines()]
        rows = {"format": self.format, **dict(_facts(self.diagnosis))}
        messages += [""] * bool(messages)
        messages += aligned([*rows.items()])
        messages += ["", *(["No problems were found."] * (not self.diagnosis.findings))]
        for one in self.diagnosis.findings:
            messages += wrap(f"{one.severity}: {one.message}", _WIDTH, subsequent_indent="  ")
        return [*messages, *super().lines()]

    def to_dict(self) -> dict[str, Any]:
        """Returns the diagnosis and the meshes as values that JSON has."""
        meshes = {"meshes": as_json(self.meshes)} if self.meshes else {}
        if (found := self.diagnosis) is None:
            return meshes
        header, topology = found.header, found.topology
        shares = zip(("mean", "least", "most"), found.known_later or (None,) * 3, strict=True)
        bars = header.standard_error_of if header.has_standard_error else None
        return {
            "findings": as_json(found.findings),
            "sequence": {
                "frames": header.n_frames,
                "vertices": header.n_vertices,
                "dtype": str(header.dtype),
                **{name: as_json(getattr(header, name)) for name in _STATED},
                "standard_error_of": bars,
            },
            "mesh": {
                **({} if topology is None else as_json(topology)),
                "triangles": len(header.faces),
                "diagonal": found.diagonal,
                "mean_edge": found.mean_edge,
            },
            "known_share": as_json(dict(shares)),
            "never_known": found.never_known,
            **meshes,
        }


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
    (USD, Alembic), it lists these, with their frames, holes and units, and describes the one that
    moves; if there are several such, `prim` chooses one.

    Args:
        sequence: a file, a folder, a pattern such as 'scans/*.ply', or frames.
        faces: of positions alone.
        source: how to read the file.
        strict: whether an error or a warning makes the command fail.
        progress: whether to show on standard error how far it is.
    """
    source = source or {}
    formats.check_source(source)
    if faces is not None:
        source = {**source, "faces": faces}
    check_flags(strict=strict)
    given = source.get("prim")
    chosen = [given] if isinstance(given, str) else [*(given or ["all"])]
    name, several, problem = "memory", dict[str, MeshRow](), tuple[str, ...]()
    if isinstance(sequence, str | os.PathLike):
        name = formats.format_of(sequence, source.get("format")).name
        moves = formats.meshes_of(sequence, source.get("format"))
        if len(moves) > 1 and (len(chosen) > 1 or chosen == ["all"]):
            several, problem = _meshes(sequence, moves, chosen, source)
            if given is not None or (sum(moves.values()) != 1 and not strict):
                message = "`prim` describes one of them, by its path"
                return InfoReport(format=name, meshes=several, remarks=(*problem, message))
    with formats.opened(sequence, **source) as reader:
        diagnosis = diagnose(reader, progress=progress)
        remarks = reader.remarks
    quality: Quality = "failed" if strict and diagnosis.findings else "good"
    return InfoReport(
        quality=quality,
        format=name,
        meshes=several,
        diagnosis=diagnosis,
        remarks=(*problem, *remarks),
    )


def _meshes(
    path: PathLike, moves: Mapping[str, bool], chosen: list[str], source: Source
) -> tuple[dict[str, MeshRow], tuple[str, ...]]:
    """Describes several meshes, or says why one of them cannot be read."""
    names = [*moves] if chosen == ["all"] else chosen
    rows = {name: MeshRow(moves=moves.get(name, False)) for name in names}
    how: Source = {**source}
    is_usd = "primvar" in formats.format_of(path, source.get("format")).takes
    if is_usd:
        how["gaps"] = "lost"
    try:
        for one_or_more in [chosen] if is_usd else names:
            how["prim"] = one_or_more
            with formats.open(path, **how) as frames:
                for name, one in (frames.each or {str(frames.header.name): frames}).items():
                    header = one.header
                    with closing(one.frames()) as every:
                        first, *later = (float(frame.observed.mean()) for frame in every)
                    rows[name] = MeshRow(
                        moves=moves[name],
                        frames=header.n_frames,
                        first=header.number(0),
                        last=header.number(header.n_frames - 1),
                        vertices=header.n_vertices,
                        known=float(np.mean(later or [first])),
                        metres_per_unit=header.metres_per_unit,
                    )
    except InputError as error:
        if error.argument == "prim":
            raise
        return rows, (str(error),)
    return rows, ()


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
    yield "up axis", header.up_axis or "unknown"
    yield "unit of length", _unit(header.metres_per_unit)
    yield "name", header.name or "unknown"
    yield "known masks", "yes" if header.has_known else "no"
    bars = header.has_standard_error
    yield "generation and age", "yes" if header.has_provenance else "no"
    yield "standard errors", _ERRORS_OF[header.standard_error_of] if bars else "no"
    message = "no further frames"
    if later := diagnosis.known_later:
        mean, low, high = (100 * share for share in later)
        message = f"{mean:.1f} % ({low:.1f} to {high:.1f} %)"
        if diagnosis.never_known:
            message += f"; {counted(diagnosis.never_known, 'vertex')} never"
    yield f"known after frame {first}", message
    if (shares := diagnosis.known_share).min() < 1:
        best = best_frame(shares.tolist())
        yield "known at most", f"{percent(shares[best])}, in frame {header.number(best)}"
    if len(none := np.flatnonzero(shares == 0)):
        yield "nothing known", f"in {few_frames(none, header)}"
    yield "bounding-box diagonal", f"{diagnosis.diagonal:g}, of frame {first}"
    if diagnosis.mean_edge is not None:
        yield "mean edge", f"{diagnosis.mean_edge:g}, of frame {first}"
    if (topology := diagnosis.topology) is not None:
        yield "components", str(topology.components)
        yield "isolated vertices", str(topology.isolated_vertices)
        closed = "" if topology.boundary_edges else ", closed"
        yield "boundary edges", f"{topology.boundary_edges}{closed}"
        kinds = Counter(face.kind for face in topology.refused_faces)
        every = [f"{n} {kind.replace('_', ' ')}" for kind, n in kinds.items()]
        yield "refused faces", ", ".join(every) or "0"
