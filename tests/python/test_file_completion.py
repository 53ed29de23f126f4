"""Completion from file to file, interrupted and resumed."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import dynmesh_command as run
from watches import interrupted_after

import dynmesh
from dynmesh import cli, files
from dynmesh.files.lock import unfinished_folder
from dynmesh.jobs.checkpoint import Checkpoint, OtherJobError
from dynmesh.jobs.directions import Watch
from dynmesh.jobs.file_completion import complete_file

RESUMABLE = ["npz", "npy", "hdf5", "ply", "obj", "pc2"]


@pytest.fixture(scope="module")
def partial(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An ocean with missing vertices."""
    path = tmp_path_factory.mktemp("partial") / "partial.npz"
    ocean = dynmesh.synth.ocean(30, grid=20, seed=3)
    known = np.stack(list(dynmesh.degrade.random_known(30, 400, 0.3, seed=1)))
    dynmesh.write(path, dynmesh.Sequence(ocean.vertices, ocean.faces, known, fps=30.0))
    return path


@pytest.fixture
def eager(monkeypatch: pytest.MonkeyPatch) -> None:
    """Saves a checkpoint after every frame."""
    monkeypatch.setattr(Checkpoint, "least_seconds_between", 0.0)
    monkeypatch.setattr(Checkpoint, "most_of_the_time", 1e9)


def output_path(folder: Path, format: str) -> Path:
    """Returns a path for a sequence of this format."""
    suffix = files.formats[format].suffixes[0]
    if format in ("ply", "obj"):
        return folder / "new" / f"frame_%04d{suffix}"
    return folder / f"out{suffix}"


def files_in(folder: Path) -> dict[Path, tuple[int, int, int]]:
    """Returns what changes when a file is written or replaced."""
    found = {path: path.stat() for path in folder.rglob("*")}
    return {path: (one.st_ino, one.st_size, one.st_mtime_ns) for path, one in found.items()}


@pytest.mark.usefixtures("eager")
@pytest.mark.parametrize("format", RESUMABLE)
def test_a_resumed_run_equals_an_uninterrupted_one(
    tmp_path: Path, partial: Path, format: str
) -> None:
    whole, resumed = tmp_path / "whole", tmp_path / "resumed"
    whole.mkdir()
    resumed.mkdir()
    output = output_path(resumed, format)
    complete_file(partial, output_path(whole, format))
    for stop in (7, 19):
        with pytest.raises(KeyboardInterrupt):
            complete_file(partial, output, resume=True, watch=interrupted_after(stop))
        assert not files.target_of(output, format).existing()
        assert unfinished_folder(output).exists()
    report = complete_file(partial, output, resume=True)
    assert report.resumed_at == 19
    expected = {path.name: path.read_bytes() for path in whole.rglob("*") if path.is_file()}
    got = {path.name: path.read_bytes() for path in resumed.rglob("*") if path.is_file()}
    assert expected.keys() == got.keys()
    one, other = dynmesh.read(output_path(whole, format)), dynmesh.read(output)
    np.testing.assert_array_equal(one.vertices, other.vertices)
    assert one.fps == other.fps


def pressing_after(*moments: int) -> Watch:
    """Passes frames on, and presses Ctrl+C before these."""

    def watch(frames: Iterator[Any], _: int, done: int) -> Iterator[Any]:
        for number, frame in enumerate(frames, done):
            if number in moments:
                signal.raise_signal(signal.SIGINT)
            yield frame

    return watch


@pytest.mark.usefixtures("hearing_interrupts")
@pytest.mark.parametrize("start", [0, 20])
def test_an_early_interrupt_keeps_every_frame(tmp_path: Path, start: int) -> None:
    """Long before the first checkpoint is due; the frame that was being completed is finished."""
    ocean = dynmesh.synth.ocean(30, grid=8, seed=3)
    known = np.random.default_rng(1).random((30, 64)) < 0.4
    known[start] = True
    partial, output, whole = (tmp_path / f"{name}.npz" for name in ("in", "out", "whole"))
    dynmesh.write(partial, dynmesh.Sequence(ocean.vertices, ocean.faces, known))
    complete_file(partial, whole, start=start)
    for resumed_at in (5, 25):
        with pytest.raises(KeyboardInterrupt):
            complete_file(
                partial, output, start=start, resume=True, watch=pressing_after(resumed_at - 1)
            )
    assert complete_file(partial, output, start=start, resume=True).resumed_at == 25
    assert output.read_bytes() == whole.read_bytes()


