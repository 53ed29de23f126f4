"""Completion of many files by processes that may fail or be killed."""

import contextlib
import csv
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import dynmesh_command as run
from watches import interrupted_after

import dynmesh
from dynmesh.files.lock import unfinished_folder
from dynmesh.jobs.batch import Job, Result, complete_files
from dynmesh.jobs.checkpoint import Checkpoint
from dynmesh.jobs.job_table import read_jobs
from dynmesh.jobs.tracking_job import TrackingJob


def write_partial(
    path: Path, n_frames: int = 12, seed: int = 0, grid: int = 20
) -> dynmesh.Sequence:
    """Writes an ocean with missing vertices; returns its completion."""
    ocean = dynmesh.synth.ocean(n_frames, grid=grid, seed=seed)
    known = np.stack(list(dynmesh.degrade.random_known(n_frames, grid**2, 0.3, seed=seed)))
    dynmesh.write(path, dynmesh.Sequence(ocean.vertices, ocean.faces, known, fps=30.0))
    completed = np.stack(
        list(dynmesh.complete(ocean.faces, ocean.vertices, known, method="detail"))
    )
    return dynmesh.Sequence(completed, ocean.faces, None, fps=30.0)


def check_jobs(folder: Path, n: int) -> tuple[list[Job], list[dynmesh.Sequence]]:
    expected = [write_partial(folder / f"in{i}.npz", seed=i) for i in range(n)]
    return [Job(folder / f"in{i}.npz", folder / f"out{i}.npz") for i in range(n)], expected


def assert_equal(job: Job, expected: dynmesh.Sequence) -> None:
    np.testing.assert_array_equal(dynmesh.read(job.output).vertices, expected.vertices)


@pytest.mark.parametrize("parallel", [False, True])
def test_a_failed_job_does_not_stop_the_others(tmp_path: Path, parallel: bool) -> None:
    jobs, expected = check_jobs(tmp_path, 4)
    jobs[1].input.write_bytes(jobs[1].input.read_bytes()[:-1000])
    seen: list[Result] = []
    with contextlib.ExitStack() as stack:
        executor = None
        if parallel:
            context = get_context("spawn")
            executor = stack.enter_context(ProcessPoolExecutor(2, mp_context=context))
        results = complete_files(jobs, executor, watch=seen.append)
    assert [r.status for r in results] == ["done", "failed", "done", "done"]
    assert "in1.npz: is damaged" in results[1].reason
    assert [r.job for r in results] == jobs
    assert sorted(str(r.job.output) for r in seen) == [str(j.output) for j in jobs]
    for i in (0, 2, 3):
        assert_equal(jobs[i], expected[i])
        assert results[i].frames == 12
    assert not list(tmp_path.glob(".*"))

    write_partial(jobs[1].input, seed=1)
    results = complete_files(jobs)
    assert [r.status for r in results] == ["exists", "done", "exists", "exists"]
    assert_equal(jobs[1], expected[1])
    assert [r.status for r in complete_files(jobs, overwrite=True)] == ["done"] * 4


def test_folders_of_outputs_are_created(tmp_path: Path) -> None:
    expected = write_partial(tmp_path / "in.npz")
    outputs = [tmp_path / "a" / "b" / "out.npz", tmp_path / "c" / "d" / "f_%04d.ply"]
    assert [r.status for r in complete_files(Job(tmp_path / "in.npz", o) for o in outputs)] == [
        "done",
        "done",
    ]
    for output in outputs:
        assert_equal(Job(tmp_path / "in.npz", output), expected)
    in_the_way = Job(tmp_path / "in.npz", tmp_path / "in.npz" / "out.npz")
    (result,) = complete_files([in_the_way])
    assert result.status == "failed"
    assert result.reason == f"{in_the_way.output}: {tmp_path / 'in.npz'} is not a folder"


