"""One completer in many threads, one in each, and completers in forked processes."""

import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from meshes import sheet, turned

import dynmesh

MESH = sheet(60)
FRAME = turned(MESH.vertices, 0.1)
KNOWN = np.random.default_rng(0).random(len(FRAME)) < 0.2


def test_a_call_from_a_thread_succeeds_or_is_refused() -> None:
    completer, alone = (dynmesh.Completer(MESH.faces, MESH.vertices) for _ in range(2))

    def push(_: int) -> bool:
        try:
            completer.push(FRAME, KNOWN)
        except RuntimeError as error:
            assert "this completer is in use by another thread" in str(error)  # noqa: PT017
            return False
        return True

    with ThreadPoolExecutor(4) as pool:
        pushed = sum(pool.map(push, range(200)))
    for _ in range(pushed):
        alone.push(FRAME, KNOWN)
    assert completer.state() == alone.state()


FORKS = """
import os, sys, threading, time
import numpy as np
import dynmesh
from dynmesh import _core

# A forked child has no other threads, however long a call waits.
_core._set_task_sharing(chunk=64, short_chunk=64, fewest_pieces=2, patience=1000)
sea = dynmesh.synth.ocean(6, grid=60, seed=1)
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
    pieces = _core._pieces_done_by_others()
    for _ in range(5):  # an idle completer works in the child and is destroyed there
        child = os.fork()
        if child == 0:
            got = [completer.push(frame, known) for frame in sea.vertices[2:]]
            same = np.array_equal(got, expected)
            was_alone = _core._pieces_done_by_others() == pieces
            del completer
            os._exit(3 if not same else 4 if not was_alone else 0)
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
    assert _core._pieces_done_by_others() > pieces
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
