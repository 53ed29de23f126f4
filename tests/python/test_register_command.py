"""The command that registers a mesh with scans."""

import csv
import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from browser import Page, in_colour
from commands import dynmesh_command as run
from conftest import REPOSITORY
from meshes import Array, Mesh
from scipy.spatial.transform import Rotation
from test_registration import scan
from test_tracking import bumpy_torus, error

import dynmesh
from dynmesh.scans import PointScan, write_ply
from dynmesh.tracking.landmarks import read_landmarks
from dynmesh.tracking.single_scans import open_single


@pytest.fixture
def torus() -> Mesh:
    return bumpy_torus(24)


def written(folder: Path, torus: Mesh, rng: np.random.Generator) -> Array:
    """Writes a template and scans, and returns the true positions."""
    truth = Rotation.from_euler("xyz", [2, 1, 0.5]).apply(torus.vertices)
    dynmesh.write(folder / "body.obj", dynmesh.Sequence(torus.vertices[None], torus.faces))
    (folder / "scans").mkdir()
    points, normals = scan(torus, truth, rng)
    write_ply(folder / "scans" / "first.ply", PointScan(points, normals, None))
    mesh = dynmesh.Sequence(truth[None], torus.faces)
    dynmesh.write(folder / "scans" / "second.obj", mesh)
    return truth


def positions(path: Path) -> Array:
    return np.asarray(dynmesh.read(path).vertices[0], np.float64)


def test_a_folder_of_scans(torus: Mesh, rng: np.random.Generator, tmp_path: Path) -> None:
    """A point cloud, and a mesh whose vertices are the points."""
    truth = written(tmp_path, torus, rng)
    report, made = tmp_path / "report.json", tmp_path / "made"
    run("register", tmp_path / "body.obj", tmp_path / "scans", made, "--report", report)
    for name in ("first.obj", "second.obj"):
        assert error(torus, truth, positions(made / name)) < 0.5
    told = json.loads(report.read_text())
    assert [one["quality"] for one in told.values()] == ["good", "good"]
    run("register", tmp_path / "body.obj", tmp_path / "scans", made, code=1)


