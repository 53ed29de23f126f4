"""Alembic archives that are made from another one keep its scene."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from archives import BODY, FPS, HAT, N_FRAMES, START, Production, content
from commands import dynmesh_command
from memory import own_memory

import dynmesh
from dynmesh.files.derivatives import Motions, Normals
from dynmesh.polygons import as_polygons

alembic3d: Any = pytest.importorskip("alembic3d")
imath: Any = pytest.importorskip("imath")

OF_POINTS = {".geom/P", ".geom/.selfBnds", ".geom/N", ".geom/.velocities"}


@pytest.fixture(scope="module")
def archive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("archive") / "scene.abc"
    Production(path)
    return path


def changed(before: Path, after: Path) -> tuple[set[str], set[str]]:
    """The objects and, apart from them, the properties in which two archives differ."""
    one, other = content(before), content(after)
    names = {name for name in one | other if repr(one.get(name)) != repr(other.get(name))}
    return {name.partition(":")[0] for name in names}, {name.partition(":/")[2] for name in names}


def test_only_the_points_of_one_mesh_change(archive: Path, tmp_path: Path) -> None:
    dynmesh_command("complete", archive, tmp_path / "done.abc", "--prim", BODY)
    objects, properties = changed(archive, tmp_path / "done.abc")
    assert objects == {BODY, "/copies/rig2/body", "/"}
    assert properties == {*OF_POINTS, ".childBnds"}


def test_a_conversion_changes_nothing_of_whole_meshes(tmp_path: Path) -> None:
    Production(tmp_path / "scene.abc", holes=False)
    with (
        dynmesh.open(tmp_path / "scene.abc", prim=HAT) as reader,
        dynmesh.create_like(reader, tmp_path / "copy.abc") as writer,
    ):
        for frame in reader:
            writer.append(frame.points)
    objects, properties = changed(tmp_path / "scene.abc", tmp_path / "copy.abc")
    assert (objects, properties) == ({"/"}, {".childBnds"})
    dynmesh_command("convert", tmp_path / "scene.abc", tmp_path / "again.abc", "--prim", HAT)
    assert content(tmp_path / "again.abc") == content(tmp_path / "copy.abc")


def derived(path: Path, name: str) -> Any:
    *_, times, values = content(path)[f"{BODY}:/.geom/{name}"]
    assert times == pytest.approx([(START + n) / FPS for n in range(N_FRAMES)])
    return np.array(values)


@pytest.mark.parametrize("indexed", [False, True])
def test_normals_and_velocities_follow_the_new_points(tmp_path: Path, indexed: bool) -> None:
    Production(tmp_path / "scene.abc", indexed=indexed)
    dynmesh_command("complete", tmp_path / "scene.abc", tmp_path / "done.abc", "--prim", BODY)
    made = dynmesh.read(tmp_path / "done.abc", prim=BODY)
    normals = Normals(as_polygons(made.faces), "vertex")
    expected = np.stack([normals.of(points) for points in made.vertices])
    assert np.abs(derived(tmp_path / "done.abc", "N") - expected).max() < 1e-6
    motions = Motions(np.arange(N_FRAMES) / FPS)
    pushed = [motion for points in made.vertices for motion in motions.push(points)]
    speeds = np.stack([values for what, _, values in pushed if what == "velocities"])
    np.testing.assert_allclose(derived(tmp_path / "done.abc", ".velocities"), speeds, atol=1e-3)


def test_normals_that_differ_between_faces_are_left_out_with_a_remark(tmp_path: Path) -> None:
    Production(tmp_path / "scene.abc", normals="kFacevaryingScope")
    said = dynmesh_command(
        "complete", tmp_path / "scene.abc", tmp_path / "done.abc", "--prim", BODY
    ).stderr
    assert f"{BODY}: normals are left out" in said
    assert f"{BODY}:/.geom/N" not in content(tmp_path / "done.abc")


def test_other_frames_per_second_change_all_times_alike(archive: Path, tmp_path: Path) -> None:
    dynmesh_command("convert", archive, tmp_path / "slow.abc", "--prim", HAT, "--fps", "12")
    before, after = content(archive), content(tmp_path / "slow.abc")
    moving = [f"{HAT}:/.geom/P", f"{BODY}:/.geom/P", "/rig:/.xform/.vals"]
    for name in moving:
        assert after[name][-2] == pytest.approx([2 * time for time in before[name][-2]])
    assert dynmesh.read(tmp_path / "slow.abc", prim=BODY).fps == 12


def test_masks_stay_with_the_mesh_until_it_is_completed(tmp_path: Path) -> None:
    Production(tmp_path / "scene.abc", holes=False)
    lost = tmp_path / "lost.abc"
    dynmesh_command("degrade", tmp_path / "scene.abc", lost, "--prim", HAT, "--known", "0.5")
    assert dynmesh.read(lost, prim=HAT).known is not None
    objects, properties = changed(tmp_path / "scene.abc", lost)
    assert objects == {HAT, "/"}
    assert ".geom/.arbGeomParams/known" in properties
    dynmesh_command("complete", lost, tmp_path / "done.abc", "--prim", HAT)
    with dynmesh.open(tmp_path / "done.abc", prim=HAT) as reader:
        assert not reader.has_known


def test_what_the_library_cannot_write_is_named(
    archive: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from dynmesh.files.alembic_output import OutputArchive

    add = OutputArchive.add

    def refuse(self: Any, prop: Any, value: Any) -> None:
        if prop.getName() == "asset":
            raise TypeError("Unhandled type string")
        add(self, prop, value)

    monkeypatch.setattr(OutputArchive, "add", refuse)
    said = dynmesh_command("complete", archive, tmp_path / "done.abc", "--prim", HAT).stderr
    assert f"not copied, since the library cannot write such values: {BODY} " in said
    assert ".geom/.userProperties/asset" in said
    assert changed(archive, tmp_path / "done.abc")[0] == {HAT, BODY, "/copies/rig2/body", "/"}


FULL_DISK = """
import resource, sys
import dynmesh

