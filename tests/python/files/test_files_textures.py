"""Texture coordinates, and what else of a mesh in a scene is kept or left out."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import to_file
from commands import dynmesh_command as run
from layers import PLACES, REST, layer, mesh, textured
from plain_files import corners_in_obj
from stages import stage_of

import dynmesh

alembic = pytest.importorskip("alembic3d")
Abc, Geometry = alembic.Abc, alembic.AbcGeom


def texture_in(path: Path) -> Any:
    with dynmesh.open(path) as reader:
        return reader.texture


@pytest.mark.parametrize("of_vertices", [False, True])
def test_texture_coordinates_go_from_format_to_format(tmp_path: Path, of_vertices: bool) -> None:
    texture = PLACES[:5] if of_vertices else PLACES
    corners = [0, 1, 2, 3, 0, 3, 4]
    expected = texture[corners] if of_vertices else texture
    path = textured(tmp_path / "a.usda", name="UVMap", texture=texture)
    for name in ("b.abc", "c.usdc", "d.abc", "e.abc"):
        assert to_file.convert(path, tmp_path / name).remarks == ()
        path = tmp_path / name
        np.testing.assert_array_equal(texture_in(path), expected)
    for name, made in (("f_%d.obj", "f_2.obj"), ("g.pc2", "g.obj")):
        assert "texture" not in " ".join(to_file.convert(path, tmp_path / name).remarks)
        found = corners_in_obj(tmp_path / made)
        assert [vertex for face in found for _, vertex in face] == corners
        assert list(map(len, found)) == [4, 3]
        np.testing.assert_array_equal([place for face in found for place, _ in face], expected)
    archive = Abc.IArchive(str(tmp_path / "e.abc"))
    schema = Geometry.IPolyMesh(archive.getTop(), "Body").getSchema()
    order = [3, 2, 1, 0, 6, 5, 4]
    assert list(schema.getFaceIndicesProperty().getValue(0)) == [corners[i] for i in order]
    values = np.array(schema.getUVsParam().getExpandedValue(1).getVals())
    np.testing.assert_array_equal(values, expected[order])


def test_faces_of_left_handed_meshes_are_turned_with_their_texture(tmp_path: Path) -> None:
    told = 'uniform token orientation = "leftHanded"'
    path = textured(tmp_path / "a.usda", told)
    faces = dynmesh.read(path).polygons
    assert faces is not None
    assert faces.corners.tolist() == [3, 2, 1, 0, 4, 3, 0]
    np.testing.assert_array_equal(texture_in(path), PLACES[[3, 2, 1, 0, 6, 5, 4]])
    by_vertex = textured(tmp_path / "b.usda", told, texture=PLACES[:5])
    np.testing.assert_array_equal(texture_in(by_vertex), PLACES[faces.corners])
    to_file.convert(path, tmp_path / "c.usda")
    again = dynmesh.read(tmp_path / "c.usda").polygons
    assert again is not None
    np.testing.assert_array_equal(again.corners, faces.corners)
    to_file.complete(path, tmp_path / "over.usda")  # a layer, which leaves the faces alone
    stage = stage_of(tmp_path / "over.usda")
    left = stage.GetPrimAtPath("/Body")
    assert left.GetAttribute("orientation").Get() == "leftHanded"
    assert list(left.GetAttribute("faceVertexIndices").Get()) == [0, 1, 2, 3, 0, 3, 4]


POSED = f"point3f[] points = {REST}"
MOVERS: dict[str, tuple[str, str]] = {
    "a skeleton": ("", "rel skel:skeleton = </Rig>"),
    "blend shapes": ("", 'uniform token[] skel:blendShapes = ["smile"]'),
    "transforms": (
        "double3 xformOp:translate.timeSamples = {1: (0, 0, 0), 2: (1, 0, 0)}\n"
        'uniform token[] xformOpOrder = ["xformOp:translate"]', ""
    ),
    "": (
        "double3 xformOp:translate = (1, 0, 0)\n"
        'uniform token[] xformOpOrder = ["xformOp:translate"]', ""
    ),
}  # fmt: skip


@pytest.mark.parametrize("mover", MOVERS)
def test_what_moves_a_mesh_and_is_not_read_is_said(tmp_path: Path, mover: str) -> None:
    above, of_mesh = MOVERS[mover]
    world = f'def Xform "World" {{\n{above}\n{mesh(POSED, of_mesh)}}}'
    path = layer(tmp_path / "a.usda", world)
    for words in (("info", path), ("view", path, "-o", tmp_path / "b.html")):
        done = run(*words)
        told = done.stdout + done.stderr
        assert ("moved by" in told) == (f"the mesh is moved by {mover}," in told) == bool(mover)


def test_what_a_conversion_leaves_out_is_said_in_one_sentence(tmp_path: Path) -> None:
    path = textured(
        tmp_path / "a.usda",
        'texCoord2f[] primvars:lightmap = [(0, 0)] (interpolation = "vertex")',
        "color3f[] primvars:displayColor = [(1, 0, 0)]",
        "rel material:binding = </Body/skin>",
        'def Material "skin" {}',
        'def GeomSubset "face" { uniform token elementType = "face"\nint[] indices = [0]\n}',
    )
    left = "colours, lightmap, materials and subsets of a.usda are not written"
    more = "colours, lightmap, materials, subsets and texture coordinates of a.usda are not written"
    for name, told in (("b.abc", left), ("c_%d.obj", left), ("d.npz", more)):
        remarks = to_file.convert(path, tmp_path / name).remarks
        assert [one for one in remarks if "of a.usda" in one] == [told]
    layered = to_file.complete(path, tmp_path / "over.usda").remarks
    assert not [one for one in layered if "written" in one]


def test_a_template_provides_the_texture_coordinates(tmp_path: Path) -> None:
    path = textured(tmp_path / "a.usda")
    partial = dynmesh.read(path)
    dynmesh.write(tmp_path / "partial.npz", partial)
    to_file.complete(tmp_path / "partial.npz", tmp_path / "b.abc", template=path)
    np.testing.assert_array_equal(texture_in(tmp_path / "b.abc"), PLACES)
    remarks = to_file.complete(tmp_path / "partial.npz", tmp_path / "c.usda", template=path).remarks
    assert not any("alone" in remark for remark in remarks)  # it does not lie over the template