def test_a_table_is_read(tmp_path: Path) -> None:
    table = tmp_path / "jobs.csv"
    table.write_text(
        "input,output,extra_iterations,disconnected,provenance,mask,fps,revisit,method,noise,"
        "reject_outliers,learn,threads,start,template,gaps,drop_above\n"
        'a.npz,b.npz,3,hold,yes,"a, mask.npy",25,,,,,,,whole,,lost,\n'
        "c.npz,d.npz,,,,,,false,,,,,,7,,,\n"
        "e.npz,f.npz,,,,,,,detail,0.5,true,yes,2,,t.ply,,0.25\n",
        encoding="utf-8",
    )
    first, second, third = read_jobs(table)
    assert first == Job(
        tmp_path / "a.npz",
        tmp_path / "b.npz",
        source={"known": tmp_path / "a, mask.npy", "gaps": "lost"},
        fps=25.0,
        start="whole",
        provenance=True,
        settings={"extra_iterations": 3, "disconnected": "hold"},
    )
    assert second == Job(
        tmp_path / "c.npz", tmp_path / "d.npz", start=7, settings={"revisit": False}
    )
    assert isinstance(third, Job)
    assert (third.start, third.template, third.drop_above) == ("auto", tmp_path / "t.ply", 0.25)
    assert third.settings == {
        "method": "detail",
        "noise": 0.5,
        "reject_outliers": True,
        "learn": True,
        "threads": 2,
    }


def write_scans(folder: Path) -> None:
    """Writes scans of an ocean, damaged scans, and the mesh."""
    sea = dynmesh.synth.ocean(5, grid=12, seed=3)
    dynmesh.write(folder / "sea.obj", dynmesh.Sequence(sea.vertices[:1], sea.faces))
    dynmesh.write(folder / "sea.npz", sea)
    run("degrade", folder / "sea.npz", folder / "scans", "--scan", "--points", "400")
    run("degrade", folder / "sea.npz", folder / "broken", "--scan", "--points", "400")
    (folder / "broken" / "frame_00002.ply").write_bytes(b"ply")


def test_lines_with_scans_are_tracked(tmp_path: Path) -> None:
    write_scans(tmp_path)
    expected = write_partial(tmp_path / "in.npz")
    table, report = tmp_path / "jobs.csv", tmp_path / "report.csv"
    table.write_text(
        "input,scans,output,template,cameras,provenance,scan_unit,template_unit,threads\n"
        "in.npz,,completed.npz,,,,,,\n"
        ",scans,new/tracked.npz,sea.obj,scans/cameras.json,yes,mm,0.001,2\n"
        ",broken,broken.npz,sea.obj,,,,,\n"
    )
    assert read_jobs(table)[1] == TrackingJob(
        tmp_path / "scans",
        tmp_path / "new" / "tracked.npz",
        template=tmp_path / "sea.obj",
        cameras=tmp_path / "scans" / "cameras.json",
        provenance=True,
        scan_unit="mm",
        template_unit=0.001,
        threads=2,
    )
    shown = run("batch", table, "--report", report, "--workers", "2", code=1).stderr
    assert "2 done, 0 already complete, 1 failed of 3 jobs" in shown
    with report.open(newline="") as file:
        lines = {Path(line["output"]).stem: line for line in csv.DictReader(file)}
    frames = {name: line["frames"] for name, line in lines.items()}
    assert frames == {"completed": "12", "tracked": "5", "broken": "0"}
    assert lines["tracked"]["input"] == str(tmp_path / "scans")
    assert "frame_00002.ply" in lines["broken"]["reason"]
    assert_equal(Job(tmp_path / "in.npz", tmp_path / "completed.npz"), expected)
    alone = tmp_path / "alone.npz"
    dynmesh.track_file(
        tmp_path / "scans",
        alone,
        template=tmp_path / "sea.obj",
        provenance=True,
        scan_unit="mm",
        template_unit=0.001,
    )
    assert (tmp_path / "new" / "tracked.npz").read_bytes() == alone.read_bytes()
    assert "0 done, 2 already complete, 1 failed" in run("batch", table, code=1).stderr
    assert "2 done, 0 already complete" in run("batch", table, "--overwrite", code=1).stderr


