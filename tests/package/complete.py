"""Completes a sequence with the installed dynmesh, by its commands and in Python.

Requires only what `pip install dynmesh` installs, on any system.
"""

import json
import subprocess
import sys
import tempfile
from importlib import metadata

import numpy as np

import dynmesh


def command(*arguments: str, folder: str) -> str:
    """Returns the output of a `dynmesh` command."""
    return subprocess.run(
        [sys.executable, "-m", "dynmesh", *arguments],
        cwd=folder,
        stdout=subprocess.PIPE,
        check=True,
        text=True,
    ).stdout


def nmsve_by_commands(folder: str) -> float:
    """Returns the error of a walker that is completed by commands."""
    command("synth", "walker", "walker.npz", folder=folder)
    command("degrade", "walker.npz", "partial.npz", "--known", "0.3", folder=folder)
    command("complete", "partial.npz", "completed.npz", folder=folder)
    shown = command("evaluate", "completed.npz", "walker.npz", "--json", folder=folder)
    return float(json.loads(shown)["nmsve"])


def worst_share_in_python() -> float:
    """Returns the error of both methods, relative to the motion since frame 0; the larger one."""
    truth = dynmesh.synth.walker(frames=6)
    rng = np.random.default_rng(0)
    worst = 0.0
    for method in ("motion", "detail"):
        completer = dynmesh.Completer(truth.faces, truth.vertices[0], method=method)
        for points in truth.vertices[1:]:
            known = rng.random(len(points)) < 0.3
            completed = completer.push(points, known)
            np.testing.assert_array_equal(completed[known], points[known])
            left = dynmesh.metrics.nmsve(truth.faces, points, completed)
            moved = dynmesh.metrics.nmsve(truth.faces, points, truth.vertices[0])
            worst = max(worst, left / moved)
    return worst


def missing_licences() -> set[str]:
    """Returns the components of the package whose licence is not installed with it."""
    names = metadata.metadata("dynmesh").get_all("License-File") or []
    installed = metadata.files("dynmesh") or []
    there = {
        name
        for name in names
        for path in installed
        if path.as_posix().endswith(f"licenses/{name}") and path.read_text().strip()
    }
    folder = "third_party_notes/licences"
    compiled_in = ("Eigen", "OpenMesh", "nanoflann", "pybind11")
    return {"LICENSE", *(f"{folder}/{x}.txt" for x in compiled_in)} - there


with tempfile.TemporaryDirectory() as scratch:
    assert nmsve_by_commands(scratch) < 2e-4
assert worst_share_in_python() < 0.01
assert not missing_licences(), missing_licences()
assert metadata.version("dynmesh") == dynmesh.__version__
print(f"dynmesh {dynmesh.__version__} completes a sequence")
