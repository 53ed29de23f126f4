"""STL, OFF and glTF: one mesh, such as a template, by trimesh (extra `scans`).

Vertices at the same position become one, since STL repeats them in every triangle, and glTF where
texture coordinates or normals differ. Their order depends on that, so several such files are no
sequence. All meshes of a scene become one, in the space of the scene. glTF is in metres, y up;
its animations are not read.
"""

import json
import re
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._errors import InputError, of_library, require
from ..frame import FileFrames, Frame, Indices
from ..header import Header, Origin
from ..polygons import Polygons, split_polygons
from .format import Format

_OF_LOOKS = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_", "KHR_xmp")
"""Extensions that a mesh can be read without, by how their names begin."""

_FAN = 6  # of modes of primitives


def what_gltf_holds(path: Path) -> set[str]:
    """Returns what of the shapes in a file is not read, in words."""
    document = _json_in(path)
    nodes, held = document.get("nodes", []), set()
    for name in document.get("extensionsRequired", []):
        if not name.startswith(_OF_LOOKS) and name != "KHR_mesh_quantization":
            _refuse(f"requires the extension {name}")
    if any("EXT_mesh_gpu_instancing" in node.get("extensions", {}) for node in nodes):
        _refuse("repeats meshes by the extension EXT_mesh_gpu_instancing")
    for primitive in chain.from_iterable(one["primitives"] for one in document.get("meshes", [])):
        _check_plain(document, primitive["attributes"]["POSITION"])
        if "indices" in primitive:
            _check_plain(document, primitive["indices"])
        if primitive.get("mode") == _FAN:
            _refuse("has triangle fans")
        if primitive.get("targets"):
            weights = [one.get("weights", []) for one in (*document["meshes"], *nodes)]
            held.add("weights of morph targets" if any(map(any, weights)) else "morph targets")
    if any("skin" in node for node in nodes):
        held.add("skins")
    return held | ({"animations"} if document.get("animations") else set())


def _check_plain(document: dict[str, Any], number: int) -> None:
    """Refuses an accessor whose numbers the library would not read, or as others."""
    accessor = document["accessors"][number]
    view = document["bufferViews"][accessor["bufferView"]] if "bufferView" in accessor else {}
    if not view or view.get("extensions") or "sparse" in accessor or accessor.get("normalized"):
        _refuse(f"accessor {number} is compressed, sparse or normalised")


def _refuse(what: str) -> None:
    raise InputError(f"{what}, which is not supported; export it as plain floats, uncompressed")


def _json_in(path: Path) -> Any:
    content = path.read_bytes()
    if content.startswith(b"glTF"):  # a header of 12 bytes, then the length and kind of the JSON
        content = content[20 : 20 + int.from_bytes(content[12:16], "little")]
    return json.loads(content.decode("utf-8-sig"))


_GLTF = (".glb", ".gltf")


class ModelFrames(FileFrames):
    """A mesh as a sequence of one frame."""

    def __init__(self, path: Path) -> None:
        kind, held = path.suffix.lower()[1:], set[str]()
        path.open("rb").close()  # gives the error message of the system
        with of_library(f"cannot be read as {kind.upper()}"):
            held = what_gltf_holds(path) if path.suffix.lower() in _GLTF else held
            points, polygons = _by_trimesh(path)
        if not len(points):  # of a file that is cut, too
            raise InputError(f"cannot be read as {kind.upper()}: it has no vertices")
        if not np.isfinite(points).all():
            raise InputError("has a vertex that is not finite")
        corners = polygons.corners
        if len(corners) and not 0 <= corners.min() <= corners.max() < len(points):
            message = f"a face refers to vertex {corners.max()}, but there are {len(points)}"
            raise InputError(f"{message}, counted from 0")
        _, first, same = np.unique(points, axis=0, return_index=True, return_inverse=True)
        place = np.argsort(np.argsort(first))
        self._points = points[np.sort(first)]
        triangles, _ = split_polygons(Polygons(polygons.sizes, place[same.ravel()][corners]))
        up, unit = ("y", 1.0) if path.suffix.lower() in _GLTF else (None, None)
        header = Header(
            triangles.astype(np.int32),
            1,
            len(self._points),
            points.dtype,
            up_axis=up,
            metres_per_unit=unit,
        )
        super().__init__(path, header, origin=Origin.of(path, header, held))

    def _frames(self, numbers: Indices) -> Iterator[Frame]:
        for _ in numbers:
            yield Frame(self._points)


def _by_trimesh(path: Path) -> tuple[NDArray[np.float64], Polygons]:
    """Returns the vertices and the triangles, as many as the file states."""
    scene: Any = require("trimesh", extra="scans").load_scene(path, process=False)
    mesh = scene.to_mesh()
    points = np.asarray(mesh.vertices, np.float64).reshape(-1, 3)
    corners = np.asarray(getattr(mesh, "faces", np.zeros((0, 3))), np.int64).reshape(-1)
    if path.suffix.lower() == ".stl":
        _check_stl(path.read_bytes(), len(corners) // 3)
    if path.suffix.lower() == ".off":
        _check_off(path.read_bytes())
    return points, Polygons(np.full(len(corners) // 3, 3), corners)


def _check_stl(content: bytes, n_faces: int) -> None:
    """Refuses an STL file of which the library has read more or fewer triangles than it states."""
    stated = int.from_bytes(content[80:84], "little")
    if len(content) != 84 + 50 * stated:
        lines = [line.split() for line in content.lower().splitlines()]
        stated = sum(line[:1] == [b"facet"] for line in lines)
        vertices = [line for line in lines if line[:1] == [b"vertex"]]
        if len(vertices) != 3 * stated or any(len(line) != 4 for line in vertices):
            message = f"has {stated} facets, but {len(vertices)} lines 'vertex x y z'"
            raise InputError(f"{message}; is it cut or damaged?")
    if stated != n_faces:
        raise InputError(f"states {stated} triangles, but {n_faces} were read")


def _check_off(content: bytes) -> None:
    """Refuses an OFF file with fewer lines than vertices and faces, which the library accepts."""
    text = re.sub(rb"#[^\r\n]*", b"", content)
    stated = re.search(rb"OFF\s+(\d+)\s+(\d+)[^\r\n]*", text)
    if stated is None:
        raise InputError("cannot be read as OFF: it does not state its numbers")
    vertices, faces = int(stated[1]), int(stated[2])
    n_lines = sum(bool(line.strip()) for line in text[stated.end() :].splitlines())
    if n_lines < vertices + faces:
        message = f"states {vertices} vertices and {faces} faces, but has {n_lines} lines of them"
        raise InputError(f"{message}; is it cut or damaged?")


model = Format("model", (".stl", ".off", *_GLTF), ModelFrames, library=("trimesh", "scans"))
