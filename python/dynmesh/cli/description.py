"""The command that describes a sequence."""

from collections.abc import Iterable, Iterator

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from .. import evaluation, files
from .._core import Completer, TopologyReport
from .._terminal import track
from ..files import Frame, Header
from .options import Faces, Format, InputPath, MaskFile, MissingValue, Prim, source_of
from .zeros import Zeros


def info(
    path: InputPath,
    format: Format = None,
    faces: Faces = None,
    prim: Prim = None,
    mask: MaskFile = None,
    missing: MissingValue = None,
) -> None:
    """Say what a sequence holds, and what is odd about its mesh."""
    zeros = Zeros()
    table = Table.grid(padding=(0, 2))
    with files.open(path, **source_of(format, faces, prim, mask, missing)) as reader:
        table.add_row("format", files.format_of(path, format).name)
        for row in _header_rows(reader.header):
            table.add_row(*row)
        frames = track(zeros.watch(reader), reader.n_frames, "reading")
        table.add_row("known after frame 0", _describe_shares(list(_known_shares(frames))[1:]))
        first = next(iter(reader)).points
        diagonal = evaluation.bounding_box_diagonal(first)
        table.add_row("bounding-box diagonal", f"{diagonal:g}, of frame 0")
        with files.naming(path):
            topology = Completer(reader.faces, first).topology
        for row in _topology_rows(topology):
            table.add_row(*row)
    Console().print(table)
    zeros.say_if_many()


def _header_rows(header: Header) -> Iterator[tuple[str, str]]:
    yield "frames", str(header.n_frames)
    yield "frames per second", "not said" if header.fps is None else f"{header.fps:g}"
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
    yield "up axis", header.up_axis or "not said"
    unit = header.metres_per_unit
    yield "unit of length", "not said" if unit is None else f"{unit:g} m"
    yield "name", escape(header.name or "not said")
    yield "known masks", "yes" if header.has_known else "no"
    yield "generation and age", "yes" if header.has_provenance else "no"


def _topology_rows(topology: TopologyReport) -> Iterator[tuple[str, str]]:
    yield "components", str(topology.components)
    yield "isolated vertices", str(topology.isolated_vertices)
    yield "boundary edges", str(topology.boundary_edges)
    yield "refused faces", str(len(topology.refused_faces))
    for index, reason in topology.refused_faces[:10]:
        yield "", f"face {index}: {reason}"
    if len(topology.refused_faces) > 10:
        yield "", f"and {len(topology.refused_faces) - 10} more"


def _known_shares(frames: Iterable[Frame]) -> Iterator[float]:
    for points, known in frames:
        observed = np.isfinite(points).all(axis=1)
        if known is not None:
            observed &= known
        yield float(observed.mean())


def _describe_shares(shares: list[float]) -> str:
    if not shares:
        return "there is no other frame"
    return f"{100 * np.mean(shares):.1f} % ({100 * min(shares):.1f} to {100 * max(shares):.1f} %)"