@pytest.mark.usefixtures("hearing_interrupts")
def test_interrupts_that_cannot_wait(tmp_path: Path, partial: Path) -> None:
    """The second one at the same frame, one beside an error, and one that a program handles."""
    output = tmp_path / "out.npz"
    heard = []

    def twice(frames: Iterator[Any], *_: int) -> Iterator[Any]:
        yield next(frames)
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)
        heard.append("nothing")

    def failing(frames: Iterator[Any], *_: int) -> Iterator[Any]:
        signal.raise_signal(signal.SIGINT)
        raise ValueError("no")
        yield next(frames)

    for watch in (twice, failing):
        with pytest.raises(KeyboardInterrupt):
            complete_file(partial, output, watch=watch)
        assert list(tmp_path.iterdir()) == []
    signal.signal(signal.SIGINT, lambda *_: heard.append("a signal"))
    assert complete_file(partial, output, watch=pressing_after(3)).frames == 30
    assert heard == ["a signal"]


@pytest.mark.usefixtures("eager")
def test_another_job_is_not_mixed_in(tmp_path: Path, partial: Path) -> None:
    output = tmp_path / "out.npz"
    with pytest.raises(KeyboardInterrupt):
        complete_file(partial, output, overwrite=True, watch=interrupted_after(5))
    os.utime(partial)
    rewritten = rf"is of another job: input changed \({partial} was written again\); run with"
    with pytest.raises(OtherJobError, match=rewritten):
        complete_file(partial, output, overwrite=True, resume=True)
    assert complete_file(partial, output, overwrite=True).resumed_at == 0
    assert [path.name for path in tmp_path.iterdir()] == ["out.npz"]


