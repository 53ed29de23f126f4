"""The command line, used as by a user: jobs, help, folders, space, extras and interruptions."""

import os
import re
import shutil
import signal
import subprocess
import sys
from dataclasses import replace
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NoReturn

import numpy as np
import pytest
import to_file
from commands import dynmesh_command as run
from commands import dynmesh_process, hide, run_here
from conftest import REPOSITORY
from meshes import sheet
from sequences import sea

import dynmesh
from dynmesh import losses
from dynmesh.cli import VERBS, command_of
from dynmesh.frames import Stored

N_FRAMES = 12
TRUTH = dynmesh.synth.ocean(N_FRAMES, seed=2)
KNOWN = np.stack(list(losses.random_known(N_FRAMES, 2500, 0.3, seed=1)))


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the steps of the main job."""
    folder = tmp_path_factory.mktemp("job")
    run("synth", "ocean", folder / "truth.npz", "--frames", str(N_FRAMES), "--seed", "2")
    run("degrade", folder / "truth.npz", folder / "partial.npz", "--known", "0.3", "--seed", "1")
    dynmesh_process("complete", folder / "partial.npz", folder / "completed.npz")
    return folder


def test_the_main_job_equals_the_library(job: Path) -> None:
    truth, partial, completed = (
        dynmesh.read(job / f"{name}.npz") for name in ("truth", "partial", "completed")
    )
    np.testing.assert_array_equal(truth.vertices, TRUTH.vertices)
    np.testing.assert_array_equal(partial.known, KNOWN)
    assert np.isnan(partial.vertices[~KNOWN]).all()
    expected = list(to_file.pushed(TRUTH.faces, TRUTH.vertices, KNOWN, method="detail"))
    np.testing.assert_array_equal(completed.vertices, expected)
    assert completed.known is None
    assert completed.fps == partial.fps == truth.fps == 30


def test_losses_are_combined_as_in_the_library(job: Path, tmp_path: Path) -> None:
    words = ["--known", "0.5", "--dropout", "0.3", "--noise", "0.1", "--seed", "4"]
    run("degrade", job / "truth.npz", tmp_path / "out.npz", *words)
    made = dynmesh.read(tmp_path / "out.npz")
    known = np.stack(list(losses.random_known(N_FRAMES, 2500, 0.5, seed=4)))
    known &= np.stack(list(losses.dropout(N_FRAMES, 2500, 0.3, seed=4)))
    np.testing.assert_array_equal(made.known, known)
    noisy = np.stack(list(losses.add_noise(TRUTH.vertices, TRUTH.faces, 0.1, seed=4)))
    np.testing.assert_array_equal(made.vertices[known], noisy[known])


def found(pattern: str, path: Path) -> str:
    """Returns the only group of `pattern` in a file."""
    (match,) = re.findall(pattern, path.read_text(), flags=re.MULTILINE)
    return str(match)


def test_there_is_one_version(programs: Path) -> None:
    version = found(r"project\(dynmesh VERSION (\S+)", REPOSITORY / "CMakeLists.txt")
    assert dynmesh.__version__ == version == metadata.version("dynmesh")
    # The citation cannot be generated, so its version is changed by hand.
    assert found(r"^version: (\S+)$", REPOSITORY / "CITATION.cff") == version
    header = programs / "include" / "dynmesh" / "version.hpp"
    assert found(r'DYNMESH_VERSION "(\S+)"', header) == version
    parts = [found(rf"DYNMESH_VERSION_{x} (\d+)", header) for x in ("MAJOR", "MINOR", "PATCH")]
    assert ".".join(parts) == version
    assert dynmesh_process("--version").stdout == f"dynmesh {version}\n"
    shown = subprocess.run([programs / "dynmesh-complete", "--version"], capture_output=True)
    assert shown.stdout.decode() == f"dynmesh-complete {version}\n"


@pytest.mark.usefixtures("hearing_interrupts")
@pytest.mark.parametrize("module", ["rich", "cyclopts"])
def test_an_interruption_while_modules_load_gives_no_traceback(module: str, tmp_path: Path) -> None:
    (tmp_path / f"{module}.py").write_text("import signal\nsignal.raise_signal(signal.SIGINT)\n")
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    command = [str(Path(sys.executable).with_name("dynmesh")), "--version"]
    ended = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert (ended.returncode, ended.stdout, ended.stderr) == (-signal.SIGINT, "", "")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder that commands run in, with a small sea, whole and partial."""
    partial = sea(6, share=0.6, whole=[0])
    dynmesh.write(tmp_path / "truth.npz", replace(partial, known=None))
    dynmesh.write(tmp_path / "partial.npz", partial)
    dynmesh.write(tmp_path / "body.obj", replace(partial, known=None)[:1])
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("line", ["convert truth.npz {}", "complete partial.npz {}"])
def test_space_is_looked_at_before_a_job(
    folder: Path, monkeypatch: pytest.MonkeyPatch, line: str
) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=7000))
    line += " --no-provenance" if line.startswith("complete") else ""
    for name in ("new/out.npz", "new/out_####.ply"):  # 7200 bytes
        told = run(*line.format(name).split(), code=1).stderr
        assert f"{name}: needs at least 7.2e-06 GB, but its disk has 7e-06 GB left" in told
        assert not (folder / "new").exists()
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=8000))
    run(*line.format("out.npz").split())


