"""Files written by Blender are read, and written files are read by Blender.

The second half needs a Python with Blender in it: script/interchange installs and uses one.
"""

import os
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import REPOSITORY

import dynmesh

pytest.importorskip("pxr")
pytest.importorskip("alembic3d")

ELSEWHERE = REPOSITORY / "tests" / "elsewhere"


@pytest.fixture(scope="module")
def truth() -> dict[str, np.ndarray[Any, Any]]:
    with np.load(ELSEWHERE / "blender" / "truth.npz") as arrays:
        return dict(arrays)


@pytest.mark.parametrize("name", ["body.usdc", "body.usda", "body.abc", "body_*.ply", "body_*.obj"])
def test_what_blender_wrote_is_read(truth: dict[str, np.ndarray[Any, Any]], name: str) -> None:
    sequence = dynmesh.read(ELSEWHERE / "blender" / name)
    assert sequence.start == 1
    assert sequence.polygons is not None
    np.testing.assert_array_equal(sequence.polygons.sizes, truth["polygon_sizes"])
    np.testing.assert_array_equal(sequence.polygons.corners, truth["polygon_corners"])
    if name.startswith("body_"):  # in world space; OBJ has six digits
        np.testing.assert_allclose(sequence.vertices, truth["world"], rtol=0, atol=1e-6)
        return
    x, y, z = np.moveaxis(truth["vertices"], -1, 0)
    expected = np.stack([x, z, -y] if name == "body.abc" else [x, y, z], axis=-1)
    np.testing.assert_array_equal(sequence.vertices, expected)
    assert sequence.fps == 25
    assert sequence.name == ("" if name == "body.abc" else "/root") + "/Above/Body/BodyShape"


@pytest.fixture(scope="module")
def blender() -> str:
    """A Python with Blender."""
    own = REPOSITORY / ".venv-blender" / "bin" / "python"
    path = Path(os.environ.get("DYNMESH_BLENDER_PYTHON", own))
    if not path.exists():
        pytest.skip("Blender is not here: script/interchange installs it and runs these tests")
    return str(path)


@pytest.mark.parametrize("name", ["a.usdc", "a.usda", "a.abc", "a_%04d.ply", "a_%04d.obj"])
def test_what_is_written_is_read_by_blender(
    tmp_path: Path, truth: dict[str, np.ndarray[Any, Any]], blender: str, name: str
) -> None:
    sequence = dynmesh.read(ELSEWHERE / "blender" / "body.usdc")
    dynmesh.write(tmp_path / name, sequence)
    files = sorted(str(path) for path in tmp_path.iterdir())
    out = tmp_path / "seen.npz"
    command = [blender, str(ELSEWHERE / "read_with_blender.py"), str(out), "25", *files]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    with np.load(out) as seen:
        atol = 1e-6 if name.endswith("obj") else 0.0
        np.testing.assert_allclose(seen["vertices"], truth["vertices"], rtol=0, atol=atol)
        np.testing.assert_array_equal(seen["polygon_sizes"], truth["polygon_sizes"])
        np.testing.assert_array_equal(seen["polygon_corners"], truth["polygon_corners"])
