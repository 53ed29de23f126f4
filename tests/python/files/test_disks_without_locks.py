"""Disks that have no locks, as some networks and containers: a library stands in for them."""

import errno
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from sequences import sea

import dynmesh

NO_LOCK = """
#include <errno.h>
#include <stdlib.h>
int flock(int file, int how) {
  (void)file, (void)how;
  errno = atoi(getenv("NO_LOCK"));
  return -1;
}
"""


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("no_lock") / "no_lock.so"
    made.with_suffix(".c").write_text(NO_LOCK)
    subprocess.run(["cc", "-shared", "-fPIC", "-o", made, made.with_suffix(".c")], check=True)
    return made


@pytest.fixture(params=["ENOLCK", "EOPNOTSUPP", "ENOSYS"])
def on_such_a_disk(
    request: pytest.FixtureRequest, library: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NO_LOCK", str(getattr(errno, request.param)))
    monkeypatch.setenv("LD_PRELOAD", str(library))


def convert(*words: str | Path, code: int = 0) -> str:
    command = [sys.executable, "-m", "dynmesh", "convert", *map(str, words)]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == code, ended.stderr
    assert "Traceback" not in ended.stderr
    return ended.stderr


@pytest.mark.usefixtures("on_such_a_disk")
def test_files_are_read_and_written(tmp_path: Path) -> None:
    pytest.importorskip("h5py")
    dynmesh.write(tmp_path / "in.h5", sea(3))
    source = tmp_path / "in.h5"
    for name in ("a.npz", "b.h5", "c/f_%d.ply"):
        output = tmp_path / name
        for more in ([], ["--overwrite"]):
            assert "its disk has no locks" in convert(source, output, *more)
        back = dynmesh.read(output)
        np.testing.assert_array_equal(back.vertices, dynmesh.read(tmp_path / "in.h5").vertices)
        source = output
    assert not [*tmp_path.rglob(".*")]


@pytest.mark.usefixtures("on_such_a_disk")
def test_the_lock_file_keeps_others_out_and_one_of_a_killed_run_does_not(tmp_path: Path) -> None:
    dynmesh.write(tmp_path / "in.npz", sea(3))
    hold = (
        "import os, sys\nfrom pathlib import Path\nfrom dynmesh.formats.output import making\n"
        "with making(Path(sys.argv[1])):\n    print(flush=True)\n    input()\n    os._exit(9)\n"
    )
    command = [sys.executable, "-c", hold, str(tmp_path / "out.npz")]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True) as process:
        assert process.stdout is not None
        process.stdout.readline()
        words = (tmp_path / "in.npz", tmp_path / "out.npz")
        assert "is being written by another process" in convert(*words, code=1)
        process.communicate("\n")
    assert process.returncode == 9
    convert(*words)
    assert len(dynmesh.read(tmp_path / "out.npz")) == 3
    assert not [*tmp_path.rglob(".*")]
