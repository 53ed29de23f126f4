"""Outputs of several processes and of ended ones, and completers in threads and forks."""

import errno
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import dynmesh_command, run_here
from conftest import REPOSITORY
from kills import COMMANDS, command, make_sources
from sequences import contents, sea

import dynmesh
from dynmesh.completion import passes
from dynmesh.draw import page
from dynmesh.formats.output import making
from dynmesh.verbs import convert, degrade, picture


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_sources(tmp_path_factory.mktemp("sources") / "new", 5)


@pytest.mark.parametrize("kind", COMMANDS)
def test_no_command_writes_what_another_one_is_writing(
    tmp_path: Path, sources: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    monkeypatch.chdir(sources)
    (tmp_path / "mixed").mkdir()
    (tmp_path / "mixed" / "readme.txt").touch()
    output = next(Path(word.format(tmp_path)) for word in COMMANDS[kind].split() if "{}" in word)
    words = command(kind, sources, tmp_path)
    with making(output / "scans" if kind == "scans" else output):
        before = contents(tmp_path)
        refused = dynmesh_command(*words, code=1).stderr
        assert "is being written by another process" in refused
        assert contents(tmp_path) == before
    assert run_here(*words).returncode in (0, 3)  # which is over; 3 if the result is doubtful


@pytest.mark.parametrize("beside", ["readme.txt", ".hidden", "more"])
def test_other_files_stay_where_they_are(tmp_path: Path, beside: str) -> None:
    output, other = tmp_path / "out" / "f_%02d.ply", tmp_path / "out" / beside
    dynmesh.write(output, sea(6))
    other.mkdir() if beside == "more" else other.write_text("mine")
    was = output.parent.stat().st_ino
    dynmesh.write(output, sea(4))
    assert len(dynmesh.read(output)) == 4
    assert other.exists()
    assert output.parent.stat().st_ino == was


def write_another(path: Path) -> Callable[..., Iterator[Any]]:
    """Passes frames on, and before the last one makes the output, as another process may."""

    def track(items: Any, total: int, *_: Any, **__: Any) -> Iterator[Any]:
        for number, item in enumerate(items):
            if number == total - 1:
                path.parent.mkdir(exist_ok=True)
                path.write_bytes(b"of another process")
            yield item

    return track


@pytest.mark.parametrize(
    ("command", "made"),
    [
        ("complete in.npz out.npz", "out.npz"),
        ("convert in.npz out.npz", "out.npz"),
        ("convert in.npz out.npy", "out.faces.npy"),
        ("convert in.npz out.pc2", "out.pc2"),
        ("convert in.npz q/f_%02d.ply", "q/f_07.ply"),
        ("degrade in.npz out.npz --known 0.5", "out.npz"),
        ("degrade in.npz out --scan --points 50", "out/frame_00000.ply"),
        ("degrade in.npz out --depth 8x8", "out/depth_00000_0.png"),
        ("view in.npz -o page.html", "page.html"),
        ("picture in.npz -o sheet.png", "sheet.png"),
    ],
)
def test_an_output_that_appears_meanwhile_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str, made: str
) -> None:
    monkeypatch.chdir(tmp_path)
    dynmesh.write("in.npz", sea(4))
    before = contents(tmp_path)
    for module in (passes, convert, degrade, picture, page):
        monkeypatch.setattr(module, "tracked", write_another(Path(made)))
    result = dynmesh_command(*command.split(), code=1)
    assert "exists already" in result.stderr
    assert contents(tmp_path) == before | {made: b"of another process"}
    assert not list(tmp_path.glob(".*"))
    dynmesh_command(*command.split(), "--overwrite")
    assert contents(tmp_path).get(made) != b"of another process"


ENDURANCE = REPOSITORY / "tests" / "endurance"


