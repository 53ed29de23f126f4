"""Several scans at a time, and what belongs to each of them."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from commands import dynmesh_command as run
from meshes import Array, Mesh
from scipy.spatial.transform import Rotation
from test_register_command import positions
from test_registration import scan
from test_tracking import bumpy_torus, error

import dynmesh
from dynmesh.scans import PointScan, write_ply

APART = 1000.0
"""Between two scans; landmarks of another one are far outside of a scan."""


@pytest.fixture
def torus() -> Mesh:
    return bumpy_torus(24)


@pytest.fixture
def truths(torus: Mesh, rng: np.random.Generator, tmp_path: Path) -> list[Array]:
    """Writes a template and the scans 1, 2 and 10, and returns the true positions."""
    turned = Rotation.from_euler("xyz", [2, 1, 0.5]).apply(torus.vertices)
    truths = [turned + np.array([APART * i, 0, 0]) for i in range(3)]
    dynmesh.write(tmp_path / "body.obj", dynmesh.Sequence(torus.vertices[None], torus.faces))
    (tmp_path / "scans").mkdir()
    for number, truth in zip((1, 2, 10), truths, strict=True):
        points, normals = scan(torus, truth, rng)
        write_ply(tmp_path / "scans" / f"scan_{number}.ply", PointScan(points, normals, None))
    return truths


def spoil(scans: Path) -> None:
    """Cuts the first scan, and leaves two points of the last one."""
    (scans / "scan_1.ply").write_bytes((scans / "scan_1.ply").read_bytes()[:300])
    write_ply(scans / "scan_10.ply", PointScan(np.eye(3)[:2], None, None))


def test_a_scan_that_fails_stops_no_other(torus: Mesh, truths: list[Array], tmp_path: Path) -> None:
    spoil(tmp_path / "scans")
    beside = ("--report", tmp_path / "report.json", "--page", tmp_path / "page.html")
    words = ("register", tmp_path / "body.obj", tmp_path / "scans", tmp_path / "made", *beside)
    *_, first, _, last, counts, _ = run(*words, code=1).stderr.splitlines()
    assert "scan_1.ply: is cut or damaged" in first
    assert "scan_10.ply: points: there are 2" in last
    assert counts.endswith("2 failed, 1 good")
    assert [path.name for path in (tmp_path / "made").iterdir()] == ["scan_2.obj"]
    assert error(torus, truths[1], positions(tmp_path / "made" / "scan_2.obj")) < 0.5
    told = json.loads((tmp_path / "report.json").read_text())
    assert [one["quality"] for one in told.values()] == ["failed", "good", "failed"]
    assert "there are 2" in told[str(tmp_path / "scans" / "scan_10.ply")]["reason"]
    page = (tmp_path / "page.html").read_text()
    assert "scan_2.ply: good" in page
    assert "scan_1.ply" not in page


@pytest.mark.usefixtures("truths")
def test_a_function_and_a_table_name_the_scans_that_failed(tmp_path: Path) -> None:
    spoil(tmp_path / "scans")
    template, scans = tmp_path / "body.obj", tmp_path / "scans"
    report = dynmesh.register_file(template, scans, tmp_path / "made")
    assert report.quality == "failed"
    assert [one.scan.stem for one in report.scans if one.found is None] == ["scan_1", "scan_10"]
    assert [*report] == [tmp_path / "made" / "scan_2.obj"]
    assert report[tmp_path / "made" / "scan_2.obj"].quality == "good"
    (tmp_path / "jobs.csv").write_text("scan,template,output\nscans,body.obj,again\n")
    (result,) = dynmesh.batch(tmp_path / "jobs.csv").results
    assert (result.status, result.reason) == ("failed", report.reason)
    assert (tmp_path / "again" / "scan_2.obj").exists()


@pytest.mark.usefixtures("truths")
def test_a_page_of_nothing_is_not_made(tmp_path: Path) -> None:
    spoil(tmp_path / "scans")
    (tmp_path / "scans" / "scan_2.ply").unlink()
    words = ("register", tmp_path / "body.obj", tmp_path / "scans", tmp_path / "made")
    said = run(*words, "--page", tmp_path / "page.html", code=1).stderr
    assert "2 failed\n" in said
    assert not (tmp_path / "page.html").exists()


@pytest.mark.parametrize("pattern", ["", "*.ply", "scan_%d.ply"])
def test_a_folder_or_a_pattern_of_scans(
    pattern: str, torus: Mesh, truths: list[Array], tmp_path: Path
) -> None:
    """They are in the order of their numbers, of which some may be missing."""
    (tmp_path / "scans" / "notes.txt").write_text("the second one is best")
    made, report = tmp_path / "made", tmp_path / "report.json"
    words = ("register", tmp_path / "body.obj", tmp_path / "scans" / pattern, made)
    run(*words, "--report", report)
    names = ["scan_1", "scan_2", "scan_10"]
    told = json.loads(report.read_text())
    assert [*told] == [str(tmp_path / "scans" / f"{name}.ply") for name in names]
    assert {path.stem for path in made.iterdir()} == {*names}
    for name, truth in zip(names, truths, strict=True):
        assert error(torus, truth, positions(made / f"{name}.obj")) < 0.5


def test_a_pattern_of_depth_images(torus: Mesh, tmp_path: Path) -> None:
    """One image is missing, and so is a frame before the last one."""
    four = np.repeat(torus.vertices[None], 4, axis=0)
    dynmesh.write(tmp_path / "four.npz", dynmesh.Sequence(four, torus.faces, start=7))
    dynmesh.write(tmp_path / "body.obj", dynmesh.Sequence(four[:1], torus.faces))
    depth, made = tmp_path / "depth", tmp_path / "made"
    run("degrade", tmp_path / "four.npz", depth, "--depth", "160x120", "--up", "z")
    for lost in (*depth.glob("depth_00009_*"), depth / "depth_00010_1.png"):
        lost.unlink()
    words = ("register", tmp_path / "body.obj", depth / "*.png", made)
    said = run(*words, "--page", tmp_path / "page.html").stderr
    assert "depth images are missing or damaged: frame_00010 (1)\n" in said
    numbers = (7, 8, 10)
    assert sorted(path.stem for path in made.iterdir()) == [f"frame_{n:05d}" for n in numbers]
    for number in numbers:
        assert f"frame_{number:05d}: good" in (tmp_path / "page.html").read_text()


def marks_of(truth: Array) -> str:
    """The text of a file of landmarks."""
    vertices = (5, 120, 260, 400)
    return json.dumps([{"vertex": v, "position": truth[v].tolist()} for v in vertices])


def test_a_folder_of_landmarks_has_those_of_each_scan(
    torus: Mesh, truths: list[Array], tmp_path: Path
) -> None:
    marks = tmp_path / "marks"
    marks.mkdir()
    (marks / "cameras.json").write_text("{}")
    for name, truth in zip(("scan_1", "scan_10"), truths[::2], strict=True):
        (marks / f"{name}.json").write_text(marks_of(truth))
    words = ("register", tmp_path / "body.obj", tmp_path / "scans", tmp_path / "made")
    assert f"1 of 3 scans had no landmarks in {marks}" in run(*words, "--landmarks", marks).stderr
    assert error(torus, truths[2], positions(tmp_path / "made" / "scan_10.obj")) < 0.5
    (marks / "scan_2.json").write_text((marks / "scan_1.json").read_text())
    again = run(*words, "--landmarks", marks, "--overwrite", code=1).stderr
    assert "scan_2.ply: landmarks" in again
    assert "2 good, 1 failed" in again


def test_one_file_of_landmarks_is_for_all_scans(truths: list[Array], tmp_path: Path) -> None:
    for number in (2, 10):
        path = tmp_path / "scans" / f"scan_{number}.ply"
        path.write_bytes((tmp_path / "scans" / "scan_1.ply").read_bytes())
    (tmp_path / "marks.json").write_text(marks_of(truths[0]))
    words = ("register", tmp_path / "body.obj", tmp_path / "scans", tmp_path / "made")
    said = run(*words, "--landmarks", tmp_path / "marks.json").stderr
    assert f"{tmp_path / 'marks.json'} were used for all 3 scans" in said


@pytest.mark.usefixtures("truths")
def test_formats_are_not_asked_for_by_options_that_do_not_exist(tmp_path: Path) -> None:
    (tmp_path / "body").write_bytes((tmp_path / "body.obj").read_bytes())
    body, one = tmp_path / "body.obj", tmp_path / "scans" / "scan_1.ply"
    track = ("track", tmp_path / "scans", tmp_path / "out.npz", "--template", tmp_path / "body")
    for words in (
        ("register", tmp_path / "body", one, tmp_path / "out.obj"),
        ("register", body, tmp_path / "body", tmp_path / "out.obj"),
        ("register", body, one, tmp_path / "out"),
        track,
    ):
        assert "format=" not in (said := run(*words, code=1).stderr)
        assert "-format" not in said
        assert "format" in said


def test_a_scan_in_another_unit_is_told(torus: Mesh, truths: list[Array], tmp_path: Path) -> None:
    """The unit of the scan is no power of ten of that of the template; the advice is followed."""
    small = dynmesh.Sequence(0.6 * truths[0][None], torus.faces)
    dynmesh.write(tmp_path / "small.obj", small)
    words = ("register", tmp_path / "body.obj", tmp_path / "small.obj", tmp_path / "made.obj")
    said = run(*words, "--scale", code=3).stderr
    told = re.search(r"the result is (\S+) times as large as the template", said)
    assert told is not None
    assert 0.56 < float(told[1]) < 0.64
    assert "another pose" not in said
    run("convert", tmp_path / "body.obj", tmp_path / "template.obj", "--scale", told[1])
    run("register", tmp_path / "template.obj", *words[2:], "--overwrite")
    dynmesh.write(tmp_path / "small.obj", dynmesh.Sequence(10 * truths[0][None], torus.faces))
    said = run(*words, "--overwrite", code=3).stderr
    assert re.search(r"the scan is (9.|10) times as large as the template: give scale", said), said
    run(*words, "--scale", "--overwrite")
