"""The program dynmesh-complete and the C++ example, against the library."""

import json
import signal
import struct
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import dynmesh
from dynmesh.settings import Settings

Floats = NDArray[np.float32]
HEADER = "<12siiffi"


def write_pc2(path: Path, frames: Floats, n_frames: int | None = None) -> None:
    n = len(frames) if n_frames is None else n_frames
    header = struct.pack(HEADER, b"POINTCACHE2\0", 1, frames.shape[1], 7.0, 0.5, n)
    path.write_bytes(header + frames.tobytes())


class Job:
    """A partial sequence in a folder, and its expected completion."""

    def __init__(self, folder: Path, sequence: dynmesh.Sequence, share: float = 0.3) -> None:
        self.folder = folder
        self.sequence = sequence
        n, k, _ = sequence.vertices.shape
        masks = np.stack(list(dynmesh.degrade.random_known(n, k, share, seed=3)))
        self.partial: Floats = np.where(masks[..., None], sequence.vertices, np.float32("nan"))[1:]
        completed = list(dynmesh.complete(sequence.faces, sequence.vertices, masks))
        self.completed = np.stack(completed)[1:].tobytes()
        self.template = folder / "template.obj"
        for template in (self.template, folder / "template.ply"):
            dynmesh.write(template, sequence[:1])
        self.raw = folder / "partial.raw"
        self.raw.write_bytes(self.partial.tobytes())
        self.pc2 = folder / "partial.pc2"
        write_pc2(self.pc2, self.partial)


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Job:
    return Job(tmp_path_factory.mktemp("program"), dynmesh.synth.ocean(20))


@pytest.fixture
def start(programs: Path, job: Job) -> Any:
    """Starts the program, with pipes to and from it."""

    def run(input_: str | Path, output: str | Path, *options: str | Path) -> Any:
        command: list[str | Path] = [programs / "dynmesh-complete", *options]
        command += ["--input", input_, "--output", output]
        if "--template" not in options:
            command += ["--template", job.template]
        pipe = subprocess.PIPE
        return subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe)

    return run


@pytest.fixture
def complete(start: Any) -> Any:
    """Runs the program to its end, and returns what it printed to standard output and error."""

    def run(*command: str | Path, code: int = 0, input: bytes = b"") -> tuple[bytes, str]:
        process = start(*command)
        printed, errors = process.communicate(input)
        assert process.returncode == code, errors
        return printed, errors.decode()

    return run


def test_raw_and_pc2_and_pipes_give_the_same_bytes(complete: Any, job: Job, tmp_path: Path) -> None:
    complete(job.raw, tmp_path / "a.raw")
    assert (tmp_path / "a.raw").read_bytes() == job.completed
    complete(job.raw, tmp_path / "b.f32", "--template", job.folder / "template.ply")
    assert (tmp_path / "b.f32").read_bytes() == job.completed
    complete(job.pc2, tmp_path / "a.pc2")
    cache = (tmp_path / "a.pc2").read_bytes()
    assert struct.unpack(HEADER, cache[:32]) == (b"POINTCACHE2\0", 1, 2500, 7.0, 0.5, 19)
    assert cache[32:] == job.completed
    assert complete("-", "-", input=job.raw.read_bytes())[0] == job.completed
    assert complete(job.pc2, "-")[0] == job.completed


def test_a_pipe_gets_each_frame_at_once(start: Any, job: Job) -> None:
    size = job.partial[0].nbytes
    with start("-", "-") as process:
        for i in range(3):
            process.stdin.write(job.partial[i].tobytes())
            process.stdin.flush()
            assert process.stdout.read(size) == job.completed[i * size : (i + 1) * size]
        process.stdin.close()
    assert process.returncode == 0


def test_threads_and_report(complete: Any, job: Job, tmp_path: Path) -> None:
    report = complete(job.raw, tmp_path / "a.raw", "--report")[1].splitlines()
    assert len(report) == 19
    first = json.loads(report[0])
    assert (first["frame"], first["known"], first["filled"], first["disconnected"]) == (
        1,
        750,
        1750,
        0,
    )
    assert first["iterations"] >= 2
    assert first["rejected"] == 0
    assert first["seconds"] > 0
    complete(job.raw, tmp_path / "b.raw", "--threads", "2")
    assert (tmp_path / "b.raw").read_bytes() == job.completed