def run(script: str, *arguments: str) -> str:
    command = [sys.executable, str(ENDURANCE / script), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
def test_a_short_soak() -> None:
    shown = run("soak.py", "1000")
    assert "1000 frames in" in shown
    assert shown.endswith("\n0 violations\n")


def test_ended_commands_lose_nothing() -> None:
    assert run("kills.py", "17").endswith(" ended, 0 corruptions\n")


FORKS = """
import os, sys, threading, time
import numpy as np
import dynmesh

sea = dynmesh.synth.ocean(4, grid=160, seed=1)  # so large that threads share the work
known = np.random.default_rng(0).random(sea.vertices.shape[1]) < 0.3

def ends(child):
    patience = time.monotonic() + 60
    while time.monotonic() < patience:
        pid, status = os.waitpid(child, os.WNOHANG)
        if pid:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.005)
    os.kill(child, 9)
    os.waitpid(child, 0)
    return "hangs"

for method in ("motion", "detail"):
    completer = dynmesh.Completer(sea.faces, sea.vertices[0], method=method, threads=2)
    alone = dynmesh.Completer(sea.faces, sea.vertices[0], method=method)
    completer.push(sea.vertices[1], known), alone.push(sea.vertices[1], known)
    expected = [alone.push(frame, known) for frame in sea.vertices[2:]]
    for _ in range(3):  # an idle completer works in the child and is destroyed there
        child = os.fork()
        if child == 0:
            got = [completer.push(frame, known) for frame in sea.vertices[2:]]
            same = np.array_equal(got, expected)
            del completer
            os._exit(0 if same else 3)
        assert (code := ends(child)) == 0, code
    got = [completer.push(frame, known) for frame in sea.vertices[2:]]
    assert np.array_equal(got, expected)  # also in the parent

    over = False
    def push_on():
        while not over:
            completer.push(sea.vertices[1], known)
    thread = threading.Thread(target=push_on)
    thread.start()
    codes = set()
    for _ in range(20):  # a busy one remains in use, by a thread that does not exist in the child
        child = os.fork()
        if child == 0:
            counted = completer.n_frames + completer.report.known  # which need no turn
            try:
                completer.push(sea.vertices[2], known)
            except RuntimeError:
                del completer
                os._exit(5)
            os._exit(0)
        codes.add(ends(child))
        time.sleep(0.003)
    over = True
    thread.join()
    assert codes <= {0, 5}, codes
print("all ended")
"""


def test_completers_work_after_a_fork() -> None:
    command = [sys.executable, "-W", "ignore::DeprecationWarning", "-c", FORKS]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    assert (done.stdout, done.stderr) == ("all ended\n", "")


def test_too_many_threads_for_the_system_are_refused() -> None:
    """Runs in an address space without room for so many stacks."""
    script = (
        "import resource, dynmesh, numpy as np\n"
        "arguments = np.array([[0, 1, 2]]), np.eye(3)\n"
        "resource.setrlimit(resource.RLIMIT_AS, (1_500_000_000,) * 2)\n"
        "try:\n"
        "    dynmesh.Completer(*arguments, threads=256)\n"
        "except RuntimeError as error:\n"
        "    print(error)\n"
    )
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    assert re.fullmatch(r"threads: could start only \d+ of 256 threads(: .*)?\n", result.stdout)


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


def convert_in_process(*words: str | Path, code: int = 0) -> str:
    command = [sys.executable, "-m", "dynmesh", "convert", *map(str, words)]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == code, ended.stderr
    assert "Traceback" not in ended.stderr
    return ended.stderr


@pytest.mark.usefixtures("on_such_a_disk")
def test_disks_without_locks_are_read_and_written(tmp_path: Path) -> None:
    pytest.importorskip("h5py")
    dynmesh.write(tmp_path / "in.h5", sea(3))
    source = tmp_path / "in.h5"
    for name in ("a.npz", "b.h5", "c/f_%d.ply"):
        output = tmp_path / name
        for more in ([], ["--overwrite"]):
            assert "its disk has no locks" in convert_in_process(source, output, *more)
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
        assert "is being written by another process" in convert_in_process(*words, code=1)
        process.communicate("\n")
    assert process.returncode == 9
    convert_in_process(*words)
    assert len(dynmesh.read(tmp_path / "out.npz")) == 3
    assert not [*tmp_path.rglob(".*")]
