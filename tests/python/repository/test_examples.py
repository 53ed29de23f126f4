"""The example that streams to rerun, and the notebook."""

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import to_file
from conftest import REPOSITORY
from meshes import Mesh

from dynmesh import Sequence, write

pytestmark = pytest.mark.slow

EXAMPLE = REPOSITORY / "examples" / "python" / "live.py"


def test_every_frame_is_in_the_recording(
    tmp_path: Path, mesh: Mesh, rng: np.random.Generator
) -> None:
    chunk = pytest.importorskip("rerun.chunk", reason="rerun-sdk is missing, or too old to read")
    vertices = np.stack([mesh.vertices * (1 + 0.1 * i) for i in range(6)]).astype(np.float32)
    known = rng.random(vertices.shape[:2]) < 0.4
    known[0] = True
    source, recording = tmp_path / "partial.npz", tmp_path / "completion.rrd"
    write(source, Sequence(vertices, mesh.faces, known))
    command = [sys.executable, str(EXAMPLE), str(source), "--save", str(recording)]
    subprocess.run(command, check=True, capture_output=True)

    rows: dict[tuple[str, int], dict[str, Any]] = {}
    for part in chunk.RrdReader(recording).stream():
        if part.is_static:
            continue
        table = part.to_record_batch().drop_columns("log_time").to_pydict()
        for row, number in enumerate(table["frame"]):
            rows.setdefault((part.entity_path, number), {}).update(
                {name: column[row] for name, column in table.items() if column[row] is not None}
            )
    completed = to_file.pushed(mesh.faces, vertices, known)
    for number in range(6):
        mesh_row = rows["/completed", number]
        np.testing.assert_array_equal(mesh_row["Mesh3D:vertex_positions"], completed[number])
        dots = rows["/observed", number]["Points3D:positions"]
        np.testing.assert_array_equal(dots, vertices[number][known[number]])
        assert (("/milliseconds", number) in rows) == (number > 0)


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
