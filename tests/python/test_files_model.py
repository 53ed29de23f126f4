"""STL and glTF files hold one mesh, whose vertices they may repeat."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import Array, sheet

import dynmesh

trimesh: Any = pytest.importorskip("trimesh", reason="needs trimesh: dynmesh[scans]")


@pytest.mark.parametrize("name", ["a.stl", "a.glb", "a.gltf"])
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
    expected = (None, None) if name == "a.stl" else ("y", 1.0)
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


def test_a_clip_is_written_with_a_target_for_each_frame(tmp_path: Path) -> None:
    """Programs show the frames at their times, and blend between them."""
    pygltflib: Any = pytest.importorskip("pygltflib", reason="needs pygltflib: dynmesh[gltf]")
    mesh = sheet(5)
    rng = np.random.default_rng(1)
    vertices = (mesh.vertices + rng.normal(size=(4, 25, 3))).astype(np.float32)
    clip = dynmesh.Sequence(vertices, mesh.faces, fps=10, up_axis="z", metres_per_unit=0.01)
    dynmesh.write(tmp_path / "a.glb", clip)
    made = pygltflib.GLTF2().load(tmp_path / "a.glb")

    def array(number: int) -> Array:
        accessor = made.accessors[number]
        view = made.bufferViews[accessor.bufferView]
        content = made.binary_blob()[view.byteOffset : view.byteOffset + view.byteLength]
        kind = np.uint32 if accessor.componentType == pygltflib.UNSIGNED_INT else np.float32
        values = np.frombuffer(content, kind)
        assert len(values) == accessor.count * {"SCALAR": 1, "VEC3": 3}[accessor.type]
        rows = values.reshape(accessor.count, -1)
        np.testing.assert_array_equal(rows.min(axis=0), accessor.min)
        np.testing.assert_array_equal(rows.max(axis=0), accessor.max)
        return rows

    (primitive,) = made.meshes[0].primitives
    np.testing.assert_array_equal(array(primitive.indices).reshape(-1, 3), mesh.faces)
    targets = np.stack([array(target["POSITION"]) for target in primitive.targets])
    sampler = made.animations[0].samplers[0]
    np.testing.assert_allclose(array(sampler.input)[:, 0], [0, 0.1, 0.2, 0.3])
    weights = array(sampler.output).reshape(4, 3)
    shown = array(primitive.attributes.POSITION) + np.einsum("nt,tkx->nkx", weights, targets)
    np.testing.assert_allclose(shown, vertices, atol=1e-5)
    read = dynmesh.read(tmp_path / "a.glb")  # the node turns and scales the mesh
    x, y, z = 0.01 * vertices[0].T
    expected = np.stack([x, z, -y], axis=1)[mesh.faces]
    np.testing.assert_allclose(read[0][read.faces], expected, atol=1e-6)


def test_holes_and_long_clips_are_refused(tmp_path: Path) -> None:
    mesh = sheet(5)
    holes = np.stack([mesh.vertices] * 2)
    holes[1, 7] = np.nan
    with pytest.raises(ValueError, match=r"a\.glb: .*frame 1: lacks vertex 7"):
        dynmesh.write(tmp_path / "a.glb", dynmesh.Sequence(holes, mesh.faces))
    header = dynmesh.Header(mesh.faces, 4_000_000, 25, np.dtype(np.float32))
    with pytest.raises(ValueError, match="at most 3579139 frames of this mesh"):
        dynmesh.create(tmp_path / "a.glb", header)
    assert not list(tmp_path.iterdir())
