"""Files that libraries would read as another mesh than the one that they state."""

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import to_file
from sequences import assert_refused

import dynmesh

pytest.importorskip("trimesh", reason="needs trimesh: dynmesh[scans]")


def gltf(**changed: Any) -> dict[str, Any]:
    """A triangle with one accessor for positions and one for corners, which are changed."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    data = points.tobytes() + struct.pack("<3H", 0, 1, 2)
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    told: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 6},
        ],
        "buffers": [{"uri": uri, "byteLength": len(data)}],
    }
    for place, values in changed.items():
        kind, _, number = place.partition("_")
        one = told[kind][int(number)]
        one = one["primitives"][0] if kind == "meshes" and "primitives" not in values else one
        one.update(values)
        for name in [name for name, value in values.items() if value is None]:
            del one[name]
    return told


DRACO = {"extensions": {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {}}}}
MESHOPT = {"extensions": {"EXT_meshopt_compression": {"buffer": 0, "byteLength": 36}}}
GLTF: dict[str, tuple[dict[str, Any], str]] = {
    "Draco": (gltf(meshes_0=DRACO, accessors_0={"bufferView": None}), "accessor 0 is compressed"),
    "meshopt": (gltf(bufferViews_0=MESHOPT), "accessor 0 is compressed"),
    "sparse positions": (gltf(accessors_0={"sparse": {"count": 1}}), "accessor 0 is .*sparse"),
    "normalised": (
        gltf(accessors_0={"componentType": 5122, "normalized": True}), "accessor 0 is .*normalised"
    ),
    "instances": (
        gltf(nodes_0={"extensions": {"EXT_mesh_gpu_instancing": {}}}), "EXT_mesh_gpu_instancing"
    ),
    "fans": (gltf(meshes_0={"mode": 6}), "triangle fans"),
    "another extension": ({**gltf(), "extensionsRequired": ["EXT_x"]}, "requires the .* EXT_x"),
    "a corner outside": (gltf(accessors_0={"count": 2}), "cannot be read as GLTF|vertex 2"),
}  # fmt: skip


@pytest.mark.parametrize("what", GLTF)
def test_gltf_that_would_be_read_as_another_mesh_is_refused(tmp_path: Path, what: str) -> None:
    path = tmp_path / "a.gltf"
    path.write_text(json.dumps(GLTF[what][0]))
    assert_refused(path, GLTF[what][1])


def test_gltf_is_read_whatever_its_looks_and_morph_targets_are_named(tmp_path: Path) -> None:
    path = tmp_path / "a.gltf"
    told = {**gltf(), "extensionsRequired": ["KHR_materials_unlit", "KHR_texture_transform"]}
    path.write_text(json.dumps(told))
    assert dynmesh.read(path).vertices.tolist() == [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]]
    whole = gltf(meshes_0={"targets": [{"POSITION": 0}]})
    whole["meshes"][0]["weights"] = [0.5]
    path.write_text(json.dumps(whole))
    (remark,) = to_file.convert(path, tmp_path / "a.npz").remarks
    assert "weights of morph targets of a.gltf are not" in remark


VERTICES = "vertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
STL = f"solid a\nfacet normal 0 0 1\nouter loop\n{VERTICES}endloop\nendfacet\nendsolid a\n"
OFF = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
OTHERS: dict[str, tuple[str, str, str]] = {
    "no number": ("stl", STL.replace("vertex 1", "vertex 1.#QNAN"), "STL: "),
    "two and four": (
        "stl",
        STL.replace("1 0 0\n", "1 0\n").replace("0 1 0", "0 1 0 0"),
        "1 facets",
    ),
    "no triangle of two": ("stl", "\0" * 80 + "\2\0\0\0" + "\0" * 50, "STL: "),
    "too few vertices": ("off", OFF.replace("1 0 0\n", ""), "states 3 vertices and 1 faces"),
    "a corner outside": ("off", OFF.replace("1 2\n", "1 3\n"), "OFF: .*outside"),
    "Alembic in HDF5": ("abc", "\x89HDF\r\n\x1a\n" + "\0" * 99, "in HDF5; write it as Ogawa"),
}


@pytest.mark.parametrize("what", OTHERS)
def test_a_file_that_holds_other_numbers_than_it_states_is_refused(
    tmp_path: Path, what: str
) -> None:
    suffix, content, told = OTHERS[what]
    path = tmp_path / f"a.{suffix}"
    path.write_bytes(content.encode("latin-1"))
    assert_refused(path, told)


def test_off_may_mix_polygons(tmp_path: Path) -> None:
    path = tmp_path / "a.off"
    path.write_text("OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n4 0 1 2 3\n")
    faces = [sorted(face) for face in dynmesh.read(path).faces.tolist()]
    assert faces == [[0, 1, 2], [0, 1, 2], [0, 2, 3]]
