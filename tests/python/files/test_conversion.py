"""Conversion to other axes and units, of sequences and point clouds, which replace older ones."""

from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import to_file
from commands import dynmesh_command as run
from sequences import contents, sea

import dynmesh
from dynmesh.scans import PointScan, read_points, write_ply

FIRST = 1001
ABOUT: Any = {"start": FIRST, "fps": 24.0, "up_axis": "z", "metres_per_unit": 0.01}
SCALED = sea(10, **ABOUT)
HOLED = sea(10, share=0.6, whole=[0, 2], **ABOUT)


@pytest.mark.parametrize(("one", "other"), list(product("xyz", "xyz")))
def test_a_turn_takes_one_axis_to_the_other(one: Any, other: Any) -> None:
    made = dynmesh.read(dynmesh.convert(replace(SCALED, up_axis=one), to_up=other))
    assert made.up_axis == other
    a, b = "xyz".index(one), "xyz".index(other)
    np.testing.assert_array_equal(made.vertices[..., b], SCALED.vertices[..., a])
    # A rotation keeps distances, and which side of a triangle is its front.
    frame, turned = (s.vertices[3][SCALED.faces[0]].astype(float) for s in (SCALED, made))
    before, after = (np.linalg.norm(np.diff(p, axis=0), axis=1) for p in (frame, turned))
    np.testing.assert_allclose(after, before, rtol=1e-6)
    assert np.linalg.det(turned) == pytest.approx(np.linalg.det(frame))
    back = dynmesh.read(dynmesh.convert(made, to_up=one))
    np.testing.assert_array_equal(back.vertices, SCALED.vertices)


def test_units_and_scale() -> None:
    made: Any = dynmesh.read(dynmesh.complete(HOLED, uncertainty=True))
    inches: Any = dynmesh.read(dynmesh.convert(made, to_unit="inch", scale=2))
    assert inches.metres_per_unit == 0.0254
    factor = 2 * 0.01 / 0.0254
    np.testing.assert_allclose(inches.vertices, factor * made.vertices, rtol=1e-6)
    np.testing.assert_allclose(inches.standard_error, factor * made.standard_error, rtol=1e-6)
    np.testing.assert_array_equal(inches.age, made.age)
    with pytest.raises(ValueError, match=r"scale: .*float32"):
        dynmesh.read(dynmesh.convert(made, scale=1e38))


@pytest.mark.parametrize("is_folder", [False, True])
def test_point_clouds_are_scaled_and_turned(tmp_path: Path, is_folder: bool) -> None:
    folder = tmp_path / "clouds"
    folder.mkdir()
    points = np.random.default_rng(0).random((20, 3))
    normals = np.tile([0.0, 0, 1], (20, 1))
    np.savetxt(folder / "a_7.xyz", np.hstack([points, normals]))
    if is_folder:
        np.savetxt(folder / "a_9.xyz", points[:5])
        np.savetxt(folder / "a_13.xyz", points[:5])
        with pytest.raises(ValueError, match=r"clouds: a_11\.xyz is missing"):
            to_file.convert(folder, tmp_path / "out")
        lost = to_file.convert(folder, tmp_path / "lost", source={"gaps": "lost"})
        assert lost.frames == 3
        (folder / "a_13.xyz").unlink()
        (folder / "cameras.json").write_text("[]")
    given, output = (
        (folder, tmp_path / "out") if is_folder else (folder / "a_7.xyz", tmp_path / "a.ply")
    )
    changes: dict[str, Any] = {"unit": "mm", "to_unit": "m", "up": "z", "to_up": "y"}
    report = to_file.convert(given, output, **changes)
    assert report.frames == 1 + is_folder
    assert any("cameras.json" in remark for remark in report.remarks) == is_folder
    found: Any = read_points(output / "a_7.ply" if is_folder else output)
    turned = points[:, [0, 2, 1]] * [1, 1, -1] / 1000
    np.testing.assert_allclose(found.scan.points, turned, atol=1e-12)
    np.testing.assert_allclose(found.scan.normals, np.tile([0.0, 1, 0], (20, 1)), atol=1e-12)
    assert (found.metadata.up_axis, found.metadata.metres_per_unit) == ("y", 1)
    if is_folder:
        assert sorted(file.name for file in output.iterdir()) == ["a_7.ply", "a_9.ply"]
    with pytest.raises(FileExistsError):
        to_file.convert(given, output, **changes)


