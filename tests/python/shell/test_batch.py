"""Tables of jobs, each of which is a process."""

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
from dynmesh.cli.job_table import read_jobs


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
    command = ("batch", table)
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
    first, second, tracking = read_jobs(table)
    assert first.words == (
        "complete", f"{tmp_path}/a.npz", f"{tmp_path}/b.npz", "--bidirectional=no",
        "--provenance=yes", "--mask=a, mask.npy", "--training=one.npz", "--training=two.npz",
        "--gaps=lost", "--json",
    )  # fmt: skip
    names = ("a.npz", "a, mask.npy", "one.npz", "two.npz")
    assert {*first.reads} >= {tmp_path / name for name in names}
    assert second.words[3:-1] == ("--method=motion", "--start=7", "--prim=/a", "--prim=/b")
    assert (tracking.input, tracking.output) == (tmp_path / "g", tmp_path / "h.npz")
    assert tracking.words[3:-1] == ("--threads=2", "--template=t.ply")


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
    expected = [replace(job, line=0) for job in read_jobs(table)]
    table.write_bytes(WRITTEN[how].encode())
    assert [replace(job, line=0) for job in read_jobs(table)] == expected
    assert expected[0].words[3:5] == ("--training=c.npz", "--training=d e.npz")


NEEDED = {
    "a file": ("s/o.npz", "s/../s/o.npz"),
    "a pattern": ("s/o_%04d.ply", "s/o_####.ply"),
    "a pattern in a folder": ("s/o_%04d.ply", "s"),
    "a folder": ("s/new", "s/new"),
}


@pytest.mark.parametrize("how", NEEDED)
def test_a_job_comes_after_what_it_reads(tmp_path: Path, how: str) -> None:
    output, read = NEEDED[how]
    (tmp_path / "s").mkdir()
    (tmp_path / "linked").symlink_to("s")
    table = tmp_path / "jobs.csv"
    rows = f"{read},z.npz,\nb.npz,y.npz,{read}\na.npz,{output},\n"
    rows += "t/p_%04d.ply,t/q_%04d.ply,\nt/r_%04d.ply,t/u_%04d.ply,"
    table.write_text(f"input,output,template\n{rows}\n")
    assert [job.needs for job in read_jobs(table)] == [(2,), (2,), (), (), ()]


def test_jobs_that_need_one_another_are_refused(tmp_path: Path) -> None:
    table = tmp_path / "jobs.csv"
    table.write_text("input,output\na.npz,b.npz\nx.npz,y.npz\nb.npz,c.npz\nc.npz,a.npz\n")
    with pytest.raises(ValueError, match=r"lines 2, 4 and 5: each needs the output of another"):
        read_jobs(table)
    table.write_text("input,output\na.npz,b.npz\nx.npz,./x.npz\n")
    with pytest.raises(ValueError, match=r"line 3: output: is a file that the same job reads"):
        read_jobs(table)


def test_a_chain_runs_in_its_order_and_stops_where_it_breaks(tmp_path: Path) -> None:
    folder = tmp_path / "None of it"
    write_partial(folder / "a.npz")
    table = folder / "jobs.csv"
    rows = ["c.npz,d.npz", "b.npz,c.npz", "lost.npz,x.npz", "a.npz,b.npz", "y.npz,z.npz"]
    table.write_text("\n".join(["input,output", *rows, "x.npz,y.npz"]))
    command = ("batch", table)
    told = json.loads(run(*command, "--json", code=1).stdout)
    states = [(Path(job["output"]).stem, job["status"]) for job in told["results"]]
    not_run = "not run"
    assert states == [
        ("d", "done"), ("c", "done"), ("x", "failed"), ("b", "done"), ("z", not_run), ("y", not_run)
    ]  # fmt: skip
    assert f"needs {folder / 'y.npz'}" in told["results"][4]["reason"]
    write_partial(folder / "lost.npz")
    assert "3 done, 3 already there, 0 failed of 6" in run(*command).stderr


def test_what_exists_needs_no_workers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("o.npz").symlink_to("lost.npz")
    Path("p_0001.ply").write_text("precious")
    Path("jobs.csv").write_text("input,output\nNone.npz,o.npz\nb.npz,p_%04d.ply\n")
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


def children_of(pid: int) -> dict[int, bytes]:
    """The processes that the threads of a process have started, and their command lines."""
    threads = Path(f"/proc/{pid}/task").glob("*/children")
    started = [child for thread in threads for child in thread.read_text().split()]
    return {int(child): Path(f"/proc/{child}/cmdline").read_bytes() for child in started}


@pytest.mark.usefixtures("hearing_interrupts")
def test_jobs_may_die_and_end_with_the_command(tmp_path: Path) -> None:
    write_partial(tmp_path / "in.npz", n_frames=60, grid=50)
    table = tmp_path / "jobs.csv"
    table.write_text("input,output\n" + "".join(f"in.npz,out{i}.npz\n" for i in range(100)))
    command = [sys.executable, "-m", "dynmesh", "batch", str(table), "--workers", "2"]
    with subprocess.Popen(
        command, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as batch:
        wait_until(lambda: len(list(tmp_path.glob(".out*"))) == 2)  # both are at work
        killed, words = next(iter(children_of(batch.pid).items()))
        os.kill(killed, signal.SIGKILL)
        name = next(
            name for name in words.decode().split("\0") if name.endswith("npz") and "out" in name
        )
        wait_until(lambda: len(list(tmp_path.glob("out*.npz"))) >= 2)
        assert not Path(name).exists()
        children = children_of(batch.pid)
        os.killpg(batch.pid, signal.SIGINT)  # as a terminal does
        _, told = batch.communicate(timeout=60)
    assert batch.returncode == 130, told
    wait_until(lambda: not any(Path(f"/proc/{child}").exists() for child in children))
    table.write_text("input,output\n" + "".join(f"in.npz,out{i}.npz\n" for i in range(4)))
    run("batch", table, "--overwrite")
    outputs = [(tmp_path / f"out{i}.npz").read_bytes() for i in range(4)]
    assert outputs == [outputs[0]] * 4
