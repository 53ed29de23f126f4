"""What is read into memory and written is what a conversion from file to file writes."""

import os
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import to_file
from every_format import FORMATS, NUMBERED, PARTIAL, place
from layers import textured
from stages import BODY, FLAG, HAT, production

import dynmesh

Sdf: Any = pytest.importorskip("pxr.Sdf")
N = 3


def _obj(folder: Path) -> Path:
    """Files with texture coordinates, groups, a material, colours and normals."""
    for number in range(7, 7 + N):
        (folder / f"quad_{number}.obj").write_text(
            "mtllib skin.mtl\no thing\nv 0 0 0 1 .5 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\n"
            f"v 0 1 {number} 1 1 1\nvt .1 .2\nvt .3 .4\nvt .5 .6\nvn 0 0 1\ng side\nusemtl skin\n"
            "f 1/1/1 2/2/1 3/3/1 4/1/1\n"
        )
    (folder / "skin.mtl").write_text("newmtl skin\n")
    return folder / "quad_%d.obj"


def _ply(folder: Path) -> Path:
    """A file with colours of vertices and of faces."""
    rows = "\n".join(f"{x} {y} 0 {10 * x} {y}" for x, y in ((0, 0), (9, 0), (9, 9), (0, 9)))
    (folder / "quad.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
        "property float z\nproperty uchar red\nproperty float heat\nelement face 1\n"
        "property list uchar int vertex_indices\nproperty uchar red\nend_header\n"
        f"{rows}\n4 0 1 2 3 200\n"
    )
    return folder / "quad.ply"


def _abc(folder: Path) -> Path:
    to_file.convert(textured(folder / "texture.usda"), folder / "made.abc")
    return folder / "made.abc"


INPUTS: dict[str, tuple[Callable[[Path], Path], Any]] = {
    "obj": (_obj, None),
    "ply": (_ply, None),
    "abc": (_abc, None),
    "texture": (lambda folder: textured(folder / "texture.usda"), None),
    **{mesh: (lambda folder: production(folder / "shot.usda"), mesh) for mesh in (BODY, HAT, FLAG)},
}


def written(frames: Any, folder: Path, format: str) -> tuple[tuple[str, ...], dict[str, bytes]]:
    """The remarks, and the contents of the files, but for the names of folders."""
    folder.mkdir()
    remarks = dynmesh.write(place(folder, format), frames).remarks
    if format == "alembic":  # which holds the date
        made = dynmesh.read(place(folder, format))
        return remarks, {
            name: bytes(np.array(getattr(made, name))) for name in ("vertices", "known")
        }
    if format == "usd":
        layer = Sdf.Layer.FindOrOpen(str(place(folder, format)))
        return remarks, {"layer": layer.ExportToString().encode()}
    return remarks, {file.name: file.read_bytes() for file in sorted(folder.iterdir())}


@pytest.mark.filterwarnings("ignore::dynmesh.DoubtfulWarning")
@pytest.mark.parametrize("verb", ["open", "complete", "convert"])
@pytest.mark.parametrize("name", INPUTS)
def test_memory_makes_no_difference(tmp_path: Path, name: str, verb: str) -> None:
    """Neither before a verb nor after it; what is dropped is named alike."""
    make, prim = INPUTS[name]
    path = make(tmp_path)
    source: Any = {} if prim is None else {"prim": prim}

    def of_verb(frames: Any) -> Any:
        if verb == "complete":
            return dynmesh.complete(frames, start="best")
        return dynmesh.convert(frames, scale=2) if verb == "convert" else frames

    for format in FORMATS:
        if len(dynmesh.open(path, **source)) == 1 and format in NUMBERED:
            continue
        direct = written(of_verb(dynmesh.open(path, **source)), tmp_path / f"{format}0", format)
        before = of_verb(dynmesh.read(path, **source))
        after = dynmesh.read(of_verb(dynmesh.open(path, **source)))
        assert written(before, tmp_path / f"{format}1", format) == direct
        remarks, files = written(after, tmp_path / f"{format}2", format)
        assert files == direct[1]
        assert {*remarks} <= {*direct[0]}  # but for those of the verb
        told = [remark for remark in direct[0] if " not written" in remark]
        assert [remark for remark in remarks if " not written" in remark] == told


