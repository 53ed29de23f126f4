"""The example notebook runs from top to bottom."""

import base64
import io
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import REPOSITORY
from PIL import Image

nbformat: Any = pytest.importorskip("nbformat", reason="the development group has it")
nbclient: Any = pytest.importorskip("nbclient", reason="the development group has it")
pytest.importorskip("ipykernel", reason="the development group has it")
pytest.importorskip("k3d", reason="players need k3d: pip install 'dynmesh[view]'")

pytestmark = pytest.mark.slow

NOTEBOOK = REPOSITORY / "examples" / "notebook" / "compare_methods.ipynb"


@pytest.fixture
def notebook() -> Any:
    """The notebook as it is in the repository."""
    found = nbformat.read(NOTEBOOK, 4)
    nbformat.validate(found)
    return found


@pytest.fixture
def executed(notebook: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The notebook after all of its cells were run in an empty folder."""
    for name in ("IPYTHONDIR", "JUPYTER_RUNTIME_DIR"):
        monkeypatch.setenv(name, str(tmp_path / name))
    folder = tmp_path / "work"
    folder.mkdir()
    resources = {"metadata": {"path": str(folder)}}
    nbclient.NotebookClient(
        notebook, timeout=60, kernel_name="python3", resources=resources
    ).execute()
    return notebook


def outputs(notebook: Any, cell: str) -> list[Any]:
    """The outputs of a cell."""
    return next(list(found.outputs) for found in notebook.cells if found.id == cell)


def assert_upright(png: str) -> None:
    """Left of the scale, the figure is higher than wide, as its up axis is up."""
    with Image.open(io.BytesIO(base64.b64decode(png))) as picture:
        brightness = np.asarray(picture.convert("L"))
    drawn = brightness[:, : brightness.shape[1] * 3 // 5] < 255
    assert drawn.any(axis=1).sum() > 1.5 * drawn.any(axis=0).sum()


def test_the_notebook_runs(executed: Any, tmp_path: Path) -> None:
    every = [output for cell in executed.cells for output in cell.get("outputs", [])]
    assert [output.text for output in every if output.get("name") == "stderr"] == []
    for cell in ("truth", "hide", "player", "own"):
        player = outputs(executed, cell)[-1].data["text/html"]
        assert "<iframe" in player
        assert len(player) < 2_001_000
    for cell, n_pictures in (("hide", 1), ("errors", 1), ("where", 2)):
        shown = [output.get("data", {}) for output in outputs(executed, cell)]
        pictures = [data for data in shown if "image/png" in data]
        assert len(pictures) == n_pictures
    printed = "".join(output.get("text", "") for output in outputs(executed, "errors"))
    errors = re.findall(r": (\S+) on average", printed)
    assert len(errors) == len(set(errors)) == 3
    for picture in outputs(executed, "where"):
        assert_upright(picture.data["image/png"])
    assert {file.name for file in (tmp_path / "work").iterdir()} == {"partial.npz", "completed.npz"}
