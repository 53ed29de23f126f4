"""Files of points and of models."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import LONGER
from hypothesis import example, given, settings
from hypothesis import strategies as st
from meshes import sheet
from plain_files import ply
from scan_files import a_rig, opened, some_points
from sequences import assert_refused

import dynmesh
from dynmesh._errors import DynmeshError
from dynmesh.scans import (
    PointScan,
    read_cameras,
    read_points,
    scan_folder,
    write_cameras,
    write_ply,
)


def write_as(file: Path, scan: PointScan) -> None:
    """Writes points by other means than dynmesh."""
    table = scan.points if scan.normals is None else np.hstack([scan.points, scan.normals])
    names = ["x", "y", "z", "nx", "ny", "nz"][: table.shape[1]]
    if file.suffix == ".xyz":
        np.savetxt(file, table, fmt="%.17g", header="made by a scanner")
    else:
        rows = "".join(" ".join(f"{value:.17g}" for value in row) + "\n" for row in table)
        properties = ", ".join(f"double {name}" for name in names)
        file.write_bytes(ply(f"vertex {len(table)}: {properties}", rows.encode()))


@pytest.mark.parametrize("suffix", [".ply", ".xyz"])
@pytest.mark.parametrize("with_normals", [False, True])
def test_points_of_others_are_read(tmp_path: Path, suffix: str, with_normals: bool) -> None:
    scan = some_points()
    scan = scan if with_normals else scan._replace(normals=None)
    write_as(tmp_path / f"a{suffix}", scan)
    found = read_points(tmp_path / f"a{suffix}").scan
    np.testing.assert_array_equal(found.points, scan.points)
    assert (found.normals is None) == (not with_normals)
    if scan.normals is not None and found.normals is not None:
        np.testing.assert_allclose(found.normals, scan.normals, rtol=1e-14)


@pytest.mark.parametrize("kind", ["uchar", "float"])
def test_colours_keep_their_kind_in_files_that_are_named_by_text(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    monkeypatch.chdir(tmp_path)
    colours: Any = np.arange(15).reshape(5, 3) * (17 if kind == "uchar" else 1 / 16)
    scan = some_points(np.float32, 5)._replace(colours=colours)
    write_ply("a.ply", scan)
    assert f"property {kind} green\n".encode() in Path("a.ply").read_bytes()
    np.testing.assert_array_equal(read_points("a.ply").scan.colours, colours)
    write_cameras("cameras.json", a_rig(3))
    with scan_folder("scans", read_cameras("cameras.json")) as append:
        append(scan)
    (found,) = opened(tmp_path / "scans")
    np.testing.assert_array_equal(found.points, scan.points)
    for name in ("normals", "colours"):
        with pytest.raises(ValueError, match=rf"{name}: must have shape \(5, 3\), not \(4, 3\)"):
            write_ply("b.ply", scan._replace(**{name: np.ones((4, 3))}))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_folders_of_points_come_back(tmp_path: Path, dtype: Any) -> None:
    scans = [some_points(dtype, n) for n in (5, 0, 9)]
    rig = a_rig(3, unit=0.001)
    with scan_folder(tmp_path / "scans", rig) as append:
        for scan in scans:
            append(scan)
    reader = opened(tmp_path / "scans")
    assert (reader.n_frames, reader.metres_per_unit) == (3, 0.001)
    for pattern in ("frame_%05d.ply", "frame_#####.ply"):
        assert opened(tmp_path / "scans" / pattern).n_frames == 3
    for scan, found in zip(scans, reader, strict=True):
        assert found.points.dtype == dtype
        np.testing.assert_array_equal(found.points, scan.points)
        np.testing.assert_allclose(np.asarray(found.viewpoints), rig.viewpoints(0), rtol=1e-6)


@pytest.mark.parametrize(
    ("normals", "expected"),
    [
        (["0 0 1", "0 1 0"], [[0, 0, 1], [0, 1, 0]]),
        (["0 0 2", "0 3 4"], [[0, 0, 1], [0, 0.6, 0.8]]),
        (["0 0 1e-30", "1e200 0 -1e200"], [[0, 0, 1], [0.5**0.5, 0, -(0.5**0.5)]]),
        (["nan nan nan", "0 1 0"], [[0, 0, 0], [0, 1, 0]]),
        (["0 0 0", "0 1 -nan(ind)"], None),
        (["0 0 1", "0 inf 0"], "is infinite"),
        (["0 0 1", "200 0 0"], "is a colour"),
    ],
)
@pytest.mark.parametrize("suffix", ["xyz", "ply"])
def test_normals_are_unit_vectors_or_unknown(
    tmp_path: Path, suffix: str, normals: list[str], expected: Any
) -> None:
    lines = "".join(f"{number} 2 3 {normal}\n" for number, normal in enumerate(normals)).encode()
    names = ", ".join(f"double {name}" for name in ("x", "y", "z", "nx", "ny", "nz"))
    content = ply(f"vertex {len(normals)}: {names}", lines) if suffix == "ply" else lines
    file = tmp_path / f"a.{suffix}"
    file.write_bytes(content)
    if expected == "is a colour" and suffix == "ply":  # which names its columns
        expected = [[0, 0, 1], [1, 0, 0]]
    if isinstance(expected, str):
        assert_refused(file, expected, lambda given: read_points(given))
    elif expected is None:
        assert read_points(file).scan.normals is None
    else:
        np.testing.assert_allclose(np.asarray(read_points(file).scan.normals), expected)


def test_what_was_not_measured_is_left_out(tmp_path: Path) -> None:
    (tmp_path / "a.xyz").write_text("# a cloud\n0 0 1\nnan nan nan\n\n1, 2, 3 # the last\n")
    np.testing.assert_array_equal(
        read_points(tmp_path / "a.xyz").scan.points, [[0, 0, 1], [1, 2, 3]]
    )


WORDS = st.sampled_from(
    ["1", "2.5", "-3e2", "nan", "inf", "1_0", "x", "#", ",", "0x1", "\x00", "é"]
)
LINES = st.lists(st.lists(WORDS, max_size=7).map(" ".join), max_size=6).map("\n".join)


@given(
    st.binary(max_size=200) | LINES.map(lambda text: text.encode("latin-1")),
    st.sampled_from([".xyz", ".ply"]),
)
@example(b"1 2 3\n1 2\n", ".xyz")
@settings(max_examples=300 * LONGER)
def test_anything_is_read_as_finite_points_or_refused_with_the_line(
    tmp_path_factory: pytest.TempPathFactory, content: bytes, suffix: str
) -> None:
    file = tmp_path_factory.getbasetemp() / f"any{suffix}"
    file.write_bytes(content)
    try:
        found = read_points(file).scan
    except DynmeshError as error:
        told = re.fullmatch(rf"{file}: (line (\d+): )?.*", str(error))
        assert told
        if suffix == ".xyz":
            assert content.splitlines()[int(told[2]) - 1].strip()
    else:
        assert np.isfinite(found.points).all()


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
    np.testing.assert_allclose(
        read.vertices[0][read.faces].reshape(-1, 3), corners, rtol=1e-6, atol=1e-6
    )
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
