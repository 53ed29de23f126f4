"""The command that registers a mesh with scans."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import dynmesh_command as run
from meshes import Array, Mesh
from scipy.spatial.transform import Rotation
from test_registration import scan
from test_tracking import bumpy_torus, error

import dynmesh
from dynmesh.files.scans import PointScan, write_ply


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
    mesh = dynmesh.Sequence(points[None, :2000], torus.faces)
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


@pytest.mark.parametrize(
    ("content", "why"),
    [
        ("{", "is not JSON"),
        ("[]", "at least one"),
        ('[{"vertex": 3}]', "landmark 0 must have"),
        ('[{"vertex": 0.5, "position": [1, 2, 3]}]', "landmark 0: the vertex"),
        ('[{"vertex": 5, "position": [1, 2]}]', "landmark 0: the position"),
        ('[{"vertex": 577, "position": [1, 2, 3]}]', "vertex 577"),
    ],
)
def test_damaged_landmarks(
    content: str, why: str, torus: Mesh, rng: np.random.Generator, tmp_path: Path
) -> None:
    written(tmp_path, torus, rng)
    (tmp_path / "marks.json").write_text(content)
    words: Any = (tmp_path / "body.obj", tmp_path / "scans" / "first.ply", tmp_path / "made.obj")
    said = run("register", *words, "--landmarks", tmp_path / "marks.json", code=1).stderr
    assert why in said
    assert not (tmp_path / "made.obj").exists()


def test_a_wrong_scan_ends_with_code_3(
    torus: Mesh, rng: np.random.Generator, tmp_path: Path
) -> None:
    written(tmp_path, torus, rng)
    wrong = rng.normal(size=(1000, 3))
    write_ply(tmp_path / "wrong.ply", PointScan(2 * wrong, None, None))
    words = (tmp_path / "body.obj", tmp_path / "wrong.ply", tmp_path / "made.obj")
    said = run("register", *words, code=3).stderr
    assert "made.obj: ruined: " in said
    assert (tmp_path / "made.obj").exists()