@pytest.mark.usefixtures("folder")
def test_quiet_prints_errors_alone() -> None:
    words = ("complete", "partial.npz", "out.npz")
    assert run(*words).stderr
    for quiet in ("--quiet", "-q"):
        told = run(*words, "--overwrite", quiet)
        assert (told.stdout, told.stderr) == ("", "")
    assert "exists already" in run(*words, "--quiet", code=1).stderr
    assert run("evaluate", "out.npz", "truth.npz", "-q").stdout  # what was asked for
    assert run(*words, "--overwrite").stderr
    assert re.search(r"a.png: \d+ x \d+ pixels", run("picture", "out.npz", "-o", "a.png").stderr)


@pytest.mark.parametrize("verb", VERBS)
def test_the_help_of_a_command_names_its_options(verb: str) -> None:
    told = run(verb, "--help").stdout
    (description,) = re.findall(r"\n\n(.*?)\u256d", told, re.DOTALL)
    options = [option for every in command_of(verb).options.values() for option in every]
    named = {name for option in options for name in option.names}
    assert set(re.findall(r"--[a-z-]+", description)) <= named
    parameters = {option.parameter.name for option in options if "_" in option.parameter.name}
    assert not parameters & set(re.findall(r"\w+", description))
    assert ":meth:" not in description


def refuse_work(*_: Any, **__: Any) -> NoReturn:
    raise AssertionError("the work was begun")


@pytest.mark.parametrize(
    ("module", "extra", "command"),
    [
        ("k3d", "view", "view in.npz -o out.html"),
        ("pyvista", "view", "register in.npz in.npz out.npz --page out.html"),
        ("pyvista", "view", "picture in.npz -o out.png"),
        ("h5py", "hdf5", "synth ocean out.h5"),
        ("pxr", "usd", "degrade in.npz out.usdc --camera 1"),
        ("PIL.Image", "scans", "degrade in.npz out --depth 64x48"),
        ("alembic3d", "alembic", "complete in.npz out.abc"),
        ("h5py", "hdf5", "info in.h5"),
        ("pxr", "usd", "info in.usda"),
    ],
)
def test_missing_libraries_are_reported_first(
    module: str,
    extra: str,
    command: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    mesh = sheet(3)
    for name in {"in.npz", *re.findall(r"\bin\.\w+", command)}:
        dynmesh.write(name, dynmesh.Sequence(np.stack([mesh.vertices] * 2), mesh.faces))
    Path("in.csv").write_text("precious")
    Path("jobs.csv").write_text("input,output\nin.npz,out.npz\n")
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    hide(monkeypatch, module)
    monkeypatch.setattr(Stored, "frames", refuse_work)
    monkeypatch.setattr(dynmesh.synth, "ocean", refuse_work)
    monkeypatch.setattr(dynmesh.synth, "walker", refuse_work)
    told = f"dynmesh: this needs {module.partition('.')[0]}: pip install 'dynmesh[{extra}]'\n"
    ended = run_here(*command.split())
    assert (ended.returncode, ended.stdout, ended.stderr) == (1, "", told)
    assert capfd.readouterr() == ("", "")
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before
