"""Completes a sequence with the installed dynmesh, by its commands.

Requires only what `pip install dynmesh` installs, on any system.
"""

import json
import subprocess
import sys
import tempfile
from importlib import metadata

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
assert not missing_licences(), missing_licences()
assert metadata.version("dynmesh") == dynmesh.__version__
print(f"dynmesh {dynmesh.__version__} completes a sequence")