CHANGES: dict[str, Callable[[Path], Any]] = {
    "removed": lambda path: path.unlink(),
    "changed": lambda path: path.write_text(path.read_text().replace("f 1/1/1", "# f")),
    "touched": lambda path: os.utime(path, (1, 1)),
}


@pytest.mark.parametrize("change", CHANGES)
def test_a_file_that_is_no_longer_there_is_named(tmp_path: Path, change: str) -> None:
    """What it held cannot be kept; the frames can."""
    path = _obj(tmp_path)
    sequence = dynmesh.read(path)
    CHANGES[change](tmp_path / "quad_7.obj")
    said = dynmesh.write(tmp_path / "a_%d.obj", sequence).remarks
    told = "colours, groups, materials, normals and texture coordinates of quad_7.obj"
    assert said == (f"{told} are not written",)
    np.testing.assert_array_equal(dynmesh.read(tmp_path / "a_%d.obj").vertices, sequence.vertices)
    scene = production(tmp_path / "scene.usda")
    completed = dynmesh.read(dynmesh.complete(dynmesh.open(scene, prim=BODY)))
    scene.rename(tmp_path / "elsewhere.usda")
    said = dynmesh.write(tmp_path / "alone.usda", completed).remarks
    assert any("mesh alone, as scene.usda is no longer there" in remark for remark in said)
    assert any("materials" in remark for remark in said)
    shutil.copy(tmp_path / "elsewhere.usda", scene)


@pytest.mark.parametrize("name", ["obj", "texture", BODY])
def test_another_mesh_has_none_of_it(tmp_path: Path, name: str) -> None:
    """Nor one with more vertices."""
    make, prim = INPUTS[name]
    sequence = dynmesh.read(make(tmp_path), prim=prim)
    expected = "texture coordinates"
    faces = sequence.faces[::-1].copy()
    more = np.repeat(sequence.vertices, 2, axis=1)
    for other in (
        replace(sequence, faces=faces, polygons=None),
        replace(sequence, vertices=more, known=None),
    ):
        for format in ("obj", "usd", "alembic"):
            output = place(tmp_path / "out", format)
            remarks = dynmesh.write(output, other).remarks
            assert any(expected in one and "not written" in one for one in remarks)
            np.testing.assert_array_equal(dynmesh.read(output).faces, other.faces)


def test_a_scene_in_memory_is_not_replaced_by_its_mesh(tmp_path: Path) -> None:
    """Under no name, and not what lies below it; a lone mesh may be."""
    scene = production(tmp_path / "scene.usda")
    over = tmp_path / "over.usda"
    to_file.complete(scene, over, source={"prim": BODY})
    before = scene.read_bytes(), over.read_bytes()
    (tmp_path / "link.usda").symlink_to(over)
    for path in (scene, over, tmp_path / "link.usda"):
        sequence = dynmesh.read(over, prim=HAT)
        for frames in (sequence, dynmesh.complete(sequence), dynmesh.convert(sequence, scale=2)):
            origin: Any = frames.origin
            if path == scene and not origin.is_below:
                continue  # the file that is named is replaced, as it is not that of the frames
            told = r"would lose|is the input|symbolic link"
            with pytest.raises((ValueError, FileExistsError), match=told):
                dynmesh.write(path, frames)
    assert (scene.read_bytes(), over.read_bytes()) == before
    lone = tmp_path / "lone.usda"
    dynmesh.write(lone, PARTIAL)
    completed = dynmesh.read(dynmesh.complete(dynmesh.read(lone)))
    dynmesh.write(lone, completed)
    np.testing.assert_array_equal(dynmesh.read(lone).vertices, completed.vertices)
