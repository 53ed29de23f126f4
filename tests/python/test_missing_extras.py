"""A command reports a missing library before it does anything else."""

import re
import sys
from pathlib import Path
from typing import Any, NoReturn
from unittest import mock

import numpy as np
import pytest
from meshes import sheet

import dynmesh
from dynmesh import cli
from dynmesh.files import Reader


def hide(monkeypatch: pytest.MonkeyPatch, module: str) -> None:
    """Makes a module impossible to import."""
    for name in [*sys.modules]:
        if name == module or name.startswith(f"{module}."):
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, module, None)


def run(*arguments: str) -> int:
    """Runs `dynmesh` in this process and returns its exit code."""
    with mock.patch.object(sys, "argv", ["dynmesh", *arguments]):
        try:
            cli.main()
        except SystemExit as ended:
            return int(ended.code or 0)
    return 0


def refuse_work(*_: Any, **__: Any) -> NoReturn:
    raise AssertionError("the work was begun")


@pytest.mark.parametrize(
    ("module", "extra", "command"),
    [
        ("k3d", "view", "view in.npz -o out.html"),
        ("pyvista", "view", "register in.npz in.npz out.npz --page out.html"),
        ("pyvista", "view", "picture in.npz -o out.png"),
        ("PIL", "view", "picture in.npz -o out.png"),
        ("distributed", "batch", "batch jobs.csv"),
        ("h5py", "hdf5", "synth ocean out.h5"),
        ("pxr", "usd", "degrade in.npz out.usdc --camera 1"),
        ("PIL.Image", "scans", "degrade in.npz out --depth 64x48"),
        ("alembic3d", "alembic", "complete in.npz out.abc"),
        ("h5py", "hdf5", "complete in.npz out.h5"),
        ("h5py", "hdf5", "info in.h5"),
        ("pxr", "usd", "info in.usda"),
        ("alembic3d", "alembic", "info in.abc"),
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
    monkeypatch.setattr(Reader, "frames", refuse_work)
    monkeypatch.setattr(dynmesh.synth, "ocean", refuse_work)
    monkeypatch.setattr(dynmesh.synth, "walker", refuse_work)
    assert run(*command.split()) == 1
    told = f"dynmesh: this needs {module.partition('.')[0]}: pip install 'dynmesh[{extra}]'\n"
    assert capfd.readouterr() == ("", told)
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before
