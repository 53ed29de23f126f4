"""USD layers with triangles, as text."""

from pathlib import Path
from typing import Any

import numpy as np

FACES = "int[] faceVertexCounts = [3]\nint[] faceVertexIndices = [0, 1, 2]"
REST = "[(0, 0, 0), (1, 0, 0), (0, 1, 0)]"

POLYGONS = "int[] faceVertexCounts = [4, 3]\nint[] faceVertexIndices = [0, 1, 2, 3, 0, 3, 4]"
PLACES = np.random.default_rng(0).random((7, 2)).astype(np.float32)
"""The texture coordinates of the corners of a quadrilateral and a triangle."""


def points_at(**samples: float) -> str:
    """Formats samples of three points, `t1_5=2` for height 2 at time 1.5."""
    lines = [
        f"{name[1:].replace('_', '.')}: [(0, 0, {z}), (1, 0, {z}), (0, 1, {z})]"
        for name, z in samples.items()
    ]
    return f"point3f[] points.timeSamples = {{ {', '.join(lines)} }}"


def mesh(*lines: str, name: str = "Body", faces: str = FACES) -> str:
    return f'def Mesh "{name}" {{\n' + "\n".join([faces, *lines]) + "\n}\n"


def layer(path: Path, *prims: str, about: str = "") -> Path:
    path.write_text(f"#usda 1.0\n({about})\n" + "\n".join(prims))
    return path


def textured(path: Path, *more: str, name: str = "st", texture: Any = PLACES) -> Path:
    """A mesh with these texture coordinates, of corners or of vertices."""
    points = "[(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (-1, 0, 0)]"
    kind = "faceVarying" if len(texture) == 7 else "vertex"
    values = ", ".join(str(tuple(row)) for row in texture.tolist())
    lines = (
        f"point3f[] points.timeSamples = {{1: {points}, 2: {points}}}",
        f'texCoord2f[] primvars:{name} = [{values}] (interpolation = "{kind}")',
    )
    return layer(path, mesh(*lines, *more, faces=POLYGONS))
