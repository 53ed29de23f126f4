"""The notebook."""

import re
from pathlib import Path
from typing import Any

import pytest
from conftest import REPOSITORY

pytestmark = pytest.mark.slow

nbformat: Any = pytest.importorskip("nbformat", reason="the development group has it")
nbclient: Any = pytest.importorskip("nbclient", reason="the development group has it")
pytest.importorskip("ipykernel", reason="the development group has it")
pytest.importorskip("k3d", reason="players need k3d: pip install 'dynmesh[view]'")


def outputs(notebook: Any, cell: str) -> list[Any]:
    """The outputs of a cell."""
    return next(list(found.outputs) for found in notebook.cells if found.id == cell)


def test_the_notebook_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All of its cells, in an empty folder."""
    executed = nbformat.read(REPOSITORY / "examples" / "notebook" / "compare_methods.ipynb", 4)
    nbformat.validate(executed)
    for name in ("IPYTHONDIR", "JUPYTER_RUNTIME_DIR"):
        monkeypatch.setenv(name, str(tmp_path / name))
    folder = tmp_path / "work"
    folder.mkdir()
    about = {"kernel_name": "python3", "resources": {"metadata": {"path": str(folder)}}}
    nbclient.NotebookClient(executed, timeout=60, **about).execute()
    every = [output for cell in executed.cells for output in cell.get("outputs", [])]
    assert [output.text for output in every if output.get("name") == "stderr"] == []
    printed = "".join(output.get("text", "") for output in outputs(executed, "errors"))
    errors = re.findall(r": (\S+) on average", printed)
    assert len(errors) == len(set(errors)) == 3
    assert {file.name for file in folder.iterdir()} == {"partial.npz", "completed.npz"}
