"""Tables of jobs, each of which runs as a command."""

import csv
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import to_file
from commands import dynmesh_command as run
from sequences import assert_same, sea

import dynmesh
from dynmesh.cli import jobs as running
from dynmesh.cli.jobs import read_jobs


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


def test_ten_jobs_of_which_some_fail(tmp_path: Path) -> None:
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
    told = json.loads(run(*command, "--json", code=1).stdout)
    results = {job["input"]: job for job in told["results"]}
    names = [row.removeprefix(",").partition(",")[0] for row in rows]
    assert list(results) == [str(tmp_path / name) for name in names]
    assert "damaged.npz: is damaged" in results[str(damaged)]["reason"]
    failed, tracked = results[str(missing)], results[str(scans)]
    assert (failed["status"], failed["reason"]) == (
        "failed", "none.npz: No such file or directory"
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
        "input,scans,output,bidirectional,provenance,mask,method,training,threads,start,template,"
        "gaps,prim\n"
        'a.npz,,b.npz,no,yes,"a, mask.npy",,one.npz; two.npz,,,,lost,\n'
        "c.usd,,d.usd,,,,motion,,,7,,,/a; /b\n"
        ",g,h.npz,,,,,,2,,t.ply,,\n",
        encoding="utf-8",
    )
    first, second, tracking = (job.words for job in read_jobs(table))
    assert first == (
        "complete", "--bidirectional=no", "--provenance=yes", "--mask=a, mask.npy",
        "--training=one.npz", "--training=two.npz", "--gaps=lost", "--", "a.npz", "b.npz"
    )  # fmt: skip
    assert second == (
        "complete", "--method=motion", "--start=7", "--prim=/a", "--prim=/b", "--", "c.usd", "d.usd"
    )  # fmt: skip
    assert tracking == ("track", "--threads=2", "--template=t.ply", "--", "g", "h.npz")


@pytest.mark.parametrize("other", ["o.npz", "sub/../o.npz", "linked/o.npz", "link.npz"])
def test_no_two_rows_have_one_output(tmp_path: Path, other: str) -> None:
    (tmp_path / "linked").symlink_to(tmp_path, target_is_directory=True)
    (tmp_path / "link.npz").symlink_to("o.npz")
    table = tmp_path / "jobs.csv"
    table.write_text(f"input,output\na.npz,o.npz\nb.npz,p.npz\nc.npz,{other}\n")
    told = f"line 4: output: '{tmp_path / other.removeprefix('sub/../')}' is the output of line 2"
    with pytest.raises(ValueError, match=re.escape(told)):
        read_jobs(table)


PLAIN = "input,output,training,start\na.npz,b.npz,c.npz;d e.npz,2\nf.npz,g.npz,,\n"
WRITTEN = {
    "spaces": "input , output,\ttraining ,start\n a.npz, b.npz , c.npz ; d e.npz,\t2\n"
    "f.npz, g.npz, ,\n",
    "a mark and line ends": "\ufeff" + PLAIN.replace("\n", "\r\n"),
    "quotes": '"input","output",training,start\na.npz, "b.npz","c.npz;d e.npz",2\n'
    '"f.npz",g.npz,,\n',
    "empty lines": "\n" + PLAIN.replace("\n", "\n\n ,,,\n"),
    "comments": "# of monday\n" + PLAIN.replace("\n", "\n  # a.npz,h.npz\n"),
}


@pytest.mark.parametrize("how", WRITTEN)
def test_tables_as_people_write_them(tmp_path: Path, how: str) -> None:
    table = tmp_path / "jobs.csv"
    table.write_text(PLAIN, encoding="utf-8")
    expected = [job._replace(line=0) for job in read_jobs(table)]
    table.write_bytes(WRITTEN[how].encode())
    assert [job._replace(line=0) for job in read_jobs(table)] == expected
    assert {"--training=c.npz", "--training=d e.npz"} <= {*expected[0].words}


def test_what_exists_needs_no_workers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("o.npz").symlink_to("lost.npz")
    Path("p_0001.ply").write_text("precious")
    Path("jobs.csv").write_text("input,output\nNone.npz,o.npz\nb.npz,p_%04d.ply\n")
    monkeypatch.setattr(running, "_made", None)
    assert "0 done, 2 already there, 0 failed of 2" in run("batch", "jobs.csv").stderr
    Path("o.npz.doubtful.txt").write_text("it is odd")
    for _ in range(2):  # the table of an earlier run is replaced, no other file
        said = run("batch", "jobs.csv", "--csv", "q.csv", code=3).stderr.splitlines()
        assert [line.split()[1:3] for line in said[-3:-1]] == [
            ["o.npz", "doubtful"], ["p_%04d.ply", "good"]
        ]  # fmt: skip
        with Path("q.csv").open() as file:
            rows = list(csv.DictReader(file))
        assert [row["quality"] for row in rows] == ["doubtful", "good"]
        assert rows[0]["reason"] == "it is odd"
    before = Path("jobs.csv").read_text()
    assert "exists already" in run("batch", "jobs.csv", "--csv", "jobs.csv", code=1).stderr
    assert Path("jobs.csv").read_text() == before


def children_of(pid: int) -> list[int]:
    """The processes that the threads of a process have started."""
    threads = Path(f"/proc/{pid}/task").glob("*/children")
    return [int(child) for thread in threads for child in thread.read_text().split()]


@pytest.mark.usefixtures("hearing_interrupts")
def test_a_job_may_be_killed_and_all_end_with_the_command(tmp_path: Path) -> None:
    write_partial(tmp_path / "in.npz", n_frames=60, grid=50)
    table = tmp_path / "jobs.csv"
    table.write_text("input,output\n" + "".join(f"in.npz,out{i}.npz\n" for i in range(100)))
    command = [sys.executable, "-m", "dynmesh", "batch", str(table), "--workers", "2"]
    with subprocess.Popen(
        command, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as batch:
        wait_until(lambda: len(list(tmp_path.glob(".out*"))) == 2)  # both are at work
        killed, _ = children_of(batch.pid)
        os.kill(killed, signal.SIGKILL)
        wait_until(lambda: len([*tmp_path.glob("out*.npz")]) > 2)
        children = children_of(batch.pid)
        os.killpg(batch.pid, signal.SIGINT)  # as a terminal does
        _, told = batch.communicate(timeout=60)
    assert batch.returncode == 130, told
    wait_until(lambda: not any(Path(f"/proc/{child}").exists() for child in children))
    table.write_text("input,output\n" + "".join(f"in.npz,out{i}.npz\n" for i in range(4)))
    run("batch", table)
    outputs = [(tmp_path / f"out{i}.npz").read_bytes() for i in range(4)]
    assert outputs == [outputs[0]] * 4
