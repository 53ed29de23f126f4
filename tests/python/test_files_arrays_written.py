"""HDF5, .npy and point caches: killed writers, more frames than memory, full disks."""

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sequences import HISTORY, assert_same

import dynmesh

pytest.importorskip("h5py", reason="h5py is not installed")


WRITE = """
import os, signal, sys, dynmesh
from pathlib import Path
sys.path.insert(0, sys.argv[1])
from test_files_arrays_written import append, writer_of
path, part, n = Path(sys.argv[2]), Path(sys.argv[3]), int(sys.argv[4])
whole = dynmesh.read(part.with_name("whole.npz"))
writer = writer_of(path, part, whole)
append(writer, whole, range(n))
writer.flush()
append(writer, whole, range(n, n + 2))  # of which some may be in the file
os.kill(os.getpid(), signal.SIGKILL)
"""


def writer_of(path: Path, part: Path, whole: dynmesh.Sequence, resume_at: int = 0) -> Any:
    header = dynmesh.Header(
        whole.faces,
        len(whole.vertices),
        whole.vertices.shape[1],
        whole.vertices.dtype,
        has_known=True,
        has_provenance=path.suffix in (".npy", ".h5"),
    )
    return dynmesh.files.target_of(path).create(header, folder=part, resume_at=resume_at)


def append(writer: Any, whole: dynmesh.Sequence, numbers: range) -> None:
    for number in numbers:
        frame = dynmesh.files.frame_of(whole, number)
        history: dict[str, Any] = {}
        if writer.header.has_provenance:
            history = {"generation": frame.generation, "age": frame.age}
        writer.append(frame.points, frame.known, **history)


@pytest.mark.parametrize("suffix", [".h5", ".npy", ".pc2", ".mdd"])
def test_a_killed_writer_can_be_resumed(tmp_path: Path, suffix: str) -> None:
    rng = np.random.default_rng(1)
    n, k = 9, 2000
    known = rng.random((n, k)) < 0.5
    vertices = np.where(known[..., None], rng.normal(size=(n, k, 3)), np.nan).astype(np.float32)
    history = [rng.integers(0, 9, (n, k)).astype(np.int32) for _ in range(2)]
    faces = rng.integers(0, k, (9, 3))
    whole = dynmesh.Sequence(vertices, faces, known, generation=history[0], age=history[1])
    dynmesh.write(tmp_path / "whole.npz", whole)
    path, part = tmp_path / f"a{suffix}", tmp_path / "part"
    here = str(Path(__file__).parent)
    command = [sys.executable, "-c", WRITE, here, str(path), str(part), "6"]
    assert subprocess.run(command).returncode == -signal.SIGKILL
    assert not path.exists()
    with writer_of(path, part, whole, resume_at=6) as writer:
        append(writer, whole, range(6, n))
    again = dynmesh.read(path)
    assert_same(whole, again, *(HISTORY if suffix in (".h5", ".npy") else ()))
    assert not part.exists()


READ_BIG = """
import resource, sys
import dynmesh
pages = int(open("/proc/self/statm").read().split()[0])
resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + 80_000_000,) * 2)
with dynmesh.open(sys.argv[1]) as reader:
    with dynmesh.create_like(reader, sys.argv[2], with_known=True) as writer:
        for number, frame in enumerate(reader):
            assert frame.points[0, 0] == number
            writer.append(*frame)
"""


@pytest.mark.parametrize("name", ["a.h5", "a.npy"])
def test_memory_does_not_grow_with_the_frames(tmp_path: Path, name: str) -> None:
    n, k = 10, 1_000_000
    path = tmp_path / name
    faces, dtype = np.array([[0, 1, 2]]), np.dtype(np.float32)
    with dynmesh.create(path, dynmesh.Header(faces, n, k, dtype, has_known=True)) as writer:
        points, known = np.zeros((k, 3), np.float32), np.ones(k, bool)
        for i in range(n):
            points[0] = i
            writer.append(points, known)
    assert path.stat().st_size > 120e6
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
    command: list[str | Path] = [
        sys.executable,
        "-c",
        READ_BIG,
        path,
        tmp_path / f"again{path.suffix}",
    ]
    subprocess.run(command, check=True, env=environment)