def clouds(folder: Path, numbers: range, suffix: str = "xyz", size: float = 1) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    for number in numbers:
        points = np.random.default_rng(number).random((9, 3)) * size
        if suffix == "ply":
            write_ply(folder / f"a_{number}.ply", PointScan(points, None, None))
        else:
            np.savetxt(folder / f"a_{number}.{suffix}", points)
    return folder


@pytest.mark.parametrize("other", ["a_7.ply", "notes.txt", ".hidden", "a_0.ply/inner"])
def test_what_no_new_file_replaces_is_no_older_result(tmp_path: Path, other: str) -> None:
    """Otherwise files of two conversions would stand side by side, or another's would go."""
    source = clouds(tmp_path / "in", range(3))
    kept = tmp_path / "out" / other
    kept.parent.mkdir(parents=True)
    kept.write_text("mine")
    before = contents(tmp_path)
    assert (
        str(kept).removesuffix("/inner")
        in run("convert", source, tmp_path / "out", "--overwrite", code=1).stderr
    )
    assert contents(tmp_path) == before


@pytest.mark.parametrize("damaged", [0, 1, 2])
def test_a_failure_leaves_what_was_there(tmp_path: Path, damaged: int) -> None:
    source = clouds(tmp_path / "in", range(3), "ply")
    run("convert", source, tmp_path / "out")
    file = source / f"a_{damaged}.ply"
    file.write_bytes(file.read_bytes()[:-5])
    before = contents(tmp_path)
    for output in ("out", "new"):
        run("convert", source, tmp_path / output, "--scale", "2", "--overwrite", code=1)
        assert contents(tmp_path) == before


@pytest.mark.parametrize("output", ["in", "linked", "in/../in"])
def test_the_clouds_themselves_are_not_replaced(tmp_path: Path, output: str) -> None:
    source = clouds(tmp_path / "in", range(3), "ply")
    (tmp_path / "linked").symlink_to("in")
    before = contents(tmp_path)
    said = run("convert", source, f"{tmp_path}/{output}", "--scale", "2", "--overwrite", code=1)
    assert "is the input" in said.stderr
    said = run("convert", source / "a_0.ply", f"{tmp_path}/{output}/a_0.ply", "--overwrite", code=1)
    assert "is the input" in said.stderr
    assert contents(tmp_path) == before


def test_clouds_of_the_same_name_are_not_one(tmp_path: Path) -> None:
    for folder in ("left_1", "left_2", "left_3"):
        clouds(tmp_path / folder, range(1))
    said = run("convert", tmp_path / "left_*" / "a_0.xyz", tmp_path / "out", code=1).stderr
    assert "a_0.ply" in said
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("verb", ["convert", "degrade"])
def test_a_folder_in_which_one_stands_stays_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, verb: str
) -> None:
    clouds(tmp_path / "in", range(3))
    dynmesh.write(tmp_path / "body.npz", dynmesh.synth.ocean(3, grid=9))
    (tmp_path / "out").mkdir()
    monkeypatch.chdir(tmp_path / "out")
    words: list[Any] = (
        ["convert", "../in", "."]
        if verb == "convert"
        else ["degrade", "../body.npz", ".", "--scan", "--points", "20"]
    )
    for more in ([], ["--overwrite"]):
        run(*words, *more)
        assert len([*Path().glob("*.ply")]) == 3  # as seen from here
        assert contents(Path()).keys() == contents(tmp_path / "out").keys()
