"""Files written by Blender are read, and written files are read by Blender.

The second half needs a Python with Blender in it: script/dev/interchange installs and uses one.
"""

import os
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import to_file
from conftest import REPOSITORY
from stages import BODY, production

import dynmesh

ELSEWHERE = REPOSITORY / "tests" / "elsewhere"


@pytest.fixture(scope="module")
def truth() -> dict[str, np.ndarray[Any, Any]]:
    with np.load(ELSEWHERE / "blender" / "truth.npz") as arrays:
        return dict(arrays)


@pytest.mark.parametrize("name", ["body.usdc", "body.abc", "body_*.ply", "body_*.obj"])
def test_what_blender_wrote_is_read(truth: dict[str, np.ndarray[Any, Any]], name: str) -> None:
    sequence: Any = dynmesh.read(ELSEWHERE / "blender" / name)
    assert sequence.start == 1
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
        pytest.skip("Blender is not here: script/dev/interchange installs it and runs these tests")
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


def seen_by(blender: str, file: Path) -> dict[str, Any]:
    """What Blender shows of all meshes in a scene, in frames with samples."""
    out = file.with_suffix(".seen.npz")
    script = ELSEWHERE / "open_scene_with_blender.py"
    command = [blender, str(script), str(out), str(file), "24", *map(str, SHOWN)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    with np.load(out) as seen:
        return dict(seen)


SHOWN = (1001, 1003, 1005)


def test_blender_shows_a_completed_scene_as_it_was(tmp_path: Path, blender: str) -> None:
    scene, completed = production(tmp_path / "scene.usda"), tmp_path / "over.usda"
    to_file.complete(scene, completed, source={"prim": BODY})
    before, after = seen_by(blender, scene), seen_by(blender, completed)
    for what, values in before.items():
        if what != "Body:positions":  # matrices, texture coordinates, materials, other meshes
            np.testing.assert_array_equal(after[what], values, err_msg=what)
    numbers = [(frame - 1001) // 2 for frame in SHOWN]
    expected = dynmesh.read(completed, prim=BODY).vertices[numbers]
    np.testing.assert_allclose(after["Body:positions"], expected, atol=1e-6)


def test_the_extension_completes(tmp_path: Path, blender: str) -> None:
    (extension, *_) = [*sorted((REPOSITORY / "dist").glob("dynmesh-blender-*.zip")), None]
    if extension is None:
        pytest.skip("the extension is not here: script/dev/blender-extension makes it")
    files = [extension, tmp_path / "out.npz"]
    script = ELSEWHERE / "extension_in_blender.py"
    own = os.environ | {"BLENDER_USER_RESOURCES": str(tmp_path / "user")}
    (tmp_path / "user").mkdir()
    subprocess.run([blender, script, *files], cwd=tmp_path, env=own, check=True)
    with np.load(tmp_path / "out.npz") as found:
        assert "none" in str(found["refused"])
        assert "seen" in str(found["refused"])  # the name that would do
        truth, completed = found["truth"], found["completed"]
        np.testing.assert_array_equal(completed[:, ::2], truth[:, ::2])
        np.testing.assert_array_equal(completed[0], truth[0])
        errors = np.linalg.norm(completed - truth, axis=2)[-1, 1::2]
        moved = np.linalg.norm(truth[-1] - truth[0], axis=1)[1::2]
        assert errors.mean() < 0.1 * moved.mean()
