"""The command that describes a sequence and reports problems."""

import json
from collections.abc import Iterable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from .. import files
from .._core import TopologyReport, TrainingSummary
from ..calibration import Distances, estimated, in_words
from ..diagnosis import Diagnosis, diagnose
from ..diagnosis.finding import MOST_PLACES
from ..files import Frame, Header, Source
from ..jobs.completion_options import check_training
from ..jobs.training import Training
from ..settings import default_settings
from .options import InputPath, with_source
from .terminal import PATIENCE, say, show, track, watch_training

_REFUSED_SHOWN = 3
_BRIEF = 5  # indices of each finding
_OF_TRAINING = ("frames", "variance_held", "rms_distance", "largest_distance")
_ERRORS_OF = {"position": "of coordinates", "surface": "of distances from the surface"}
_STYLES = {"error": "bold red", "warning": "yellow", "note": "cyan"}


@with_source
def info(
    path: InputPath,
    *,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")] = False,
    brief: Annotated[
        bool,
        typer.Option(
            "--brief", help="With --json: at most five vertices, faces and frames per problem."
        ),
    ] = False,
    strict: Annotated[
        bool, typer.Option("--strict", help="Exit with code 1 if there is an error or a warning.")
    ] = False,
    training: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="FILE",
            help="Also describe what method detail would learn from this file, as dynmesh complete "
            "--training uses it. May be repeated.",
        ),
    ] = None,
    source: Source,
) -> None:
    """Describe a sequence, and report problems of mesh and motion.

    An error prevents completion. A warning means that the result will be less accurate or that the
    data is probably faulty. A note is informational. docs/diagnosis.md explains all of them. Of a
    file with several meshes (USD, Alembic), it lists these and describes the one that moves; if
    there are several such, choose one with --prim.
    """
    if brief and not as_json:
        raise typer.BadParameter("requires --json", param_hint="'--brief'")
    format_name = files.format_of(path, source.get("format")).name
    meshes = dict(files.meshes_of(path, source.get("format")))
    several = len(meshes) > 1 and source.get("prim") is None
    if several and sum(meshes.values()) != 1 and not (strict or training):
        if as_json:
            print(json.dumps({"meshes": meshes}, indent=2))
        else:
            _list(meshes)
            say("describe one of them with --prim")
        return
    with files.open(path, **source) as reader:
        training_files = check_training(training or None, default_settings)
        learnt = Training(training_files, reader, watch_training)
        distances = Distances(reader.header.standard_error_of)
        diagnosis = diagnose(reader, watch=partial(_watch, distances))
        summary = learnt.summary() if learnt else None
    if as_json:
        told = diagnosis.as_dict(most_places=_BRIEF if brief else MOST_PLACES)
        if several:
            told["meshes"] = meshes
        if summary is not None:
            told["training"] = {name: getattr(summary, name) for name in _OF_TRAINING}
        if reader.header.has_standard_error:
            told["within_90"] = distances.within(0.9)
            told["standard_error_of"] = reader.header.standard_error_of
        print(json.dumps(told, indent=2, allow_nan=False))
    else:
        if several:
            _list(meshes)
        _print(diagnosis, format_name, summary)
        if (words := in_words(distances, reader.header.metres_per_unit)) is not None:
            say(f"{path}: {words}")
    if strict and diagnosis.severity in ("error", "warning"):
        raise typer.Exit(1)


def _watch(distances: Distances, frames: Iterable[Frame], total: int) -> Iterable[Frame]:
    for frame in track(frames, total, "reading", patience=PATIENCE):
        if frame.standard_error is not None and frame.generation is not None:
            counted = estimated(frame.generation, distances.standard_error_of)
            distances.add(frame.standard_error, counted)
        yield frame


def _list(meshes: Mapping[str, bool]) -> None:
    """Prints the paths of the meshes of a file."""
    table = Table.grid(padding=(0, 2))
    for mesh, moves in meshes.items():
        table.add_row(escape(mesh), "moves" if moves else "does not move")
    show(table)
    print()