@pytest.mark.parametrize(
    ("options", "settings"),
    [
        (["--noise", "0.02"], {"noise": 0.02}),
        (["--reject-outliers"], {"reject_outliers": True}),
        (["--learn"], {"learn": True}),
        (["--method", "motion"], {"method": "motion"}),
        (["--method", "motion", "--no-revisit"], {"method": "motion", "revisit": False}),
        (
            ["--method", "motion", "--extra-iterations", "5"],
            {"method": "motion", "extra_iterations": 5},
        ),
    ],
)
def test_settings(
    complete: Any, job: Job, tmp_path: Path, options: list[str], settings: Settings
) -> None:
    complete(job.raw, tmp_path / "a.raw", *options)
    first = job.sequence.vertices[0]
    completer = dynmesh.Completer(job.sequence.faces, first, **settings)
    expected = b"".join(completer.push(points).tobytes() for points in job.partial)
    assert (tmp_path / "a.raw").read_bytes() == expected != job.completed


class TrainingFile:
    """Frames of the ocean, as training frames for the ocean of a job."""

    def __init__(self, folder: Path) -> None:
        self.frames: Floats = dynmesh.synth.ocean(100).vertices.astype(np.float32)[20:]
        self.raw, self.pc2 = folder / "training.raw", folder / "training.pc2"
        self.raw.write_bytes(self.frames[:30].tobytes())
        write_pc2(self.pc2, self.frames[30:])


@pytest.fixture(scope="module")
def training(tmp_path_factory: pytest.TempPathFactory) -> TrainingFile:
    return TrainingFile(tmp_path_factory.mktemp("training"))


def test_training_are_those_of_the_library(
    complete: Any, job: Job, training: TrainingFile, tmp_path: Path
) -> None:
    completer = dynmesh.Completer(
        job.sequence.faces, job.sequence.vertices[0], method="detail", training=training.frames
    )
    expected, reports = [], []
    for points in job.partial[:6]:
        expected.append(completer.push(points).tobytes())
        reports.append(completer.report)
    (tmp_path / "short.raw").write_bytes(job.partial[:6].tobytes())
    options: list[str | Path] = ["--method", "detail", "--training", training.raw]
    options += ["--training", training.pc2, "--report"]
    _, shown_reports = complete(tmp_path / "short.raw", tmp_path / "a.raw", *options)
    assert (tmp_path / "a.raw").read_bytes() == b"".join(expected)
    for line, report in zip(shown_reports.splitlines(), reports, strict=True):
        shown = json.loads(line)
        for name in ("blend", "prior_weight", "prior_share", "first_order_share"):
            assert shown[name] == pytest.approx(getattr(report, name), rel=1e-8)
    assert max(report.prior_share for report in reports) > 0
    # The first part through a pipe.
    options = ["--method", "detail", "--training", "-", "--training", training.pc2]
    complete(tmp_path / "short.raw", tmp_path / "b.raw", *options, input=training.raw.read_bytes())
    assert (tmp_path / "b.raw").read_bytes() == b"".join(expected)


@pytest.mark.usefixtures("hearing_interrupts")
def test_an_interrupt_while_a_training_is_read(start: Any, job: Job, tmp_path: Path) -> None:
    out = tmp_path / "out.raw"
    with start(job.raw, out, "--training", "-") as process:
        # More than a pipe holds: when this returns, the program has started to read.
        process.stdin.write(job.sequence.vertices[:4].astype(np.float32).tobytes())
        process.stdin.flush()
        process.send_signal(signal.SIGINT)
        assert b"interrupted" in process.stderr.read()
        assert process.wait() == 130
    assert not out.exists()


def test_whole_frames_before_a_cut_are_written(complete: Any, job: Job, tmp_path: Path) -> None:
    size = job.partial[0].nbytes
    (tmp_path / "cut.raw").write_bytes(job.raw.read_bytes()[: 4 * size + 100])
    error = complete(tmp_path / "cut.raw", tmp_path / "a.raw", code=1)[1]
    assert f"frame 5 ends after 100 of {size} bytes; 4 whole frames preceded it" in error
    assert (tmp_path / "a.raw").read_bytes() == job.completed[: 4 * size]

    (tmp_path / "cut.pc2").write_bytes(job.pc2.read_bytes()[: 32 + 4 * size])
    error = complete(tmp_path / "cut.pc2", tmp_path / "a.pc2", code=1)[1]
    assert "frame 5 of 19 ends after 0 of" in error
    cache = (tmp_path / "a.pc2").read_bytes()
    assert struct.unpack(HEADER, cache[:32])[5] == 4
    assert cache[32:] == job.completed[: 4 * size]

    write_pc2(tmp_path / "longer.pc2", job.partial, n_frames=4)
    error = complete(tmp_path / "longer.pc2", tmp_path / "b.raw", code=1)[1]
    assert "longer.pc2: continues after the 4 whole frames that" in error
    assert (tmp_path / "b.raw").read_bytes() == job.completed[: 4 * size]


