"""Bad input is told in a line, a fault of dynmesh with its traceback, also without streams."""

import json
import random
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pytest
import trimesh
from commands import dynmesh_command as run
from commands import run_here
from conftest import LONGER, REPOSITORY
from damage import damaged
from sequences import sea

import dynmesh
import dynmesh.verbs.evaluate
from dynmesh import _core
from dynmesh.formats.npz import NpzFrames
from dynmesh.scans import depth_files

WHOLE = sea(3, 8)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a small sea, whole and partial, its scans, and files about them."""
    folder = tmp_path_factory.mktemp("faults")
    dynmesh.write(folder / "sea.npz", WHOLE)
    dynmesh.write(folder / "partial.npz", sea(3, 8, share=0.5, whole=[0]))
    dynmesh.write(folder / "body.ply", WHOLE[:1])
    for suffix in ("glb", "stl", "off"):
        mesh = trimesh.Trimesh(WHOLE.vertices[0], WHOLE.faces, process=False)
        mesh.export(folder / f"a.{suffix}")
    run("degrade", folder / "sea.npz", folder / "scans", "--scan", "--points", "200")
    depth = ("--depth", "32x24", "--cameras", "2")
    run("degrade", folder / "sea.npz", folder / "images", *depth)
    marks = [{"vertex": i, "position": WHOLE.vertices[0, i].tolist()} for i in (0, 7, 56, 63)]
    (folder / "marks.json").write_text(json.dumps(marks))
    pose = np.eye(4).tolist()
    images = [{"file_path": f"a/{i}.png", "w": 32, "transform_matrix": pose} for i in range(3)]
    nerf = {"fl_x": 30, "fl_y": 30, "cx": 16, "cy": 12, "h": 24, "frames": images}
    (folder / "transforms.json").write_text(json.dumps(nerf))
    (folder / "path.txt").write_text("".join(f"{i} 0 0 {i} 0 0 0 1\n" for i in range(3)))
    np.save(folder / "known.npy", np.ones((3, 64), bool))
    (folder / "quality.csv").write_text("frame,quality,reason\n0,good,\n1,doubtful,why\n2,good,\n")
    (folder / "jobs.csv").write_text("input,output,start,training\nsea.npz,sea.npz,0,a;b\n")
    return folder


READING = {
    "a.glb": "convert a.glb out.npz",
    "a.stl": "convert a.stl out.npz",
    "a.off": "convert a.off out.npz",
    "sea.npz": "evaluate sea.npz sea.npz",
    "body.ply": "track scans out.npz --template body.ply",
    "scans/frame_00001.ply": "track scans out.npz --template body.ply",
    "images/depth_00001_0.png": "track images out.npz --template body.ply",
    "images/cameras.json": "track images out.npz --template body.ply",
    "transforms.json": "track images out.npz --template body.ply --cameras transforms.json",
    "path.txt": "track images out.npz --template body.ply --cameras path.txt",
    "marks.json": "register body.ply scans/frame_00000.ply out.npz --landmarks marks.json",
    "known.npy": "convert sea.npz out.npz --mask known.npy",
    "quality.csv": "view sea.npz -o out.html --quality quality.csv",
    "jobs.csv": "batch jobs.csv",
}
"""A command that reads a file."""


@pytest.mark.parametrize("name", READING)
def test_no_damage_to_a_file_is_a_fault(
    folder: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    content, generator = Path(name).read_bytes(), random.Random(name)
    for _ in range(20 * LONGER):
        Path(name).write_bytes(damaged(content, generator))
        ended = run_here(*READING[name].split(), "--overwrite")
        assert "Traceback" not in ended.stderr, (Path(name).read_bytes(), ended.stderr)
    Path(name).write_bytes(content)


def test_whatever_is_refused_is_an_error_of_dynmesh() -> None:
    for file in (REPOSITORY / "python" / "dynmesh").rglob("*.py"):
        direct = re.findall(r"(?:raise|return) (?:Value|Type)Error\(.*", file.read_text("utf-8"))
        assert not direct, (file, "InputError and KindError are told without a traceback")


FAULTS: dict[str, tuple[Any, str, str]] = {
    "the core": (_core, "laplacian_interpolation", "complete partial.npz out.npz --start best"),
    "reading": (NpzFrames, "_frames", "convert sea.npz out.npz"),
    "a completer": (dynmesh.Completer, "push", "complete partial.npz out.npz"),
    "a tracker": (dynmesh.Tracker, "push", "track scans out.npz --template body.ply"),
    "an image": (depth_files, "_check", "track images out.npz --template body.ply"),
    "a report": (dynmesh.verbs.evaluate, "counted", "evaluate sea.npz sea.npz"),
}


@pytest.mark.parametrize("error", [ValueError, KeyError])
@pytest.mark.parametrize("place", FAULTS)
def test_a_fault_inside_shows_where(
    folder: Path, monkeypatch: pytest.MonkeyPatch, place: str, error: type[Exception]
) -> None:
    module, name, line = FAULTS[place]

    def fail(*_: Any, **__: Any) -> NoReturn:
        raise error("broken inside")

    monkeypatch.chdir(folder)
    monkeypatch.setattr(module, name, fail)
    told = run(*line.split(), "--overwrite", code=1).stderr
    assert "Traceback" in told
    assert "in fail\n" in told
    assert re.search(
        rf"^dynmesh: {error.__name__}: .*broken inside.*; this is a fault of", told, re.M
    )


@pytest.mark.parametrize(
    ("line", "code"), [("info none.npz", 1), ("info", 2), ("synth ocean a.npz --frames 0", 2)]
)
def test_bad_input_shows_where_on_request(line: str, code: int) -> None:
    assert "Traceback" not in run(*line.split(), "--traceback=no", code=code).stderr
    assert "Traceback" in run("--traceback", *line.split(), code=code).stderr
    assert "Traceback" not in run("--no-traceback", *line.split(), code=code).stderr


def test_too_little_memory_is_told_in_a_line(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(NpzFrames, "_frames", lambda *_: np.empty(2**47))
    told = run("convert", folder / "sea.npz", folder / "out.npz", "--overwrite", code=1).stderr
    assert told.startswith("dynmesh: there is not enough memory: ")
    assert told.count("\n") == 1


STREAMS = {
    "info sea.npz >&-": (1, "standard output"),
    "info sea.npz --json >/dev/full": (1, "standard output"),
    "--help >/dev/full": (1, "standard output"),
    "convert sea.npz out.npz --overwrite --json >&-": (1, "standard output"),
    "convert sea.npz out.npz --overwrite >&-": (0, "3 frames"),
    "convert sea.npz out.npz --overwrite 2>/dev/full": (0, ""),
    "convert sea.npz out.npz --overwrite <&- >&- 2>&-": (0, ""),
    "info none.npz >&- 2>&-": (1, ""),
    "info sea.npz --json | true": (0, ""),
    "info none.npz 2>&1 | true": (1, ""),
}


@pytest.mark.parametrize("line", STREAMS)
def test_standard_streams_may_be_closed_or_full(folder: Path, line: str) -> None:
    code, told = STREAMS[line]
    shell = ["bash", "-c", f"set -o pipefail; {sys.executable} -m dynmesh {line}"]
    ended = subprocess.run(shell, cwd=folder, capture_output=True, text=True, check=False)
    assert ended.returncode == code, ended.stderr
    assert told in ended.stderr
    assert ended.stderr.count("\n") == (1 if told else 0), ended.stderr
    if "out.npz" in line:  # no message is in it
        np.testing.assert_array_equal(dynmesh.read(folder / "out.npz").vertices, WHOLE.vertices)


def is_json(text: str) -> bool:
    return text.startswith("{")


FLAGS: dict[str, Callable[[subprocess.CompletedProcess[str]], bool]] = {
    "convert sea.npz out.npz --overwrite --quiet=true": lambda ended: not ended.stderr,
    "convert sea.npz out.npz --overwrite --quiet=no": lambda ended: bool(ended.stderr),
    "--quiet=yes convert sea.npz out.npz --overwrite": lambda ended: not ended.stderr,
    "info sea.npz --json=false": lambda ended: not is_json(ended.stdout),
    "--json info sea.npz --no-quiet": lambda ended: is_json(ended.stdout),
    "info sea.npz --json=perhaps": lambda ended: ended.returncode == 2,
    "convert sea.npz out.npz --no-overwrite": lambda ended: "exists already" in ended.stderr,
    "info -- --json": lambda ended: "--json: No such file" in ended.stderr,
    "evaluate sea.npz sea.npz --csv --quiet": lambda ended: ended.returncode == 2,
}


@pytest.mark.parametrize("line", FLAGS)
def test_flags_mean_what_they_say(folder: Path, monkeypatch: pytest.MonkeyPatch, line: str) -> None:
    monkeypatch.chdir(folder)
    Path("out.npz").write_bytes(Path("sea.npz").read_bytes())
    ended = run_here(*line.split())
    assert FLAGS[line](ended), ended
