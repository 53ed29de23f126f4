"""What glTF files state of their meshes, to tell what the library would read as something else."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from .._errors import InputError

_OF_LOOKS = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_", "KHR_xmp")
"""Extensions that a mesh can be read without, by how their names begin."""

_FLOAT, _TRIANGLES, _STRIP, _FAN = 5126, 4, 5, 6


def what_gltf_holds(path: Path) -> set[str]:
    """Returns what of the shapes in a file is not read, in words."""
    document = _json_in(path)
    nodes, held = document.get("nodes", []), set()
    for name in document.get("extensionsRequired", []):
        if not name.startswith(_OF_LOOKS) and name != "KHR_mesh_quantization":
            _refuse(f"requires the extension {name}")
    if any("EXT_mesh_gpu_instancing" in node.get("extensions", {}) for node in nodes):
        _refuse("repeats meshes by the extension EXT_mesh_gpu_instancing")
    for primitive in _primitives(document):
        _check_accessor(document, primitive["attributes"]["POSITION"], primitive, is_position=True)
        if "indices" in primitive:
            _check_accessor(document, primitive["indices"], primitive, is_position=False)
        if primitive.get("mode", _TRIANGLES) == _FAN:
            _refuse("has triangle fans")
        if primitive.get("targets"):
            weights = [one.get("weights", []) for one in (*document["meshes"], *nodes)]
            held.add("weights of morph targets" if any(map(any, weights)) else "morph targets")
    if any("skin" in node for node in nodes):
        held.add("skins")
    return held | ({"animations"} if document.get("animations") else set())


def check_counts(path: Path, read: Sequence[Any]) -> None:
    """Refuses meshes of the library that have not as many vertices and faces as a file states."""
    document = _json_in(path)
    stated = []
    for primitive in _primitives(document):
        if (mode := primitive.get("mode", _TRIANGLES)) in (_TRIANGLES, _STRIP):
            n = document["accessors"][primitive["attributes"]["POSITION"]]["count"]
            at = primitive.get("indices")
            corners = n if at is None else document["accessors"][at]["count"]
            stated.append((n, corners // 3 if mode == _TRIANGLES else None))
    meshes = [mesh for mesh in read if hasattr(mesh, "faces")]
    results = [
        (len(mesh.vertices), None if faces is None else len(mesh.faces))
        for mesh, (_, faces) in zip(meshes, stated, strict=False)
    ]
    if len(meshes) != len(stated) or results != stated:
        raise InputError(f"states meshes of {stated} vertices and faces, but {results} were read")


def _check_accessor(
    document: dict[str, Any], number: int, primitive: dict[str, Any], *, is_position: bool
) -> None:
    accessor = document["accessors"][number]
    what = f"accessor {number}, of {'positions' if is_position else 'faces'},"
    if "sparse" in accessor:
        _refuse(f"{what} is sparse")
    if "bufferView" not in accessor:
        by = " and ".join(primitive.get("extensions", {})) or "no buffer"
        _refuse(f"{what} is given by {by}")
    for name in document["bufferViews"][accessor["bufferView"]].get("extensions", {}):
        _refuse(f"{what} is given by {name}")
    if is_position and accessor["componentType"] != _FLOAT and accessor.get("normalized"):
        _refuse(f"{what} is of normalised integers")


def _primitives(document: dict[str, Any]) -> Iterator[dict[str, Any]]:
    for mesh in document.get("meshes", []):
        yield from mesh["primitives"]


def _refuse(what: str) -> None:
    raise InputError(f"{what}, which is not supported; export it as plain floats, uncompressed")


def _json_in(path: Path) -> Any:
    content = path.read_bytes()
    if content.startswith(b"glTF"):  # a header of 12 bytes, then the length and kind of the JSON
        content = content[20 : 20 + int.from_bytes(content[12:16], "little")]
    return json.loads(content.decode("utf-8-sig"))
