"""The example that streams a completion to rerun."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import REPOSITORY
from meshes import Mesh

from dynmesh import Sequence, complete, write

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
    completed = list(complete(mesh.faces, vertices, known))
    for number in range(6):
        mesh_row = rows["/completed", number]
        np.testing.assert_array_equal(mesh_row["Mesh3D:vertex_positions"], completed[number])
        dots = rows["/observed", number]["Points3D:positions"]
        np.testing.assert_array_equal(dots, vertices[number][known[number]])
        assert (("/milliseconds", number) in rows) == (number > 0)
