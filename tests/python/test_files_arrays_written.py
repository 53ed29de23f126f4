"""HDF5, .npy and point caches: killed writers, more frames than memory, full disks."""

import os
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from bad_input.files import on_a_full_disk
from sequences import HISTORY, assert_same

import dynmesh

pytest.importorskip("h5py", reason="h5py is not installed")


WRITE = """
import sys, numpy as np, dynmesh
from pathlib import Path
path, kept, part, n = Path(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3]), int(sys.argv[4])
whole = dynmesh.read(part.with_name("whole.npz"))
has_history = path.suffix in (".npy", ".h5")
header = dynmesh.Header(
    whole.faces, *whole.vertices.shape[:2], whole.vertices.dtype, has_known=True,
    has_provenance=has_history,
)
with dynmesh.files.target_of(path).create(header, folder=part, resume_at=kept) as writer:
    for i in range(kept, len(whole.vertices)):
        history = dict(generation=whole.generation[i], age=whole.age[i]) if has_history else {}
        if i == n:
            writer.flush()
            print(i, flush=True)
        writer.append(whole.vertices[i], whole.known[i], **history)
        if i >= n + 1:  # half a frame more than is flushed, then wait to be killed
            print(flush=True)
            sys.stdin.read()
"""


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
    kept = 0
    for stop in (1, 6):
        command: list[str | Path] = [sys.executable, "-c", WRITE, path, str(kept), part, str(stop)]
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as writer:
            assert writer.stdout is not None
            kept = int(writer.stdout.readline())
            writer.stdout.readline()
            os.kill(writer.pid, signal.SIGKILL)
        assert kept == stop
        assert not path.exists()
    final: list[str | Path] = [sys.executable, "-c", WRITE, path, str(kept), part, str(n)]
    subprocess.run(final, check=True, stdin=subprocess.DEVNULL)
    again = dynmesh.read(path)
    assert_same(whole, again, *(HISTORY if suffix in (".h5", ".npy") else ()))
    assert not part.exists()


READ_BIG = """
import resource, sys
import dynmesh
resource.setrlimit(resource.RLIMIT_AS, (250_000_000,) * 2)
with dynmesh.open(sys.argv[1]) as reader:
    with dynmesh.create_like(reader, sys.argv[2], with_known=True) as writer:
        for number, frame in enumerate(reader):
            assert frame.points[0, 0] == number
            writer.append(*frame)
"""


@pytest.mark.parametrize("name", ["a.h5", "a.npy"])
def test_memory_does_not_grow_with_the_frames(tmp_path: Path, name: str) -> None:
    n, k = 25, 1_000_000
    path = tmp_path / name
    faces, dtype = np.array([[0, 1, 2]]), np.dtype(np.float32)
    with dynmesh.create(path, dynmesh.Header(faces, n, k, dtype, has_known=True)) as writer:
        points, known = np.zeros((k, 3), np.float32), np.ones(k, bool)
        for i in range(n):
            points[0] = i
            writer.append(points, known)
    assert path.stat().st_size > 290e6
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
    command: list[str | Path] = [
        sys.executable,
        "-c",
        READ_BIG,
        path,
        tmp_path / f"again{path.suffix}",
    ]
    subprocess.run(command, check=True, env=environment)


def test_a_full_disk_raises_an_oserror(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    sequence = dynmesh.Sequence(np.ones((50, 9000, 3)), np.array([[0, 1, 2]]))
    for name in ("a.h5", "a.npy", "a.pc2", "a.mdd"):
        path = tmp_path / name
        with pytest.raises(OSError, match="File too large") as caught:
            on_a_full_disk(partial(dynmesh.write, path, sequence), 1_000_000)
        assert str(caught.value) == f"[Errno 27] File too large: '{path}'"
        assert capfd.readouterr() == ("", "")
        assert not list(tmp_path.iterdir())
