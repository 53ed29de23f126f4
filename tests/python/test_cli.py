"""The command line, used as by a user."""

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import dynmesh_command as run
from commands import dynmesh_process

import dynmesh

N_FRAMES = 12


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the steps of the main job."""
    folder = tmp_path_factory.mktemp("job")
    run("synth", "ocean", folder / "truth.npz", "--frames", str(N_FRAMES), "--seed", "2")
    run("degrade", folder / "truth.npz", folder / "partial.npz", "--known", "0.3", "--seed", "1")
    dynmesh_process("complete", folder / "partial.npz", folder / "completed.npz")
    return folder


def test_the_main_job_equals_the_library(folder: Path) -> None:
    truth = dynmesh.read(folder / "truth.npz")
    np.testing.assert_array_equal(truth.vertices, dynmesh.synth.ocean(N_FRAMES, seed=2).vertices)
    partial = dynmesh.read(folder / "partial.npz")
    assert partial.known is not None
    masks = list(dynmesh.degrade.random_known(N_FRAMES, 2500, 0.3, seed=1))
    np.testing.assert_array_equal(partial.known, masks)
    assert np.isnan(partial.vertices[~partial.known]).all()
    completed = dynmesh.read(folder / "completed.npz")
    expected = list(dynmesh.complete(truth.faces, truth.vertices, masks, method="detail"))
    np.testing.assert_array_equal(completed.vertices, expected)
    assert completed.known is None
    assert completed.fps == partial.fps == truth.fps == 30


def test_settings_reach_the_completer(folder: Path, tmp_path: Path) -> None:
    partial = dynmesh.read(folder / "partial.npz")
    for options, settings in [
        (["--method=motion"], {"method": "motion"}),
        (
            ["--noise", "0.01", "--reject-outliers", "--learn", "--threads", "2"],
            {"noise": 0.01, "reject_outliers": True, "learn": True},
        ),
    ]:
        out = tmp_path / "out.npz"
        run("complete", folder / "partial.npz", out, "--overwrite", *options)
        expected: Any = list(
            dynmesh.complete(partial.faces, partial.vertices, partial.known, **settings)  # type: ignore[arg-type]
        )
        np.testing.assert_array_equal(dynmesh.read(out).vertices, expected)


def test_degrade_equals_the_library(folder: Path, tmp_path: Path) -> None:
    truth = dynmesh.read(folder / "truth.npz")
    frames, faces, degrade = truth.vertices, truth.faces, dynmesh.degrade
    everywhere = frames.reshape(-1, 3)
    ways: list[tuple[list[str], Any, Any]] = [
        (
            ["--camera", "2"],
            degrade.camera_known(frames, faces, degrade.orbit(everywhere, 2)),
            frames,
        ),
        (["--patches", "0.2"], degrade.patch_known(faces, N_FRAMES, 2500, 0.2, seed=4), frames),
        (["--dropout", "0.3"], degrade.dropout(N_FRAMES, 2500, 0.3, seed=4), frames),
        (["--noise", "0.1"], None, degrade.add_noise(frames, faces, 0.1, seed=4)),
        (["--outliers", "0.1"], None, degrade.add_outliers(frames, faces, 0.1, seed=4)),
    ]
    for options, known, points in ways:
        out = tmp_path / f"{options[0].strip('-')}.npz"
        run("degrade", folder / "truth.npz", out, "--seed", "4", *options)
        made = dynmesh.read(out)
        assert made.known is not None
        np.testing.assert_array_equal(
            made.known, np.ones((N_FRAMES, 2500), bool) if known is None else list(known)
        )
        expected = np.stack(list(points))
        np.testing.assert_array_equal(made.vertices[made.known], expected[made.known])
    run("degrade", folder / "truth.npz", tmp_path / "all.npz", "--known", "0.5", "--dropout", "0.3",
        "--noise", "0.1", "--seed", "4")  # fmt: skip
    both = dynmesh.read(tmp_path / "all.npz").known
    expected = np.logical_and(
        list(degrade.random_known(N_FRAMES, 2500, 0.5, seed=4)),
        list(degrade.dropout(N_FRAMES, 2500, 0.3, seed=4)),
    )
    np.testing.assert_array_equal(both, expected)


def test_what_a_format_cannot_hold_is_reported(folder: Path, tmp_path: Path) -> None:
    run("complete", folder / "partial.npz", tmp_path / "a.npz", "--provenance")
    completed = dynmesh.read(tmp_path / "a.npz").vertices
    for name in ("a.pc2", "o/f_%02d.obj"):
        shown = run("convert", tmp_path / "a.npz", tmp_path / name).stderr
        assert (
            f"{name}: generation and age are not written; this format cannot hold them\n" in shown
        )
        np.testing.assert_array_equal(dynmesh.read(tmp_path / name).vertices, completed)
    shown = run("convert", tmp_path / "a.npz", tmp_path / "a.npy").stderr
    assert "not written" not in shown
    assert dynmesh.read(tmp_path / "a.npy").generation is not None


@pytest.mark.usefixtures("hearing_interrupts")
@pytest.mark.parametrize("module", ["numpy", "cyclopts"])
def test_an_interruption_while_modules_load_gives_no_traceback(module: str, tmp_path: Path) -> None:
    (tmp_path / f"{module}.py").write_text("import signal\nsignal.raise_signal(signal.SIGINT)\n")
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    command = [str(Path(sys.executable).with_name("dynmesh")), "--version"]
    ended = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert (ended.returncode, ended.stdout, ended.stderr) == (-signal.SIGINT, "", "")


def test_who_reads_the_output_may_stop(folder: Path) -> None:
    words = [sys.executable, "-m", "dynmesh", "info", str(folder / "truth.npz"), "--json"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.close()
        assert process.stderr is not None
        assert process.stderr.read() == b""
    assert process.returncode == 0


def test_what_else_new_users_write(folder: Path, tmp_path: Path) -> None:
    """A message names the option that is missing, and what was exchanged."""
    truth = str(folder / "truth.npz")
    assert "--input: is needed" in run("evaluate", truth, truth, "--only", "missing", code=2).stderr
    (tmp_path / "scan.xyz").write_text("0 0 0\n1 0 0\n0 1 0\n")
    (tmp_path / "scan.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
        "property float z\nend_header\n0 0 0\n"
    )
    files = tmp_path / "scan.ply", tmp_path / "scan.xyz", tmp_path / "made.obj"
    assert "comes before the scan" in run("register", *files, code=1).stderr
    many = [f"{number}.png" for number in range(20)]
    said = run("track", *many, "--template", "a.obj", code=2).stderr
    assert "put patterns in quotes" in said
    assert "9.png" not in said
