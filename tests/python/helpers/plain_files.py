"""PLY and OBJ files as text, for the tests of files with one frame each."""

from pathlib import Path

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def ply(elements: str, body: bytes, *, format: str = "ascii", head: str = "") -> bytes:
    """Builds a PLY file from elements: `vertex 3: float x, float y, float z; face 1: ...`."""
    lines = ["ply", f"format {format} 1.0", *head.splitlines()]
    for element in elements.split("; "):
        name, _, properties = element.partition(": ")
        lines.append(f"element {name}")
        lines += [f"property {one}" for one in properties.split(", ")]
    return "\n".join([*lines, "end_header\n"]).encode() + body


XYZ = "float x, float y, float z"
FACE = "list uchar int vertex_indices"
POINTS = b"0 0 0\n1 0 0\n0 1 0\n"


def triangle(face: bytes) -> bytes:
    """Three vertices and one face, which is given as the end of the file."""
    return ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS + face)


def corners_in_obj(path: Path) -> list[list[tuple[list[float], int]]]:
    """The texture coordinates and the vertices of the corners of each face."""
    lines = [line.split() for line in path.read_text().splitlines()]
    places = [[float(x) for x in words] for kind, *words in lines if kind == "vt"]
    faces = [[word.split("/") for word in words] for kind, *words in lines if kind == "f"]
    return [[(places[int(t) - 1], int(v) - 1) for v, t in face] for face in faces]