def test_an_interrupted_tracking_job_is_continued(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Checkpoint, "least_seconds_between", 0.0)
    monkeypatch.setattr(Checkpoint, "most_of_the_time", 1e9)
    write_scans(tmp_path)
    job = TrackingJob(tmp_path / "scans", tmp_path / "out.npz", template=tmp_path / "sea.obj")

    def interrupt(**options: Any) -> None:
        with pytest.raises(KeyboardInterrupt):
            dynmesh.track_file(
                job.input, job.output, template=job.template, watch=interrupted_after(2), **options
            )
        assert (unfinished_folder(job.output) / "checkpoint.npz").exists()

    whole = tmp_path / "whole.npz"
    dynmesh.track_file(job.input, whole, template=job.template)
    interrupt()
    seen: list[tuple[int, bool]] = []
    track = TrackingJob.track

    def spied(self: TrackingJob, **options: Any) -> Any:
        report = track(self, **options)
        seen.append((report.resumed_at, report.existed))
        return report

    monkeypatch.setattr(TrackingJob, "track", spied)
    (result,) = complete_files([job])
    assert (result.status, result.frames) == ("done", 5)
    assert job.output.read_bytes() == whole.read_bytes()
    assert not unfinished_folder(job.output).exists()
    assert complete_files([job])[0].status == "exists"
    job.output.unlink()
    interrupt(provenance=True)  # as if the table had changed since
    assert complete_files([job])[0].status == "done"
    assert job.output.read_bytes() == whole.read_bytes()
    assert seen == [(2, False), (5, True), (0, False)]


def test_a_job_that_cannot_be_continued_starts_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Checkpoint, "least_seconds_between", 0.0)
    monkeypatch.setattr(Checkpoint, "most_of_the_time", 1e9)
    write_partial(tmp_path / "in.npz")
    job = Job(tmp_path / "in.npz", tmp_path / "out.npz", retime=15.0)
    with pytest.raises(KeyboardInterrupt):
        dynmesh.complete_file(job.input, job.output, watch=interrupted_after(2))
    assert [result.status for result in complete_files([job])] == ["done"]
    assert [result.status for result in complete_files([job])] == ["exists"]