@pytest.mark.usefixtures("eager")
def test_the_command_says_which_option_of_an_unfinished_output_differs(
    tmp_path: Path,
    partial: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    out, other = tmp_path / "out.npz", tmp_path / "other.npz"
    other.write_bytes(partial.read_bytes())
    assert shell(monkeypatch, "complete", partial, out, "--noise", "0.1", interrupt=7) == 130
    kept = files_in(tmp_path)
    for source, options, what in (
        (partial, (), "noise changed (it was 0.1, now it is not given)"),
        (partial, ("--noise", "0.2"), "noise changed (it was 0.1, now it is 0.2)"),
        (
            partial,
            ("--noise", "0.1", "--method", "motion"),
            "method changed (it was detail, now it is motion)",
        ),
        (partial, ("--noise", "0.1", "--provenance"), "provenance changed (it was false, now"),
        (partial, ("--noise", "0.1", "--uncertainty"), "uncertainty changed (it was false, now"),
        (
            partial,
            ("--noise", "0.1", "--template", other),
            f"template changed (it was not given, now it is {other})",
        ),
        (other, ("--noise", "0.1"), f"input changed (it was {partial}, now it is {other})"),
    ):
        shown = run("complete", source, out, "--resume", *options, code=1).stderr
        assert what in shown
        assert "run with --overwrite to start again, or write another output" in shown
    assert files_in(tmp_path) == kept
    capfd.readouterr()
    # A path from elsewhere is the same file.
    monkeypatch.chdir(partial.parent)
    assert complete_file(partial.name, out, resume=True, noise=0.1).resumed_at == 7


@pytest.mark.parametrize("format", RESUMABLE)
def test_a_complete_output_of_another_job_is_not_taken_for_done(
    tmp_path: Path, partial: Path, format: str
) -> None:
    output = output_path(tmp_path, format)
    complete_file(partial, output, fps=30.0)
    before = files_in(tmp_path)
    keeps = format in ("npz", "hdf5", "npy", "ply")
    for options, what in (
        ({"provenance": True}, r"provenance changed \(it was false, now it is true\)"),
        ({"drop_above": 0.1}, r"drop_above changed \(it was not given, now it is given\)"),
    ):
        if keeps:
            with pytest.raises(OtherJobError, match=rf"complete, but of another job: {what}; run"):
                complete_file(partial, output, resume=True, fps=30.0, **options)
        else:  # the file cannot tell
            assert complete_file(partial, output, resume=True, fps=30.0, **options).existed
    if format in ("npz", "hdf5"):
        with pytest.raises(OtherJobError, match=r"fps changed \(it was 30\.0, now it is 25\.0\)"):
            complete_file(partial, output, resume=True, fps=25.0)
    report = complete_file(partial, output, resume=True, fps=30.0)
    assert report.existed
    assert (report.frames, report.resumed_at, report.seconds_per_frame) == (30, 30, None)
    assert files_in(tmp_path) == before


def test_a_complete_output_without_errors_or_of_other_faces_is_of_another_job(
    tmp_path: Path, partial: Path
) -> None:
    output, turned = tmp_path / "out.npz", tmp_path / "turned.npz"
    complete_file(partial, output, provenance=True)
    sequence = dynmesh.read(partial)
    dynmesh.write(turned, replace(sequence, faces=sequence.faces[::-1].copy(), polygons=None))
    options = ("--resume", "--provenance")
    shown = run("complete", partial, output, *options, "--uncertainty", code=1).stderr
    assert "uncertainty changed (it was false, now it is true)" in shown
    assert "run with --overwrite to make it anew, or write another output" in shown
    assert "faces changed" in run("complete", turned, output, *options, code=1).stderr
    assert "already complete" in run("complete", partial, output, *options).stderr
    stored = dynmesh.read(output)
    bars = np.ones(stored.vertices.shape[:2], np.float32)
    dynmesh.write(output, replace(stored, standard_error=bars, standard_error_of="surface"))
    shown = run("complete", partial, output, *options, "--uncertainty", code=1).stderr
    assert "standard errors changed (it was surface, now it is position)" in shown


@pytest.mark.usefixtures("eager")
def test_a_job_is_resumed_with_another_number_of_threads(tmp_path: Path, partial: Path) -> None:
    whole, output = tmp_path / "whole.npz", tmp_path / "out.npz"
    complete_file(partial, whole)
    with pytest.raises(KeyboardInterrupt):
        complete_file(partial, output, watch=interrupted_after(11))
    assert complete_file(partial, output, resume=True, threads=2).resumed_at == 11
    np.testing.assert_array_equal(dynmesh.read(output).vertices, dynmesh.read(whole).vertices)


@pytest.mark.usefixtures("eager")
def test_only_resumable_files_are_kept(tmp_path: Path, partial: Path) -> None:
    output = tmp_path / "out.npz"
    with pytest.raises(ValueError, match="no sensor"):
        complete_file(partial, output, watch=interrupted_after(11, ValueError("no sensor")))
    assert not list(tmp_path.iterdir())
    with pytest.raises(OSError, match="No space"):
        complete_file(partial, output, watch=interrupted_after(11, OSError("No space")))
    assert complete_file(partial, output, resume=True).resumed_at == 11


def test_rejected_outliers_are_reported(tmp_path: Path, partial: Path) -> None:
    sequence = dynmesh.read(partial)
    assert sequence.known is not None
    astray = list(dynmesh.degrade.add_outliers(sequence.vertices, sequence.faces, 0.01))
    spoilt = tmp_path / "spoilt.npz"
    dynmesh.write(spoilt, replace(sequence, vertices=np.stack(astray)))
    completer = dynmesh.Completer(
        sequence.faces, sequence.vertices[0], method="detail", reject_outliers=True
    )
    rejected = 0
    for points, known in zip(astray[1:], sequence.known[1:], strict=True):
        completer.push(points, known)
        rejected += completer.report.rejected
    assert rejected > 0
    out = tmp_path / "out.npz"
    report = complete_file(spoilt, out, method="detail", reject_outliers=True)
    assert report.rejected == rejected
    assert complete_file(spoilt, tmp_path / "none.npz", method="detail").rejected == 0
    options = ("--method", "detail", "--reject-outliers", "--overwrite")
    shown = run("complete", spoilt, out, *options).stderr
    assert f"out.npz: {rejected} outliers rejected, " in shown
    assert "outliers rejected" not in run("complete", spoilt, out, "--overwrite").stderr


@pytest.mark.parametrize("format", ["obj", "pc2"])
def test_a_killed_process_can_be_resumed(tmp_path: Path, partial: Path, format: str) -> None:
    """As in tests/endurance, where jobs of the other formats are killed."""
    output = output_path(tmp_path, format)
    program = (
        "import os, signal, sys; from dynmesh.jobs import file_completion as f\n"
        "from dynmesh.jobs.checkpoint import Checkpoint\n"
        "Checkpoint.least_seconds_between = 0.0\n"
        "def watch(frames, whole, done):\n"
        "    for number, frame in enumerate(frames):\n"
        "        if number == 12: os.kill(os.getpid(), signal.SIGKILL)\n"
        "        yield frame\n"
        "f.complete_file(sys.argv[1], sys.argv[2], watch=watch)"
    )
    command = [sys.executable, "-c", program, str(partial), str(output)]
    assert subprocess.run(command, check=False).returncode == -signal.SIGKILL
    assert (unfinished_folder(output) / "checkpoint.npz").exists()
    assert not files.target_of(output, format).existing()
    run("complete", partial, output, "--resume")
    sequence = dynmesh.read(partial)
    expected = list(
        dynmesh.complete(sequence.faces, sequence.vertices, sequence.known, method="detail")
    )
    np.testing.assert_array_equal(dynmesh.read(output).vertices, expected)


def test_the_report_of_a_file(tmp_path: Path, partial: Path) -> None:
    report = complete_file(partial, tmp_path / "out.npz", fps=12.5)
    assert (report.frames, report.resumed_at) == (30, 0)
    assert report.seconds_per_frame is not None
    assert report.seconds_per_frame > 0
    sequence = dynmesh.read(partial)
    assert sequence.known is not None
    n_known = int(sequence.known[1:].sum())
    assert (report.known, report.filled, report.disconnected) == (n_known, 29 * 400 - n_known, 0)
    assert dynmesh.read(tmp_path / "out.npz").fps == 12.5


def shell(monkeypatch: pytest.MonkeyPatch, *arguments: object, interrupt: int = -1) -> int:
    """Runs the command in this process, interrupted after some frames; returns its exit code."""

    def track(frames: Iterator[Any], whole: int, _: str, done: int) -> Iterator[Any]:
        return interrupted_after(interrupt)(frames, whole, done)

    monkeypatch.setattr("dynmesh.cli.done.track", track)
    monkeypatch.setattr(sys, "argv", ["dynmesh", *map(str, arguments)])
    with pytest.raises(SystemExit) as caught:
        cli.main()
    return int(caught.value.code or 0)


@pytest.mark.usefixtures("eager")
def test_the_command_reports_what_an_interruption_leaves(
    tmp_path: Path,
    partial: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / "out.npz"
    kept = f"{out}: completed frames are kept; --resume continues from there\n"
    assert shell(monkeypatch, "complete", partial, out, interrupt=7) == 130
    assert capfd.readouterr().err == kept
    assert shell(monkeypatch, "complete", partial, out) == 1
    assert "7 frames of an interrupted run are kept: --resume" in capfd.readouterr().err
    assert shell(monkeypatch, "complete", partial, out, "--overwrite", interrupt=5) == 130
    assert capfd.readouterr().err == f"{out}: starting again\n{kept}"
    assert shell(monkeypatch, "complete", partial, out, "--resume") == 0
    shown = capfd.readouterr().err
    assert f"{out}: continued after 5 frames\n" in shown
    assert f"{out}: 25 frames completed in" in shown
    assert "starting again" not in shown


@pytest.mark.usefixtures("eager")
def test_unfinished_files_beside_an_older_output_are_resumed(tmp_path: Path, partial: Path) -> None:
    output = tmp_path / "out.npz"
    complete_file(partial, output)
    with pytest.raises(KeyboardInterrupt):
        complete_file(partial, output, overwrite=True, watch=interrupted_after(7))
    with pytest.raises(FileExistsError):
        complete_file(partial, output, resume=True)
    report = complete_file(partial, output, resume=True, overwrite=True)
    assert (report.resumed_at, report.existed) == (7, False)


def test_only_a_complete_output_ends_a_resumed_job(tmp_path: Path, partial: Path) -> None:
    output = tmp_path / "f_%04d.ply"
    complete_file(partial, output)
    (tmp_path / "f_0029.ply").unlink()
    with pytest.raises(FileExistsError):
        complete_file(partial, output, resume=True)
    (tmp_path / "out.npz").write_bytes(b"something else")
    with pytest.raises(FileExistsError):
        complete_file(partial, tmp_path / "out.npz", resume=True)


def test_the_command_reports_that_nothing_is_kept(
    tmp_path: Path,
    partial: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / "out.npz"
    assert shell(monkeypatch, "complete", partial, out, interrupt=7) == 130
    assert capfd.readouterr().err == f"{out}: interrupted; nothing was kept\n"
    assert not list(tmp_path.iterdir())
