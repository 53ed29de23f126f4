"""What users may rely on in every command: folders, patterns, space, kept frames and quiet."""

import shutil
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from commands import dynmesh_command as run

import dynmesh
from dynmesh.files.numbered import FrameNames

N = 6


@pytest.fixture(scope="module")
def truth() -> dynmesh.Sequence:
    return dynmesh.synth.ocean(N, grid=10, seed=3)


@pytest.fixture
def folder(tmp_path: Path, truth: dynmesh.Sequence) -> Path:
    known = np.random.default_rng(5).random((N, 100)) < 0.6
    known[0] = True
    dynmesh.write(tmp_path / "truth.npz", truth)
    dynmesh.write(tmp_path / "partial.npz", replace(truth, known=known))
    dynmesh.write(tmp_path / "body.obj", truth[:1])
    return tmp_path


WRITING: dict[str, str] = {
    "a.npz": "synth ocean {} --frames 2",
    "b.obj": "convert body.obj {}",
    "c_%04d.ply": "complete partial.npz {}",
    "frames": "convert truth.npz {}/####.ply",
    "e.npz": "degrade truth.npz {} --known 0.5",
    "scans": "degrade truth.npz {} --scan --points 900 --cameras 2",
    "f.csv": "evaluate truth.npz truth.npz --csv {}",
}


@pytest.mark.parametrize(("name", "line"), WRITING.items(), ids=WRITING)
def test_folders_of_outputs_are_made(
    folder: Path, monkeypatch: pytest.MonkeyPatch, name: str, line: str
) -> None:
    monkeypatch.chdir(folder)
    run(*line.format(f"new/deep/{name}").split())
    assert len(list((folder / "new" / "deep").iterdir())) >= 1


def test_folders_that_stay_empty_are_removed(folder: Path, truth: dynmesh.Sequence) -> None:
    broken = truth.vertices.copy()
    broken[3, 5] = np.inf
    known = np.ones((N, 100), np.bool_)
    dynmesh.write(folder / "broken.npz", replace(truth, vertices=broken, known=known))
    for output in ("new/deep/out.npz", "new/deep/out_%04d.ply"):
        told = run("complete", folder / "broken.npz", folder / output, code=1).stderr
        assert "broken.npz: frame 3: " in told
        assert not (folder / "new").exists()


@pytest.mark.parametrize("line", ["convert truth.npz {}", "complete partial.npz {}"])
def test_space_is_looked_at_before_a_job(
    folder: Path, monkeypatch: pytest.MonkeyPatch, line: str
) -> None:
    monkeypatch.chdir(folder)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=7000))
    for name in ("new/out.npz", "new/out_####.ply"):  # 7200 bytes
        told = run(*line.format(name).split(), code=1).stderr
        assert f"{name}: needs at least 7.2e-06 GB, but its disk has 7e-06 GB left" in told
        assert not (folder / "new").exists()
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=8000))
    run(*line.format("out.npz").split())


@pytest.mark.parametrize(
    ("pattern", "name"),
    [("a.###.obj", "a.007.obj"), ("a.#.obj", "a.#.obj"), ("##_##.obj", "##_##.obj")],
)
def test_only_one_run_of_hashes_is_a_number(tmp_path: Path, pattern: str, name: str) -> None:
    assert FrameNames.of(tmp_path / pattern).name(7) == name


def test_quiet_prints_errors_alone(folder: Path) -> None:
    source, output = folder / "partial.npz", folder / "out.npz"
    assert run("complete", source, output).stderr
    told = run("complete", source, output, "--overwrite", "--quiet")
    assert (told.stdout, told.stderr) == ("", "")
    assert "exists already" in run("complete", source, output, "--quiet", code=1).stderr
    assert run("evaluate", output, folder / "truth.npz", "-q").stdout  # what was asked for
    assert run("complete", source, output, "--overwrite").stderr


@pytest.mark.parametrize("loss", ["--noise 1", "--outliers 0.1", "--scan"])
def test_simulations_say_which_file_and_frame(
    folder: Path, truth: dynmesh.Sequence, loss: str
) -> None:
    broken = truth.vertices.copy()
    broken[0, 5] = np.nan
    dynmesh.write(folder / "broken.npz", replace(truth, vertices=broken, start=1001))
    told = run("degrade", folder / "broken.npz", folder / "o.npz", *loss.split(), code=1).stderr
    assert "broken.npz: frame 1001: " in told