def test_whole_frames_before_one_that_cannot_be_used_are_written(
    complete: Any, job: Job, tmp_path: Path
) -> None:
    frames = job.partial.copy()
    frames[2, 7] = 1e30
    (tmp_path / "wild.raw").write_bytes(frames.tobytes())
    error = complete(tmp_path / "wild.raw", tmp_path / "a.raw", code=1)[1]
    assert "wild.raw: frame 3: points: row 7 is at (1.00000002e+30" in error
    assert (tmp_path / "a.raw").read_bytes() == job.completed[: 2 * job.partial[0].nbytes]


def test_a_reader_that_goes_away_ends_the_program(start: Any, job: Job) -> None:
    with start(job.raw, "-") as process:
        process.stdout.close()
        error = process.stderr.read().decode()
    assert process.returncode == 1
    assert "standard output: frame 1 cannot be written: Broken pipe" in error


def test_frames_are_kept_if_the_output_cannot_be_replaced(
    start: Any, job: Job, tmp_path: Path
) -> None:
    out = tmp_path / "out.raw"
    with start("-", out, "--report") as process:
        process.stdin.write(job.partial[0].tobytes())
        process.stdin.flush()
        process.stderr.readline()  # the output is open
        out.mkdir()
        process.stdin.close()
        error = process.stderr.read().decode()
        assert process.wait() == 1
    (kept,) = tmp_path.glob("*.part")
    assert f"out.raw: cannot be replaced: Is a directory; all frames are in {kept}" in error
    assert kept.read_bytes() == job.completed[: job.partial[0].nbytes]


@pytest.mark.usefixtures("hearing_interrupts")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interrupt_keeps_the_frames_so_far(
    start: Any, job: Job, tmp_path: Path, number: int, code: int
) -> None:
    out = tmp_path / "out.pc2"
    with start("-", out, "--report") as process:
        process.stdin.write(job.partial[:3].tobytes())
        process.stdin.flush()
        for _ in range(3):
            process.stderr.readline()
        process.send_signal(number)
        error = process.stderr.read().decode()
        assert process.wait() == code
    assert "interrupted; all frames completed so far have been written" in error
    cache = out.read_bytes()
    assert struct.unpack(HEADER, cache[:32])[5] == 3
    assert cache[32:] == job.completed[: 3 * job.partial[0].nbytes]


def test_an_interrupt_that_is_ignored_stays_ignored(start: Any, job: Job) -> None:
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        process = start("-", "-", "--report")
    finally:
        signal.signal(signal.SIGINT, before)
    with process:
        process.stdin.write(job.partial[0].tobytes())
        process.stdin.flush()
        process.stderr.readline()  # it has started
        process.send_signal(signal.SIGINT)
        completed, _ = process.communicate(job.partial[1:].tobytes(), timeout=60)
    assert process.returncode == 0
    assert completed == job.completed


def test_the_capture_loop_completes_or_drops_every_frame(
    programs: Path, job: Job, tmp_path: Path
) -> None:
    """With --every-frame all of them, also after one that is refused."""
    partial = job.partial.copy()
    partial[4, 7] = 1e20  # frame 5, as frame 0 is the template
    bad, out = tmp_path / "bad.raw", tmp_path / "out.raw"
    bad.write_bytes(partial.tobytes())
    completer = dynmesh.Completer(job.sequence.faces, job.sequence.vertices[0])
    expected = [completer.skip() if i == 4 else completer.push(f) for i, f in enumerate(partial)]

    def run(source: Path, *options: str) -> subprocess.CompletedProcess[str]:
        loop = programs / "examples" / "cpp" / "capture_loop"
        command: list[str | Path] = [loop, job.template, source, out, *options]
        return subprocess.run(command, capture_output=True, check=True, text=True)

    every = run(bad, "--every-frame")
    assert every.stdout.startswith("19 frames completed, 0 dropped")
    (line,) = every.stderr.splitlines()
    assert line.startswith("capture_loop: frame 5 refused: points: row 7 is at ")
    assert out.read_bytes() == np.stack(expected).tobytes()
    start = time.monotonic()
    told = run(job.raw).stdout
    completed, dropped = (int(part.split()[0]) for part in told.split(";")[0].split(", "))
    assert completed + dropped == 19
    assert time.monotonic() - start > 19 / 60
    assert out.stat().st_size == completed * job.partial[0].nbytes


def test_the_capture_loop_ends_where_its_output_does(programs: Path, job: Job) -> None:
    command: list[str | Path] = [programs / "examples" / "cpp" / "capture_loop", job.template]
    command += [job.raw, "/dev/full"]
    result = subprocess.run(command, capture_output=True, check=False, text=True, timeout=60)
    assert result.returncode == 1
    assert result.stderr == "capture_loop: cannot write the output\n"
