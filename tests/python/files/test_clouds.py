"""Conversion of point clouds: what it takes, and that an older result is replaced whole or not."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import dynmesh_command as run

from dynmesh.scans import PointScan, read_points, write_ply


def clouds(folder: Path, numbers: range, suffix: str = "xyz", size: float = 1) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    for number in numbers:
        points = np.random.default_rng(number).random((9, 3)) * size
        if suffix == "ply":
            write_ply(folder / f"a_{number}.ply", PointScan(points, None, None))
        else:
            np.savetxt(folder / f"a_{number}.{suffix}", points)
    return folder


def contents(folder: Path) -> dict[str, bytes]:
    found = (file for file in folder.rglob("*") if file.is_file())
    return {str(file.relative_to(folder)): file.read_bytes() for file in found}


def test_an_older_result_is_replaced_as_a_whole(tmp_path: Path) -> None:
    source = clouds(tmp_path / "in", range(3))
    words = ("convert", source, tmp_path / "out", "--scale")
    run(*words, "1")
    before = contents(tmp_path / "out")
    assert "exists already" in run(*words, "2", code=1).stderr
    assert contents(tmp_path / "out") == before
    run(*words, "2", "--overwrite")
    assert contents(tmp_path / "out").keys() == before.keys()
    doubled, once = (
        read_points(tmp_path / at / f"a_1.{of}").scan.points
        for at, of in (("out", "ply"), ("in", "xyz"))
    )
    np.testing.assert_allclose(doubled, 2 * once)


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
    import dynmesh

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