def _print(diagnosis: Diagnosis, format_name: str, summary: TrainingSummary | None) -> None:
    table = Table.grid(padding=(0, 2))
    table.add_row("format", format_name)
    for row in _header_rows(diagnosis):
        table.add_row(*row)
    first = diagnosis.header.number(0)
    table.add_row(
        f"known after frame {first}", _describe_shares(diagnosis.known_share[1:].tolist())
    )
    table.add_row("bounding-box diagonal", f"{diagnosis.diagonal:g}, of frame {first}")
    if diagnosis.mean_edge is not None:
        table.add_row("mean edge", f"{diagnosis.mean_edge:g}, of frame {first}")
    if diagnosis.topology is not None:
        for row in _topology_rows(diagnosis.topology):
            table.add_row(*row)
    if summary is not None:
        for row in _training_rows(summary, diagnosis.diagonal):
            table.add_row(*row)
    show(table)
    print()
    Console(emoji=False).print(diagnosis.summary, highlight=False)
    if not diagnosis.findings:
        return
    findings = Table.grid(padding=(0, 2))
    for finding in diagnosis.findings:
        style = _STYLES[finding.severity]
        findings.add_row(f"[{style}]{finding.severity}[/]", escape(finding.message))
        findings.add_row("", f"[dim]{escape(finding.advice)}[/]")
    show(findings, highlight=False)


def _header_rows(diagnosis: Diagnosis) -> Iterator[tuple[str, str]]:
    header: Header = diagnosis.header
    yield "frames", str(header.n_frames)
    yield "frames per second", "unknown" if header.fps is None else f"{header.fps:g}"
    if header.times is None:
        yield "first frame", f"{header.start:.15g}"
    else:
        span = f"{header.times[0]:.15g} to {header.times[-1]:.15g}"
        yield "times of frames", f"{span}, not evenly spaced"
    yield "vertices", f"{header.n_vertices}, {header.dtype}"
    if header.polygons is None:
        yield "faces", str(len(header.faces))
    else:
        n_polygons = len(header.polygons.sizes)
        yield "faces", f"{n_polygons} polygons, cut into {len(header.faces)} triangles"
    yield "up axis", header.up_axis or f"unknown; probably {diagnosis.likely_up}"
    likely = diagnosis.likely_unit
    guess = f"; probably {likely.name} if this is a person or an animal" if likely else ""
    said = header.metres_per_unit
    yield "unit of length", f"unknown{guess}" if said is None else f"{said:g} m"
    yield "name", escape(header.name or "unknown")
    yield "known masks", "yes" if header.has_known else "no"
    bars = header.has_standard_error
    yield "generation and age", "yes" if header.has_provenance else "no"
    yield "standard errors", _ERRORS_OF[header.standard_error_of] if bars else "no"


def _topology_rows(topology: TopologyReport) -> Iterator[tuple[str, str]]:
    yield "components", str(topology.components)
    yield "isolated vertices", str(topology.isolated_vertices)
    closed = "" if topology.boundary_edges else ", closed"
    yield "boundary edges", f"{topology.boundary_edges}{closed}"
    yield "refused faces", str(len(topology.refused_faces))
    for face in topology.refused_faces[:_REFUSED_SHOWN]:
        yield "", f"face {face.index}: {face.reason}"
    if len(topology.refused_faces) > _REFUSED_SHOWN:
        yield "", f"and {len(topology.refused_faces) - _REFUSED_SHOWN} more"


def _training_rows(summary: TrainingSummary, diagonal: float) -> Iterator[tuple[str, str]]:
    def shown(distance: float) -> str:
        return f"{distance:.3g} ({100 * distance / diagonal:.3g} % of the diagonal)"

    yield "training", f"{summary.frames} frames"
    yield "its modes hold", f"{100 * summary.variance_held:.3g} % of the variance of its shapes"
    yield "its poses are", f"{shown(summary.rms_distance)} from the first whole frame,"
    yield "", f"{shown(summary.largest_distance)} at most"


def _describe_shares(shares: list[float]) -> str:
    if not shares:
        return "no further frames"
    return f"{100 * np.mean(shares):.1f} % ({100 * min(shares):.1f} to {100 * max(shares):.1f} %)"