path, output, limit = *sys.argv[1:3], int(sys.argv[3])
resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
try:
    dynmesh.complete_file(path, output, source={'prim': '/hat'})
except OSError as error:
    print(error)
"""


@pytest.mark.parametrize("share", [0.3, 0.9, 0.999])
def test_a_full_disk_is_reported_and_leaves_nothing(tmp_path: Path, share: float) -> None:
    """The library would end the process."""
    scene, output = tmp_path / "scene.abc", tmp_path / "done.abc"
    Production(scene, n_others=100)
    limit = int(share * scene.stat().st_size)
    command = [sys.executable, "-c", FULL_DISK, str(scene), str(output), str(limit)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert f"File too large: '{output}'" in done.stdout
    assert list(tmp_path.iterdir()) == [scene]


def test_memory_does_not_grow_with_the_scene(tmp_path: Path) -> None:
    """The samples of other objects are copied one at a time."""
    n_samples, path = 40, tmp_path / "scene.abc"
    archive = alembic3d.Abc.OArchive(str(path))
    mesh = alembic3d.AbcGeom.OPolyMesh(archive.getTop(), "mesh").getSchema()
    other = alembic3d.Abc.OObject(archive.getTop(), "other").getProperties()
    values = alembic3d.Abc.OV3fArrayProperty(other, "values", alembic3d.Abc.Argument(0))
    for number in range(n_samples):
        array = np.random.default_rng(number).random((100_000, 3)).astype(np.float32)
        values.setValue(imath.V3fArrayFromBuffer(array))
        corners, sizes = imath.IntArray(3), imath.IntArray(1)
        corners[1], corners[2], sizes[0] = 1, 2, 3
        points = imath.V3fArrayFromBuffer(array[:3].copy())
        mesh.set(alembic3d.AbcGeom.OPolyMeshSchemaSample(points, corners, sizes))
    del archive, mesh, other, values
    used = []
    with dynmesh.open(path) as reader:
        with dynmesh.create_like(reader, tmp_path / "copy.abc") as writer:
            for frame in reader:
                writer.append(frame.points)
                used.append(own_memory())
        used.append(own_memory())
    assert (tmp_path / "copy.abc").stat().st_size > n_samples * 1_200_000
    assert max(used) - used[0] < 10_000
