"""The C example complete_stream, compared with dynmesh-complete and the package."""

import subprocess
from pathlib import Path

import numpy as np
import pytest
from meshes import sheet, turned
from numpy.typing import NDArray

import dynmesh


@pytest.fixture
def template(tmp_path: Path) -> Path:
    """A sheet of 49 vertices."""
    mesh = sheet(7)
    path = tmp_path / "sheet.obj"
    rows = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in mesh.vertices]
    rows += [f"f {a} {b} {c}" for a, b, c in mesh.faces + 1]
    path.write_text("\n".join(rows) + "\n")
    return path


@pytest.fixture
def frames(rng: np.random.Generator) -> NDArray[np.float32]:
    """Thirty partial frames of it."""
    vertices = sheet(7).vertices
    frames = np.stack([turned(vertices, 0.04 * i) for i in range(1, 31)]).astype(np.float32)
    frames[rng.random(frames.shape[:2]) < 0.7] = np.nan
    return frames


def run(
    programs: Path, template: Path, data: bytes, code: int = 0
) -> subprocess.CompletedProcess[bytes]:
    program = programs / "examples" / "c" / "complete_stream"
    result = subprocess.run(
        [program, template], input=data, capture_output=True, check=False, timeout=60
    )
    assert result.returncode == code, result.stderr
    return result


def test_a_bad_frame_does_not_end_the_show(
    programs: Path, template: Path, frames: NDArray[np.float32]
) -> None:
    frames[3, 5] = 1e30
    result = run(programs, template, frames.tobytes())
    assert result.stderr.startswith(b"frame 4: points: row 5 is at (1.00000002e+30, ")
    shown = np.frombuffer(result.stdout, np.float32).reshape(frames.shape)
    completer = dynmesh.Completer(sheet(7).faces, sheet(7).vertices.astype(np.float32))
    for number, frame in enumerate(frames):
        expected = completer.skip() if number == 3 else completer.push(frame)
        assert shown[number].tobytes() == expected.tobytes()


def test_errors(programs: Path, template: Path, frames: NDArray[np.float32]) -> None:
    cut = run(programs, template, frames.tobytes()[:-4], code=1)
    assert b"standard input ends within a frame" in cut.stderr
    assert len(cut.stdout) == frames[:-1].nbytes
    missing = run(programs, template.with_name("none.obj"), b"", code=1)
    assert missing.stderr.endswith(b"none.obj: cannot be opened\n")
    alone = subprocess.run(
        [programs / "examples" / "c" / "complete_stream"], capture_output=True, check=False
    )
    assert alone.returncode == 2
