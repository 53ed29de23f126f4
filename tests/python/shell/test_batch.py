"""Tables of jobs, which run through Dask on this machine or wherever its scheduler has workers."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import to_file
from commands import dynmesh_command as run
from sequences import assert_same, sea

import dynmesh
from dynmesh.cli.jobs import read_jobs

distributed = pytest.importorskip("distributed", reason="distributed is not installed")
dask = pytest.importorskip("dask")


def write_partial(path: Path, n_frames: int = 12, seed: int = 0, grid: int = 20) -> None:
    """Writes an ocean with missing vertices."""
    partial = sea(n_frames, grid, share=0.3, whole=[0], fps=30.0)
    dynmesh.write(path, replace(partial, vertices=partial.vertices + np.float32(seed)))


def wait_until(what: Callable[[], object], seconds: float = 60) -> None:
    """Waits until a condition holds."""
    end = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < end, "in vain"
        time.sleep(0.002)


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a scheduler with two workers."""
    with (
        dask.config.set(temporary_directory=str(tmp_path_factory.mktemp("dask"))),
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address="127.0.0.1:0"
        ) as cluster,
    ):
        yield cluster.scheduler_address


@pytest.mark.parametrize("where", ["here", "at an address"])
def test_ten_jobs_of_which_some_fail(
    where: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    for number in range(7):
        write_partial(tmp_path / f"in{number}.npz", seed=number)
    whole = sea(5, 12)
    dynmesh.write(tmp_path / "sea.obj", whole[:1])
    dynmesh.write(tmp_path / "sea.npz", whole)
    run("degrade", tmp_path / "sea.npz", tmp_path / "scans", "--scan", "--points", "400")
    damaged, missing, scans = (tmp_path / name for name in ("damaged.npz", "none.npz", "scans"))
    damaged.write_bytes((tmp_path / "in0.npz").read_bytes()[:-1000])
    table = tmp_path / "jobs.csv"
    rows = [
        "damaged.npz,,,new/damaged.npz",
        ",scans,sea.obj,tracked.npz",
        "none.npz,,,new/none.npz",
    ]
    rows += [f"in{number}.npz,,,new/out{number}.npz" for number in range(7)]
    table.write_text("\n".join(["input,scans,template,output", *rows]))
    command: list[str | Path] = ["batch", table]
    if where != "here":
        command += ["--scheduler", request.getfixturevalue("scheduler")]
    told = json.loads(run(*command, "--json", code=1).stdout)
    results = {job["input"]: job for job in told["results"]}
    names = [row.removeprefix(",").partition(",")[0] for row in rows]
    assert list(results) == [str(tmp_path / name) for name in names]
    assert f"{damaged}: is damaged" in results[str(damaged)]["reason"]
    failed, tracked = results[str(missing)], results[str(scans)]
    assert (failed["status"], failed["reason"]) == (
        "failed", f"{missing}: No such file or directory"
    )  # fmt: skip
    assert (tracked["status"], tracked["frames"], tracked["reason"]) == ("done", 5, "")
    assert tracked["seconds"] > 0
    alone = tmp_path / "alone.npz"
    to_file.track(scans, alone, template=tmp_path / "sea.obj")
    assert_same(dynmesh.read(tmp_path / "tracked.npz"), dynmesh.read(alone))
    for number in range(7):
        to_file.complete(tmp_path / f"in{number}.npz", alone, overwrite=True)
        assert_same(dynmesh.read(tmp_path / "new" / f"out{number}.npz"), dynmesh.read(alone))

    write_partial(damaged)
    table.write_text("\n".join(table.read_text().splitlines()[:3]))
    assert "1 done, 1 already there, 0 failed" in run(*command).stderr
    assert "2 done, 0 already there, 0 failed" in run(*command, "--overwrite").stderr


def test_a_row_is_a_command_line(tmp_path: Path) -> None:
    table = tmp_path / "jobs.csv"
    table.write_text(
        "input,scans,output,bidirectional,provenance,mask,method,training,threads,start,template,gaps\n"
        'a.npz,,b.npz,no,yes,"a, mask.npy",,one.npz; two.npz,,,,lost\n'
        "c.npz,,d.npz,,,,motion,,,7,,\n"
        ",g,h.npz,,,,,,2,,t.ply,\n",
        encoding="utf-8",
    )
    first, second, tracking = read_jobs(table)
    assert first.arguments == (tmp_path / "a.npz", tmp_path / "b.npz")
    assert first.options == {
        "mask": tmp_path / "a, mask.npy",
        "gaps": "lost",
        "bidirectional": False,
        "provenance": True,
        "training": [tmp_path / "one.npz", tmp_path / "two.npz"],
        "overwrite": False,
    }
    assert second.options == {"method": "motion", "start": 7, "overwrite": False}
    assert (tracking.kind, tracking.arguments) == ("scans", (tmp_path / "g", tmp_path / "h.npz"))
    assert tracking.options == {"template": tmp_path / "t.ply", "threads": 2, "overwrite": False}


@pytest.mark.parametrize("other", ["o.npz", "sub/../o.npz", "linked/o.npz", "link.npz"])
def test_no_two_rows_have_one_output(tmp_path: Path, other: str) -> None:
    (tmp_path / "linked").symlink_to(tmp_path, target_is_directory=True)
    (tmp_path / "link.npz").symlink_to("o.npz")
    table = tmp_path / "jobs.csv"
    table.write_text(f"input,output\na.npz,o.npz\nb.npz,p.npz\nc.npz,{other}\n")
    told = rf"line 4: output: '{other}' is the output of line 2"
    with pytest.raises(ValueError, match=re.escape(told)):
        read_jobs(table)


def test_a_scheduler_that_does_not_answer_is_named(tmp_path: Path) -> None:
    (tmp_path / "jobs.csv").write_text("input,output\na.npz,b.npz\n")
    with dask.config.set({"distributed.comm.timeouts.connect": "0.1s"}):
        words = ("batch", tmp_path / "jobs.csv", "--scheduler", "tcp://127.0.0.1:1")
        told = run(*words, code=1).stderr
    assert "no Dask scheduler answers at tcp://127.0.0.1:1" in told


def children_of(pid: int) -> dict[int, bytes]:
    """The processes that the threads of a process have started, and their command lines."""
    threads = Path(f"/proc/{pid}/task").glob("*/children")
    started = [child for thread in threads for child in thread.read_text().split()]
    return {int(child): Path(f"/proc/{child}/cmdline").read_bytes() for child in started}


@pytest.mark.usefixtures("hearing_interrupts")
def test_workers_may_die_and_end_with_the_command(tmp_path: Path) -> None:
    write_partial(tmp_path / "in.npz", n_frames=60, grid=50)
    table = tmp_path / "jobs.csv"
    table.write_text("input,output\n" + "".join(f"in.npz,out{i}.npz\n" for i in range(100)))
    command = [sys.executable, "-m", "dynmesh", "batch", str(table), "--workers", "2"]
    environment = os.environ | {"TMPDIR": str(tmp_path / "temporary")}
    (tmp_path / "temporary").mkdir()
    with subprocess.Popen(
        command, stderr=subprocess.PIPE, text=True, start_new_session=True, env=environment
    ) as batch:
        wait_until(lambda: len(list(tmp_path.glob(".out*"))) == 2)  # both are at work
        killed = next(pid for pid, words in children_of(batch.pid).items() if b"spawn" in words)
        os.kill(killed, signal.SIGKILL)
        lost = [folder.name.split(".")[1] for folder in tmp_path.glob(".out*")]
        wait_until(lambda: all((tmp_path / f"{name}.npz").exists() for name in lost))
        children = children_of(batch.pid)
        assert len(children) >= 2
        os.killpg(batch.pid, signal.SIGINT)  # as a terminal does
        _, told = batch.communicate(timeout=60)
    assert batch.returncode == 130, told
    wait_until(lambda: not any(Path(f"/proc/{child}").exists() for child in children))
    assert not list((tmp_path / "temporary").iterdir())
    table.write_text("input,output\n" + "".join(f"in.npz,out{i}.npz\n" for i in range(4)))
    run("batch", table, "--overwrite")
    outputs = [(tmp_path / f"out{i}.npz").read_bytes() for i in range(4)]
    assert outputs == [outputs[0]] * 4
