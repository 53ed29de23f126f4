"""STL, OFF and glTF files hold one mesh, whose vertices they may repeat."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import sheet

import dynmesh

trimesh: Any = pytest.importorskip("trimesh", reason="needs trimesh: dynmesh[scans]")


@pytest.mark.parametrize("name", ["a.stl", "a.off", "a.glb", "a.gltf"])
def test_each_vertex_is_read_once(name: str, tmp_path: Path) -> None:
    mesh = sheet(6)
    corners = mesh.vertices[mesh.faces].reshape(-1, 3)  # each triangle has vertices of its own
    soup = trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False)
    if name.endswith("gltf"):
        for file, content in trimesh.exchange.gltf.export_gltf(trimesh.Scene(soup)).items():
            (tmp_path / file.replace("model", "a")).write_bytes(content)
    else:
        soup.export(tmp_path / name)
    read = dynmesh.read(tmp_path / name)
    assert read.vertices.shape == (1, len(mesh.vertices), 3)
    np.testing.assert_allclose(read[0][read.faces].reshape(-1, 3), corners, rtol=1e-6, atol=1e-6)
    _, first = np.unique(read.faces, return_index=True)
    assert (np.diff(first) > 0).all()  # in the order in which they occur
    expected = ("y", 1.0) if "gl" in name else (None, None)
    assert (read.up_axis, read.metres_per_unit) == expected


def test_meshes_of_a_scene_are_where_the_scene_has_them(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    for x in (0, 5):
        moved = trimesh.transformations.translation_matrix([x, 0, 0])
        scene.add_geometry(trimesh.creation.box(), transform=moved)
    scene.export(tmp_path / "boxes.glb")
    read = dynmesh.read(tmp_path / "boxes.glb")
    assert read.vertices.shape == (1, 16, 3)
    np.testing.assert_allclose(np.ptp(read.vertices[0], axis=0), [6, 1, 1])