@pytest.mark.parametrize("suffix", ["obj", "ply"])
def test_meshes_as_scans_have_the_normals_of_their_faces(
    torus: Mesh, tmp_path: Path, suffix: str
) -> None:
    dynmesh.write(tmp_path / f"scan.{suffix}", dynmesh.Sequence(torus.vertices[None], torus.faces))
    (scan,) = open_single(tmp_path / f"scan.{suffix}", None).frames()
    assert isinstance(scan, PointScan)
    assert scan.normals is not None
    corners = torus.vertices[torus.faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    of_faces = across / np.linalg.norm(across, axis=1, keepdims=True)
    assert ((scan.normals[torus.faces[:, 0]] * of_faces).sum(axis=1) > 0.7).all()


def test_depth_images_of_one_moment_are_one_scan(torus: Mesh, tmp_path: Path) -> None:
    turned = Rotation.from_euler("xyz", [2, 1, 0.5]).apply(torus.vertices)
    truth = np.stack([torus.vertices, turned])
    dynmesh.write(tmp_path / "truth.npz", dynmesh.Sequence(truth, torus.faces, start=7))
    dynmesh.write(tmp_path / "body.obj", dynmesh.Sequence(truth[:1], torus.faces))
    depth, made = tmp_path / "depth", tmp_path / "made"
    size = ("--depth", "160x120", "--cameras", "4", "--up", "z")
    run("degrade", tmp_path / "truth.npz", depth, *size)
    run("register", tmp_path / "body.obj", depth, made)
    assert sorted(path.name for path in made.iterdir()) == ["frame_00007.obj", "frame_00008.obj"]
    assert error(torus, turned, positions(made / "frame_00008.obj")) < 0.5
    (depth / "cameras.json").rename(tmp_path / "rig.json")
    refused = run("register", tmp_path / "body.obj", depth, made, "--overwrite", code=1).stderr
    assert "depth images need cameras" in refused
    one = (tmp_path / "body.obj", depth / "depth_00007_0.png", tmp_path / "one.obj")
    assert "depth_00007_0.png: is a single depth image" in run("register", *one, code=1).stderr
    with_cameras = ("--overwrite", "--cameras", tmp_path / "rig.json")
    run("register", tmp_path / "body.obj", depth, made, *with_cameras)


def test_the_page(torus: Mesh, rng: np.random.Generator, tmp_path: Path, browser: Any) -> None:
    """A template that is elsewhere and in another unit, a scan, and a scan of something else."""
    written(tmp_path, torus, rng)
    template = torus.vertices / 1000 + [50, 0, 0]
    dynmesh.write(tmp_path / "body.obj", dynmesh.Sequence(template[None], torus.faces))
    (tmp_path / "scans" / "second.obj").unlink()
    wrong = rng.normal(size=(2000, 3)) * np.ptp(torus.vertices, axis=0) / 3
    write_ply(tmp_path / "scans" / "second.ply", PointScan(wrong, None, None))
    words = ("register", tmp_path / "body.obj", tmp_path / "scans", tmp_path / "made", "--scale")
    run(*words, "--page", tmp_path / "page.html", code=3)
    page = Page(browser, tmp_path / "page.html")
    assert page.captions() == ["body.obj, the template", "the scans", "made"]
    assert page.text("title").split()[0] == "distance"
    areas, yellow = [], []
    for frame, name in enumerate(("first.ply: good", "second.ply: ruined")):
        page.scrub(frame)
        assert page.text("counter") == name
        pictures = page.pictures(0, 1, 2)
        areas.append([in_colour(pixels).mean() for pixels in pictures])
        _, green, blue = pictures[2][in_colour(pictures[2])].mean(axis=0)
        yellow.append(green - blue)
    assert np.min(areas) > 0.005
    assert 0.5 < areas[0][0] / areas[0][2] < 2  # it is not turned
    assert yellow[1] > yellow[0] + 10
    assert page.complaints == []


@pytest.mark.parametrize("suffix", ["stl", "glb"])
def test_scans_of_other_formats(
    suffix: str, torus: Mesh, rng: np.random.Generator, tmp_path: Path
) -> None:
    truth = written(tmp_path, torus, rng)
    scan_file, made = tmp_path / f"scan.{suffix}", tmp_path / "made.obj"
    trimesh.Trimesh(truth, torus.faces, process=False).export(scan_file)
    body = tmp_path / "body.obj"
    body.write_text("usemtl skin\n" + body.read_text())
    run("register", body, scan_file, made)
    assert "usemtl skin" in made.read_text()
    assert error(torus, truth, positions(made)) < 0.5
    scan_file.write_bytes(scan_file.read_bytes()[:100])
    refused = run("register", tmp_path / "body.obj", scan_file, made, "--overwrite", code=1).stderr
    assert f"scan.{suffix}: cannot be read as {suffix.upper()}" in refused


def test_landmarks_of_a_file(torus: Mesh, rng: np.random.Generator, tmp_path: Path) -> None:
    truth = written(tmp_path, torus, rng)
    marks = [
        {"vertex": vertex, "position": truth[vertex].tolist()} for vertex in (5, 120, 260, 400)
    ]
    (tmp_path / "marks.json").write_text(json.dumps(marks))
    scanned, made = tmp_path / "scans" / "first.ply", tmp_path / "made.obj"
    words = ("register", tmp_path / "body.obj", scanned, made)
    run(*words, "--landmarks", tmp_path / "marks.json")
    assert error(torus, truth, positions(made)) < 0.3


PICKED = """<!DOCTYPE PickedPoints>
<PickedPoints>
 <DocumentData><DataFileName name="body.obj"/></DocumentData>
 {}
 <point x="9" y="9" z="9" active="0" name="off"/>
</PickedPoints>
"""


def test_landmarks_picked_in_viewers(torus: Mesh, rng: np.random.Generator, tmp_path: Path) -> None:
    """Of MeshLab on the template, a little beside the vertices, and of CloudCompare on the scan."""
    truth = written(tmp_path, torus, rng)
    vertices = [5, 120, 260, 400]
    beside = torus.vertices[vertices] + 1e-3
    points = [
        f'<point z="{z}" y="{y}" x="{x}" active="1" name="{n}"/>'
        for n, (x, y, z) in enumerate(beside)
    ]
    (tmp_path / "body.pp").write_text(PICKED.format("\n ".join(points)))
    listed = [f"{n},{x},{y},{z}" for n, (x, y, z) in enumerate(truth[vertices])]
    (tmp_path / "scan.txt").write_text("\n".join([*listed, ""]))
    script = REPOSITORY / "examples" / "python" / "landmarks.py"
    words = [sys.executable, str(script), "body.obj", "body.pp", "scan.txt", "marks.json"]
    subprocess.run(words, cwd=tmp_path, check=True)
    made_of, positions_of = read_landmarks(tmp_path / "marks.json")
    np.testing.assert_array_equal(made_of, vertices)
    np.testing.assert_array_equal(positions_of, truth[vertices])
    (tmp_path / "scan.txt").write_text("\n".join(listed[1:]))
    ended = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ended.stderr == "body.pp has 4 points, but scan.txt has 3\n"
    assert ended.returncode == 1


def test_a_wrong_scan_ends_with_code_3(
    torus: Mesh, rng: np.random.Generator, tmp_path: Path
) -> None:
    written(tmp_path, torus, rng)
    wrong = rng.normal(size=(1000, 3))
    write_ply(tmp_path / "wrong.ply", PointScan(2 * wrong, None, None))
    words = (tmp_path / "body.obj", tmp_path / "wrong.ply", tmp_path / "made.obj")
    said = run("register", *words, code=3).stderr
    assert "made.obj: ruined: " in said
    assert "landmarks say where" in said
    assert (tmp_path / "made.obj").exists()


def test_landmarks_that_contradict_the_scan(
    torus: Mesh, rng: np.random.Generator, tmp_path: Path
) -> None:
    truth = written(tmp_path, torus, rng)
    marks = [
        {"vertex": vertex, "position": truth[other].tolist()}
        for vertex, other in ((5, 5), (60, 60), (120, 120), (260, 260), (330, 330), (400, 130))
    ]
    (tmp_path / "marks.json").write_text(json.dumps(marks))
    words = (tmp_path / "body.obj", tmp_path / "scans" / "first.ply", tmp_path / "made.obj")
    said = run("register", *words, "--landmarks", tmp_path / "marks.json", code=3).stderr
    named = re.search(r"look at the landmarks: vertex (\d+) ", said)
    assert named is not None
    assert named[1] == "400"


def test_lines_of_a_table_are_registered(
    torus: Mesh, rng: np.random.Generator, tmp_path: Path
) -> None:
    """One scan, a folder of which one shows something else, and a scan that does not exist."""
    truth = written(tmp_path, torus, rng)
    wrong = rng.normal(size=(1000, 3))
    write_ply(tmp_path / "scans" / "wrong.ply", PointScan(2 * wrong, None, None))
    table, report = tmp_path / "jobs.csv", tmp_path / "report.csv"
    table.write_text(
        "scan,output,template,threads,scale\n"
        "scans/first.ply,new/one.obj,body.obj,2,yes\n"
        "scans,made,body.obj,,\n"
        "no.ply,none.obj,body.obj,,\n"
    )
    said = run("batch", table, "--report", report, code=1).stderr
    assert "1 done, 1 doubtful, 0 already complete, 1 failed of 3 jobs" in said
    with report.open(newline="") as file:
        lines = sorted(csv.DictReader(file), key=lambda line: line["status"])
    assert [(line["status"], line["frames"]) for line in lines] == [
        ("done", "1"),
        ("doubtful", "3"),
        ("failed", "0"),
    ]
    assert "ruined: " in lines[1]["reason"]
    assert error(torus, truth, positions(tmp_path / "new" / "one.obj")) < 0.5
    table.write_text("".join(table.read_text().splitlines(keepends=True)[:3]))
    assert "0 done, 2 already complete, 0 failed" in run("batch", table).stderr
    (tmp_path / "made" / "second.obj").unlink()
    assert "exists, but others do not" in run("batch", table, code=1).stderr
    run("batch", table, "--overwrite", code=3)
    assert (tmp_path / "made" / "second.obj").exists()
