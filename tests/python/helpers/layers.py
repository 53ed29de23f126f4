"""USD layers with triangles, as text."""

from pathlib import Path

FACES = "int[] faceVertexCounts = [3]\nint[] faceVertexIndices = [0, 1, 2]"
REST = "[(0, 0, 0), (1, 0, 0), (0, 1, 0)]"


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
