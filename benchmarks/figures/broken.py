"""Writes the sequence of docs/diagnosis.md, in which much is wrong.

python -m benchmarks.figures.broken OUT
"""

import sys
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

import dynmesh

Floats = NDArray[np.floating[Any]]


def broken() -> dynmesh.Sequence:
    """A walking figure with a mesh and a motion as scanners and exporters leave them."""
    walker = dynmesh.synth.walker(80)
    faces, vertices = walker.faces.copy(), walker.vertices.copy()
    first = vertices[0]
    rng = np.random.default_rng(0)
    known = rng.random(vertices.shape[:2]) < 0.4
    known[0] = True

    corner = faces[9000]
    faces = np.concatenate([faces, [[corner[0], corner[1], np.argmax(first[:, 2])]]])  # a fin

    foot = near(first, first, first[first[:, 2].argmin()], 0.12)
    known[1:, foot] = False  # never seen
    known[30:36] = False  # a dropout
    scan = rng.random(len(first)) < 0.02
    vertices[18:22, scan], known[18:22, scan] = 0, True  # holes written as zeros
    stray = rng.integers(0, len(first), 60)
    vertices[70, stray] += rng.normal(0, 0.3, (60, 3)).astype(np.float32)
    known[70, stray] = True
    return replace(walker, faces=faces, vertices=vertices, known=known)


def near(first: Floats, places: Floats, centre: Any, radius: float) -> NDArray[np.bool_]:
    """Which places are within a radius of the vertex that is nearest to a point."""
    middle = first[np.linalg.norm(first - np.asarray(centre), axis=1).argmin()]
    return np.asarray(np.linalg.norm(places - middle, axis=1) < radius)


if __name__ == "__main__":
    dynmesh.write(sys.argv[1], broken())