def test_the_report_lists_every_job(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    jobs, _ = check_jobs(tmp_path, 2)
    dynmesh.write(jobs[1].output, dynmesh.read(jobs[1].input))
    table, report = tmp_path / "jobs.csv", tmp_path / "report.csv"
    table.write_text('input,output\nin0.npz,out0.npz\nin1.npz,out1.npz\n"no,ne.npz",out2.npz\n')
    run("batch", table, "--report", report, code=1)
    with report.open(newline="") as file:
        lines = list(csv.DictReader(file))
    assert [line["status"] for line in lines] == ["done", "exists", "failed"]
    assert [line["frames"] for line in lines] == ["12", "12", "0"]
    assert [line["reason"] for line in lines[:2]] == ["", "kept from an earlier run"]
    assert lines[2]["input"] == str(tmp_path / "no,ne.npz")
    assert lines[2]["reason"] == f"{tmp_path / 'no,ne.npz'}: No such file or directory"
    assert lines[0]["output"] == str(jobs[0].output)
    assert float(lines[0]["seconds"]) > 0
    run("batch", table, "--report", report, code=1)  # again: what the first run knew remains
    with report.open(newline="") as file:
        again = list(csv.DictReader(file))
    kept = {"status": "exists", "reason": "kept from an earlier run"}
    assert again[:2] == [lines[0] | kept, lines[1]]
    run("batch", table, "--report", table.with_name("other.csv"), code=1)
    with table.with_name("other.csv").open(newline="") as file:
        assert next(csv.DictReader(file)) == lines[0] | kept | {"seconds": "0.000"}
    report.write_bytes(b"\xff,output\n")  # no report
    run("batch", table, "--report", report, code=1)
    with report.open(newline="") as file:
        assert next(csv.DictReader(file)) == lines[0] | kept | {"seconds": "0.000"}
    before = table.read_bytes()
    assert "is the table of jobs" in run("batch", table, "--report", table, code=1).stderr
    assert table.read_bytes() == before
    monkeypatch.setattr(sys.modules["dynmesh.cli.batch"], "_patience", "0.5s")
    error = run("batch", table, "--scheduler", "tcp://127.0.0.1:1", code=1).stderr
    assert "--scheduler: no Dask scheduler answers at tcp://127.0.0.1:1" in error


def test_messages_name_the_columns_of_the_table(tmp_path: Path) -> None:
    for number in (0, 1, 3):
        write_partial(tmp_path / "scans" / f"f_{number}.ply", 1)
    write_partial(tmp_path / "in.npz", 2)
    table, report = tmp_path / "jobs.csv", tmp_path / "report.csv"
    table.write_text("input,output,to_unit\nin.npz,a.npz,mm\nscans,b.npz,\n")
    printed = run("batch", table, "--report", report, code=1).stderr
    for told in (" ".join(printed.split()), report.read_text()):
        assert "to_unit: the file states no unit of length: the column unit says it" in told
        assert "without observations by 'lost' in the column gaps; or, if" in told


@contextlib.contextmanager
def dask_cluster(folder: Path) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A Dask scheduler and two workers, each in a separate process on this machine."""
    distributed = pytest.importorskip("distributed", reason="distributed is not installed")
    address_file = folder / "scheduler.json"
    common = ["--no-dashboard", "--scheduler-file", str(address_file)]
    with contextlib.ExitStack() as stack:
        log = stack.enter_context((folder / "dask.log").open("wb"))

        def start(*arguments: str) -> subprocess.Popen[bytes]:
            command = [sys.executable, "-m", "dask", *arguments, *common]
            process = subprocess.Popen(command, stdout=log, stderr=log, cwd=folder)
            stack.callback(process.wait)
            stack.callback(process.kill)
            return process

        start("scheduler", "--host", "127.0.0.1", "--port", "0")
        # It exists before it has its content.
        wait_until(lambda: address_file.exists() and address_file.read_text().endswith("}"))
        one = ["worker", "--host", "127.0.0.1", "--nthreads", "1", "--no-nanny"]
        workers = [start(*one) for _ in range(2)]
        address = json.loads(address_file.read_text())["address"]
        with distributed.Client(address) as client:
            client.wait_for_workers(2)  # one alone might be done before the other is there
        yield address, workers


def wait_until(what: object, seconds: float = 60) -> None:
    """Waits until a condition holds."""
    assert callable(what)
    end = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < end, "in vain"
        time.sleep(0.002)


def test_a_worker_may_die_in_the_middle(tmp_path: Path) -> None:
    n, n_frames = 8, 20  # so many that two of them meet, also on a loaded machine
    walker = dynmesh.synth.walker(n_frames)
    known = np.stack(list(dynmesh.degrade.random_known(n_frames, 10002, 0.3, seed=0)))
    partial = dynmesh.Sequence(walker.vertices, walker.faces, known, fps=30.0)
    dynmesh.write(tmp_path / "in.npz", partial)
    expected = np.stack(
        list(dynmesh.complete(walker.faces, walker.vertices, known, method="detail"))
    )
    table = tmp_path / "jobs.csv"
    table.write_text("input,output\n" + "".join(f"in.npz,out{i}.npz\n" for i in range(n)))
    with dask_cluster(tmp_path) as (address, workers):
        command = [sys.executable, "-m", "dynmesh", "batch", str(table), "--scheduler", address]
        batch = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        wait_until((tmp_path / "out0.npz").exists)
        wait_until(lambda: len(list(tmp_path.glob(".out*"))) == 2)  # both are in the middle
        workers[0].send_signal(signal.SIGKILL)
        _, shown = batch.communicate(timeout=120)
    assert batch.returncode == 0, shown
    # An output that the killed worker finished, but did not report, counts as already complete.
    done, there = re.search(r"(\d+) done, (\d+) already complete, 0 failed", shown).groups()  # type: ignore[union-attr]
    assert int(done) + int(there) == n
    for i in range(n):
        np.testing.assert_array_equal(dynmesh.read(tmp_path / f"out{i}.npz").vertices, expected)
    assert not list(tmp_path.glob(".out*"))


def running(pid: int) -> bool:
    try:
        stat = Path(f"/proc/{pid}/stat").read_text()
    except (FileNotFoundError, ProcessLookupError):  # the latter if it ends while one reads
        return False
    return stat.rpartition(")")[2].split()[0] not in "XZ"


def is_tracker(pid: str) -> bool:
    """Whether a process is the one that Python starts to clean up behind the others."""
    return b"resource_tracker" in Path(f"/proc/{pid}/cmdline").read_bytes()


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="Linux alone tells of children")
@pytest.mark.usefixtures("hearing_interrupts")
@pytest.mark.parametrize(
    ("how", "workers", "what", "code"),
    [
        (signal.SIGINT, 1, "interrupted", 130),
        (signal.SIGINT, 2, "interrupted", 130),
        (signal.SIGTERM, 2, "terminated", 143),
        (signal.SIGKILL, 2, "", -signal.SIGKILL),
    ],
)
def test_the_workers_of_a_command_end_with_it(
    tmp_path: Path, how: signal.Signals, workers: int, what: str, code: int
) -> None:
    expected = write_partial(tmp_path / "in.npz", n_frames=60, grid=50)
    table = tmp_path / "jobs.csv"
    rows = [f"in.npz,out{i}.npz,detail\n" for i in range(100)]
    table.write_text("".join(["input,output,method\n", *rows]))
    command = [sys.executable, "-m", "dynmesh", "batch", str(table), "--workers", str(workers)]
    with subprocess.Popen(
        command, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as batch:
        wait_until(lambda: len(list(tmp_path.glob(".out*"))) == workers)  # all are at work
        children = Path(f"/proc/{batch.pid}/task/{batch.pid}/children").read_text().split()
        # Asked now, since a process that is about to end has no command line.
        at_work = [child for child in children if not is_tracker(child)]
        if how == signal.SIGINT:
            os.killpg(batch.pid, how)  # as a terminal does
        else:
            batch.send_signal(how)
        batch.wait(60)
        left = [child for child in at_work if running(int(child))]
        _, told = batch.communicate(timeout=60)
    if how != signal.SIGKILL:
        assert not left  # workers do not outlive a command that can end them
        assert told == f"{what}; run the command again to continue\n"
    assert batch.returncode == code
    assert len(children) == (workers + 1 if workers > 1 else 0)
    wait_until(lambda: not any(running(int(child)) for child in children))
    table.write_text("".join(["input,output,method\n", *rows[:workers]]))
    run("batch", table)  # completes what was left
    for i in range(workers):
        assert_equal(Job(tmp_path / "in.npz", tmp_path / f"out{i}.npz"), expected)
        assert not list(tmp_path.glob(f".out{i}.*"))


@pytest.mark.parametrize(
    ("one", "other", "options"),
    [
        ("o.npz", "o.npz", {}),
        ("o.npz", "sub/../o.npz", {}),
        ("o.npz", "linked/o.npz", {}),
        ("o.npz", "link.npz", {}),
        ("link.npz", "o.npz", {}),
        ("o.npy", "o.known.npy", {}),
        ("o.generation.npy", "o.npy", {}),
        ("o.obj", "o.pc2", {}),
        ("q/%04d.ply", "q/%05d.ply", {}),
        ("q/%d.ply", "q/12.ply", {}),
        ("q/12.ply", "sub/../q/%d.ply", {}),
        ("q/frame_%04d.ply", "q", {"output_format": "ply"}),
        ("q/f%04d.ply", "q/f1%04d.ply", {}),
        ("q/f%02d.ply", "q/f%02d8.ply", {}),
    ],
)
def test_no_two_jobs_write_the_same_file(
    tmp_path: Path, one: str, other: str, options: dict[str, Any]
) -> None:
    (tmp_path / "linked").symlink_to(tmp_path, target_is_directory=True)
    (tmp_path / "link.npz").symlink_to("o.npz")
    jobs = [Job(Path("in.npz"), tmp_path / one), Job(Path("in.npz"), tmp_path / other, **options)]
    for both in (jobs, jobs[::-1]):
        last = re.escape(str(both[1].output))
        with pytest.raises(ValueError, match=rf"^{last}: is the output of more than one job"):
            complete_files(both)


@pytest.mark.parametrize(
    "outputs",
    [
        ("o.npz", "sub/o.npz", "o%04d.npz", "o0001.npz", "o.h5"),
        ("o.npy", "o.known.npz", "oo.npy", "o.pc2", "sub/o.pc2"),
        ("q/walk1%04d.ply", "q/walk2%04d.ply", "q/walk%04d_1.ply", "r/walk1%04d.ply", "q/1.ply"),
        ("q/f%02d_8.ply", "q/f%02d_88.ply", "q/%02d.obj", "q/%02d.ply"),
        ("o.unknown", "no_suffix", "q/%04d_%04d.ply", "q/*.ply"),
    ],
)
def test_jobs_that_write_different_files_are_run(tmp_path: Path, outputs: tuple[str, ...]) -> None:
    jobs = [Job(tmp_path / "missing.npz", tmp_path / output) for output in outputs]
    results = complete_files(jobs)
    assert [result.status for result in results] == ["failed"] * len(jobs)
    assert not any("more than one" in result.reason for result in results)
