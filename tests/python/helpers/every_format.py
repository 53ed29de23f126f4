"""All formats that can be written, and a sequence with what most of them keep."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from sequences import sea

import dynmesh
from dynmesh import formats
from dynmesh.polygons import Polygons, split_polygons

KEPT = {name: format.keeps for name, format in formats.FORMATS.items() if format.write}
FORMATS = [*KEPT]
SINGLE_PRECISION = {name for name, keeps in KEPT.items() if "float64" not in keeps}
MASKED = {name for name, keeps in KEPT.items() if "known" in keeps}
TRACED = {name for name, keeps in KEPT.items() if "provenance" in keeps}
NUMBERED = {name for name in FORMATS if formats.FORMATS[name].is_per_frame}
TIMED = {"npz", "hdf5", "usd", "alembic"}


def place(folder: Path, format: str, name: str = "body") -> Path:
    """Returns a path for a sequence of this format."""
    suffix = formats.FORMATS[format].suffixes[0]
    return folder / (f"{name}_%04d{suffix}" if format in NUMBERED else f"{name}{suffix}")


def quads(n: int) -> Polygons:
    """A grid of n by n vertices, its first square cut in two."""
    v = np.arange(n * n).reshape(n, n)
    squares = np.stack([v[:-1, :-1], v[1:, :-1], v[1:, 1:], v[:-1, 1:]], axis=-1).reshape(-1, 4)
    a, b, c, d = squares[0]
    corners = np.concatenate([[a, b, c, a, c, d], squares[1:].ravel()]).astype(np.int32)
    sizes = np.concatenate([[3, 3], np.full(len(squares) - 1, 4)]).astype(np.int32)
    return Polygons(sizes, corners)


def _partial() -> dynmesh.Sequence:
    polygons = quads(12)
    about: Any = {"fps": 24.0, "up_axis": "y", "name": "/world/body", "metres_per_unit": 0.01}
    faces, _ = split_polygons(polygons)
    whole = sea(7, 12, share=0.5, whole=[0], faces=faces, polygons=polygons, **about)
    known = np.array(whole.known)
    known[5] = False
    return replace(whole, known=known, vertices=np.where(known[..., None], whole.vertices, np.nan))


PARTIAL = _partial()
KNOWN: Any = PARTIAL.known
"""Moving quads with missing vertices, which are NaN, and a frame without any other."""
