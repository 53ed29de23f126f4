"""The command `dynmesh register`: its scans, pages, landmarks, units and messages."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from browser import Page, in_colour
from commands import dynmesh_command as run
from meshes import Array
from scans_of_meshes import TORUS, error, scan
from scipy.spatial.transform import Rotation

import dynmesh
from dynmesh.draw.figures import View
from dynmesh.scans import PointScan, write_ply
from dynmesh.tracking.inputs import open_single, read_landmarks


def written(folder: Path, rng: np.random.Generator) -> Array:
    """Writes a template and scans, and returns the true positions."""
    truth = Rotation.from_euler("xyz", [2, 1, 0.5]).apply(TORUS.vertices)
    dynmesh.write(folder / "body.obj", dynmesh.Sequence(TORUS.vertices[None], TORUS.faces))
    (folder / "scans").mkdir()
    points, normals = scan(TORUS, truth, rng)
    write_ply(folder / "scans" / "first.ply", PointScan(points, normals, None))
    mesh = dynmesh.Sequence(truth[None], TORUS.faces)
    dynmesh.write(folder / "scans" / "second.obj", mesh)
    return truth


def positions(path: Path) -> Array:
    return np.asarray(dynmesh.read(path).vertices[0], np.float64)


@pytest.mark.parametrize("name", ["first.ply", "second.obj", "third.stl", "fourth.glb"])
def test_a_scan_of_any_format(name: str, rng: np.random.Generator, tmp_path: Path) -> None:
    """A point cloud, or a mesh whose vertices are the points; the template keeps its materials."""
    truth = written(tmp_path, rng)
    body, scan_file, made = tmp_path / "body.obj", tmp_path / "scans" / name, tmp_path / "made.obj"
    body.write_text("usemtl skin\n" + body.read_text())
    is_model = not scan_file.exists()
    if is_model:
        trimesh.Trimesh(truth, TORUS.faces, process=False).export(scan_file)
    told = json.loads(run("register", body, scan_file, made, "--json").stdout)
    assert told["quality"] == "good"
    assert "usemtl skin" in made.read_text()
    assert error(TORUS, truth, positions(made)) < 0.5
    if is_model:
        scan_file.write_bytes(scan_file.read_bytes()[:100])
        refused = run("register", body, scan_file, made, "--overwrite", code=1).stderr
        assert f"{name}: cannot be read as {name[-3:].upper()}" in refused


@pytest.mark.parametrize("suffix", ["obj", "ply"])
def test_meshes_as_scans_have_the_normals_of_their_faces(tmp_path: Path, suffix: str) -> None:
    dynmesh.write(tmp_path / f"scan.{suffix}", dynmesh.Sequence(TORUS.vertices[None], TORUS.faces))
    (scan,) = open_single(tmp_path / f"scan.{suffix}", None).frames()
    assert isinstance(scan, PointScan)
    assert scan.normals is not None
    corners = TORUS.vertices[TORUS.faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    of_faces = across / np.linalg.norm(across, axis=1, keepdims=True)
    assert ((scan.normals[TORUS.faces[:, 0]] * of_faces).sum(axis=1) > 0.7).all()


def test_depth_images_of_one_moment_are_one_scan(tmp_path: Path) -> None:
    turned = Rotation.from_euler("xyz", [2, 1, 0.5]).apply(TORUS.vertices)
    truth = np.stack([TORUS.vertices, turned])
    dynmesh.write(tmp_path / "truth.npz", dynmesh.Sequence(truth, TORUS.faces, start=7))
    dynmesh.write(tmp_path / "body.obj", dynmesh.Sequence(truth[:1], TORUS.faces))
    depth, made = tmp_path / "depth", tmp_path / "made.obj"
    size = ("--depth", "160x120", "--cameras", "4", "--up", "z")
    run("degrade", tmp_path / "truth.npz", depth, *size)
    words = ("register", tmp_path / "body.obj", depth / "depth_00008_*.png", made)
    run(*words)
    assert error(TORUS, turned, positions(made)) < 0.5
    assert "holds 2 scans" in run(*words[:2], depth, tmp_path / "two.obj", code=1).stderr
    (depth / "depth_00008_1.png").unlink()
    assert "no image of camera '1' for frame 8" in run(*words, "--overwrite").stderr
    (depth / "cameras.json").rename(tmp_path / "rig.json")
    refused = run(*words, "--overwrite", code=2).stderr
    assert "depth images need cameras" in refused
    run(*words, "--overwrite", "--cameras", tmp_path / "rig.json")


def test_the_page(rng: np.random.Generator, tmp_path: Path, browser: Any) -> None:
    """A template that is elsewhere and in another unit, in its scan and one of something else."""
    written(tmp_path, rng)
    template = TORUS.vertices / 1000 + [50, 0, 0]
    dynmesh.write(tmp_path / "body.obj", dynmesh.Sequence(template[None], TORUS.faces))
    wrong = rng.normal(size=(400, 3)) * np.ptp(TORUS.vertices, axis=0) / 3
    write_ply(tmp_path / "scans" / "wrong.ply", PointScan(wrong, None, None))
    yellow = []
    for name, quality in (("first", "good"), ("wrong", "ruined")):
        files = tmp_path / "body.obj", tmp_path / "scans" / f"{name}.ply", tmp_path / f"{name}.obj"
        html, code = tmp_path / f"{name}.html", 0 if quality == "good" else 3
        run("register", *files, "--scale", "--page", html, code=code)
        page = Page(browser, html)
        captions = [f"scan: {name}.ply", "body.obj, registered"]
        assert page.captions() == captions
        assert page.text("title").split()[0] == "distance"
        pictures = page.pictures(0, 1)
        areas = [in_colour(pixels).mean() for pixels in pictures]
        assert min(areas) > 0.005
        _, green, blue = pictures[1][in_colour(pictures[1])].mean(axis=0)
        yellow.append(green - blue)
        assert page.complaints == []
    assert yellow[1] > yellow[0] + 10


def seen(points: Array, width: float, height: float) -> Array:
    """Where a page shows points at first, in pixels, and how far in front, (n, 3)."""
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    x, y, z = View.of(points, "z", 60.0).axes @ ((points - middle) / np.ptp(points, axis=0).max()).T
    scale = height / 2 / (0.7 * max(1, height / width) - z * np.tan(np.radians(15)))
    return np.stack([width / 2 + scale * x, height / 2 - scale * y, z], axis=1)


def test_landmarks_are_picked_by_clicks(tmp_path: Path, browser: Any) -> None:
    dynmesh.write(tmp_path / "body.obj", dynmesh.Sequence(TORUS.vertices[None], TORUS.faces))
    scanned = 1000 * TORUS.vertices + 7
    write_ply(tmp_path / "cloud.ply", PointScan(scanned, None, None))
    html = tmp_path / "pick.html"
    words = ("view", tmp_path / "body.obj", "--scans", tmp_path / "cloud.ply", "-o", html)
    run(*words, "--pick", "marks.json", "--up", "z")
    shown = Page(browser, html, "#dynmesh-pairs[data-ready]")
    page = shown.page

    def click(side: str, points: Array, index: int) -> None:
        box = page.locator(f"#dynmesh-{side}").bounding_box()
        x, y, _ = seen(points, box["width"], box["height"])[index]
        page.mouse.click(box["x"] + x, box["y"] + y)

    front = np.argsort(-seen(TORUS.vertices, 1, 1)[:, 2])[:40]
    vertices = front[[0, 13, 26, 39]]
    assert page.is_disabled("#dynmesh-save")
    for vertex in vertices:
        click("template", TORUS.vertices, front[20])  # and then another choice
        click("template", TORUS.vertices, vertex)
        click("scan", scanned, vertex)
    click("template", TORUS.vertices, front[20])
    page.mouse.move(200, 200)  # which turns the view and picks nothing
    page.mouse.down()
    page.mouse.move(240, 210, steps=3)
    page.mouse.up()
    assert page.locator("#dynmesh-pairs tr").count() == 5
    page.click("#dynmesh-undo")
    with page.expect_download() as download:
        page.click("#dynmesh-save")
    assert download.value.suggested_filename == "marks.json"
    download.value.save_as(tmp_path / "marks.json")
    made_of, positions_of = read_landmarks(tmp_path / "marks.json")
    np.testing.assert_array_equal(made_of, vertices)
    np.testing.assert_allclose(positions_of, scanned[vertices], rtol=1e-5)
    assert shown.complaints == []
    files = tmp_path / "body.obj", tmp_path / "cloud.ply", tmp_path / "made.obj"
    run("register", *files, "--scale", "--landmarks", tmp_path / "marks.json")
    assert error(TORUS, TORUS.vertices, (positions(tmp_path / "made.obj") - 7) / 1000) < 0.3


def test_a_template_in_inches_and_a_scan_in_metres(
    rng: np.random.Generator, tmp_path: Path
) -> None:
    """A vertex without faces does not count in the size."""
    truth = written(tmp_path, rng)
    inches = np.concatenate([TORUS.vertices / 0.0254, [[1e5, 0, 0]]])
    dynmesh.write(tmp_path / "body.obj", dynmesh.Sequence(inches[None], TORUS.faces))
    words = ("register", tmp_path / "body.obj", tmp_path / "scans" / "first.ply")
    said = run(*words, tmp_path / "none.obj", code=1).stderr
    assert len(re.findall(r" 0\.02\d* times as large as the template", said)) == 1
    assert said.count(" times as large") == 1
    assert "--template-unit and --scan-unit state units" in said
    units = ("--template-unit", "inch", "--scan-unit", "m")
    run(*words, tmp_path / "made.obj", *units)
    made = dynmesh.read(tmp_path / "made.obj")
    assert error(TORUS, truth, np.asarray(made.vertices[0, :-1], np.float64)) < 0.5
    assert made.metres_per_unit == 1


def test_a_wrong_scan_ends_with_code_3_and_its_cause(
    rng: np.random.Generator, tmp_path: Path
) -> None:
    points, normals = scan(TORUS, written(tmp_path, rng), rng, 1000)
    size = np.ptp(TORUS.vertices, axis=0).max()
    part = points[:, 0] < np.quantile(points[:, 0], 0.25)
    marks = [{"vertex": v, "position": list(TORUS.vertices[v] + size)} for v in (5, 120, 260)]
    (tmp_path / "marks.json").write_text(json.dumps(marks))
    landmarks = ("--landmarks", tmp_path / "marks.json")
    wrong: list[tuple[str, PointScan, list[str]]] = [
        ("landmarks say where", PointScan(2 * rng.normal(size=(1000, 3)), None, None), []),
        ("; the normals of the scan point inwards", PointScan(points, -normals, None), []),
        (" times as large as the template", PointScan(points / 6, normals, None), []),
        ("to fit, .*; the diagonal of the scan is ", PointScan(points / 1.8, normals, None), []),
        ("", PointScan(points[part], normals[part], None), []),
        ("", PointScan(points + 9 * size, normals, None), ["--no-align"]),
    ]
    made = tmp_path / "made.obj"
    for cause, one, options in wrong:
        write_ply(tmp_path / "wrong.ply", one)
        words = (tmp_path / "body.obj", tmp_path / "wrong.ply", made)
        said = run("register", *words, *options, "--overwrite", code=3).stderr
        assert re.search("made.obj: (doubtful|ruined): ", said)
        assert re.search(cause, said)
        assert said.count(" times as large") <= 1
        assert made.exists()
    (tmp_path / "marks.json").write_text(json.dumps([marks[0] | {"vertex": 99999}]))
    said = run("register", *words, *landmarks, "--overwrite", code=1).stderr
    assert "marks.json: landmarks: landmark 0 is of vertex 99999" in said


def test_a_landmark_that_contradicts_the_scan_is_named(
    rng: np.random.Generator, tmp_path: Path
) -> None:
    pairs = [(5, 5), (60, 60), (120, 120), (260, 260), (330, 330), (400, 130)]
    truth = written(tmp_path, rng)
    marks = [{"vertex": vertex, "position": truth[other].tolist()} for vertex, other in pairs]
    (tmp_path / "marks.json").write_text(json.dumps(marks))
    words = (tmp_path / "body.obj", tmp_path / "scans" / "first.ply", tmp_path / "made.obj")
    said = run("register", *words, "--landmarks", tmp_path / "marks.json", code=3).stderr
    assert re.search("(doubtful|ruined): .*; vertex 400 lies ", said)
