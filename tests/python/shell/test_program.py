"""The program dynmesh-complete and the examples in C++ and C, against the library."""

import json
import os
import signal
import subprocess
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import to_file
from numpy.typing import NDArray
from sequences import left_in

import dynmesh
from dynmesh.completer import Settings


class Job:
    """A partial sequence in a folder, and its expected completion."""

    def __init__(self, folder: Path, sequence: dynmesh.Sequence, share: float = 0.3) -> None:
        self.folder = folder
        self.sequence = sequence
        n, k, _ = sequence.vertices.shape
        masks = np.stack(list(dynmesh.losses.random_known(n, k, share, seed=3)))
        self.partial: NDArray[np.float32] = np.where(
            masks[..., None], sequence.vertices, np.float32("nan")
        )[1:]
        completed = list(to_file.pushed(sequence.faces, sequence.vertices, masks))
        self.completed = np.stack(completed)[1:].tobytes()
        self.template = folder / "template.obj"
        dynmesh.write(self.template, sequence[:1])
        self.raw = folder / "partial.raw"
        self.raw.write_bytes(self.partial.tobytes())


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


def test_files_and_pipes_give_the_same_bytes(complete: Any, job: Job, tmp_path: Path) -> None:
    complete(job.raw, tmp_path / "a.raw")
    assert (tmp_path / "a.raw").read_bytes() == job.completed
    assert complete("-", "-", input=job.raw.read_bytes())[0] == job.completed


@pytest.mark.parametrize(
    ("change", "said", "quality"),
    [
        (lambda x: np.roll(x, 700, axis=1), "doubtful: frame 1: ", "doubtful"),
        (lambda x: 1000 * x, "probably ruined: frame 1: ", "ruined"),
        (lambda x: np.where(np.arange(len(x))[:, None, None] < 9, x, np.nan), "hardly any", "good"),
        (lambda x: np.where(np.arange(x.shape[1])[:, None] < 30, x, np.nan), "hardly any", "good"),
    ],
    ids=["other vertices", "another unit", "most frames without points", "hardly any points"],
)
def test_a_result_that_is_probably_wrong_is_written_and_told(
    complete: Any, job: Job, tmp_path: Path, change: Any, said: str, quality: str
) -> None:
    wrong = change(job.partial).astype(np.float32)
    _, errors = complete("-", tmp_path / "a.raw", "--report", code=3, input=wrong.tobytes())
    *reports, last = errors.splitlines()
    assert said in last
    assert json.loads(reports[0])["quality"] == quality
    assert (tmp_path / "a.raw").stat().st_size == wrong.nbytes


@pytest.mark.parametrize("name", ["a.raw", "../{}/a.raw", "linked.raw", "nowhere.raw", "hard.raw"])
def test_no_file_is_written_over_another(
    complete: Any, job: Job, tmp_path: Path, name: str
) -> None:
    (tmp_path / "a.raw").write_bytes(job.raw.read_bytes())
    (tmp_path / "linked.raw").symlink_to("a.raw")
    (tmp_path / "nowhere.raw").symlink_to("none.raw")
    (tmp_path / "hard.raw").hardlink_to(tmp_path / "a.raw")
    before = left_in(tmp_path)
    error = complete(job.raw, tmp_path / name.format(tmp_path.name), code=1)[1]
    assert "a.raw: exists already" in error.replace(name, "a.raw")
    assert left_in(tmp_path) == before


def test_a_stream_does_not_grow_its_own_input(programs: Path, job: Job, tmp_path: Path) -> None:
    """As with a shell's `>>`, which would never end."""
    raw = tmp_path / "a.raw"
    raw.write_bytes(job.raw.read_bytes())
    options = ["--template", str(job.template), "--input", str(raw), "--output", "-"]
    with raw.open("ab") as end:
        command = [str(programs / "dynmesh-complete"), *options]
        ended = subprocess.run(command, stdout=end, stderr=-1, timeout=60, check=False)
    assert b"a.raw: is also the standard output" in ended.stderr
    assert raw.read_bytes() == job.raw.read_bytes()


def test_without_a_frame_nothing_is_written(complete: Any, tmp_path: Path) -> None:
    for output in (tmp_path / "b.raw", tmp_path / "deep" / "er" / "%d.ply"):
        assert "contains no frame" in complete("-", output, code=1)[1]
        assert left_in(tmp_path) == {}


@pytest.mark.usefixtures("hearing_interrupts")
def test_an_interrupt_before_the_first_frame_writes_nothing(start: Any, tmp_path: Path) -> None:
    with start("-", tmp_path / "out.raw") as process:
        while not [*tmp_path.glob("out.raw.part")]:
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        assert process.wait() == 130
    assert left_in(tmp_path) == {}


def test_devices_and_links_to_them_get_the_stream(
    complete: Any, start: Any, job: Job, tmp_path: Path
) -> None:
    (tmp_path / "link.raw").symlink_to("/dev/null")
    for output in (Path("/dev/null"), tmp_path / "link.raw"):
        complete(job.raw, output)
        assert Path("/dev/null").is_char_device()
    assert complete("/dev/stdin", "/dev/stdout", input=job.raw.read_bytes())[0] == job.completed
    os.mkfifo(tmp_path / "fifo")
    with start(job.raw, tmp_path / "fifo") as process:
        assert (tmp_path / "fifo").read_bytes() == job.completed
        assert process.wait() == 0


@pytest.mark.parametrize("suffix", [".obj", ".ply"])
def test_mesh_files(complete: Any, job: Job, tmp_path: Path, suffix: str) -> None:
    """Frames 1, 2, ... to files that others can read; none that is there is left out."""
    partial, full = tmp_path / f"in%03d{suffix}", tmp_path / "new" / "out" / "%d.ply"
    for number, vertices in enumerate(job.partial[:11], 1):
        frame = dynmesh.Sequence(vertices[None], job.sequence.faces)
        dynmesh.write(Path(str(partial) % number), frame)
    complete(partial, full)
    outputs = [full.with_name(f"{number}.ply") for number in range(1, 12)]
    written = [dynmesh.read(path) for path in outputs]
    assert (
        b"".join(s.vertices.tobytes() for s in written) == job.completed[: job.partial[:11].nbytes]
    )
    assert all((s.faces == job.sequence.faces).all() for s in written)
    assert sorted(full.parent.iterdir()) == sorted(outputs)

    beside = {"in0003.obj", "in%03d.ply", "in12a.obj", "in.ply"}  # of other sequences
    for name in beside:
        (tmp_path / name).touch()
    other = tmp_path / "other" / "%d.ply"
    for number, told in ((0, "would not be read"), (13, f"{str(partial) % 12}: is missing")):
        further = Path(str(partial) % number)
        further.touch()
        assert told in complete(partial, other, code=1)[1]
        further.unlink()
    assert not other.parent.exists()

    Path(str(partial) % 4).write_text("v 0 0 nothing")
    (tmp_path / "empty").mkdir()
    complete(partial, tmp_path / "empty" / "%02d.ply", code=1)
    assert sorted(path.name for path in tmp_path.glob("empty/*")) == ["01.ply", "02.ply", "03.ply"]


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
    counts = {"frame": 1, "known": 750, "filled": 1750, "disconnected": 0, "rejected": 0}
    assert counts.items() <= first.items()
    assert first["iterations"] in (1, 2)
    assert first["seconds"] > 0
    complete(job.raw, tmp_path / "b.raw", "--threads", "2")
    assert (tmp_path / "b.raw").read_bytes() == job.completed


@pytest.mark.parametrize(
    ("options", "settings"),
    [
        (["--noise", "0.02"], {"noise": 0.02}),
        (["--reject-outliers"], {"reject_outliers": True}),
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


def test_whole_frames_before_a_fault_are_written(complete: Any, job: Job, tmp_path: Path) -> None:
    size, frames, out = job.partial[0].nbytes, job.partial.copy(), tmp_path / "out.raw"

    def refused(content: bytes) -> str:
        out.unlink(missing_ok=True)
        (tmp_path / "in.raw").write_bytes(content)
        return str(complete(tmp_path / "in.raw", out, code=1)[1])

    assert "in.raw: frame 5: has 8 vertices" in refused(job.raw.read_bytes()[: 4 * size + 100])
    assert out.read_bytes() == job.completed[: 4 * size]
    frames[2, 7] = 1e30
    assert "in.raw: frame 3: points: row 7 is at (1.00000002e+30" in refused(frames.tobytes())
    assert out.read_bytes() == job.completed[: 2 * size]
    frames[0, 7] = 1e30
    refused(frames.tobytes())
    assert [path.name for path in tmp_path.iterdir()] == ["in.raw"]


def test_a_reader_that_goes_away_ends_the_program(start: Any, job: Job) -> None:
    with start(job.raw, "-") as process:
        process.stdout.close()
        error = process.stderr.read().decode()
    assert process.returncode == 1
    assert "standard output: cannot be written: Broken pipe" in error


@pytest.mark.parametrize("make", [Path.mkdir, Path.touch, lambda path: path.symlink_to("none")])
def test_frames_are_kept_if_the_name_of_the_output_is_taken_meanwhile(
    start: Any, job: Job, tmp_path: Path, make: Any
) -> None:
    out = tmp_path / "out.raw"
    with start("-", out, "--report") as process:
        process.stdin.write(job.partial[0].tobytes())
        process.stdin.flush()
        process.stderr.readline()  # the output is open
        make(out)
        process.stdin.close()
        error = process.stderr.read().decode()
        assert process.wait() == 1
    (kept,) = tmp_path.glob("*.part")
    assert f"out.raw: exists already; the frames are in {kept}" in error
    assert kept.read_bytes() == job.completed[: job.partial[0].nbytes]
    out.rename(tmp_path / "aside")
    error = start(job.raw, out).communicate()[1].decode()  # a second run could be writing it
    assert f"{kept}: exists already; remove it" in error


@pytest.mark.usefixtures("hearing_interrupts")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interrupt_keeps_the_frames_so_far(
    start: Any, job: Job, tmp_path: Path, number: int, code: int
) -> None:
    out = tmp_path / "out.raw"
    with start("-", out, "--report") as process:
        process.stdin.write(job.partial[:3].tobytes())
        process.stdin.flush()
        for _ in range(3):
            process.stderr.readline()
        process.send_signal(number)
        error = process.stderr.read().decode()
        assert process.wait() == code
    assert "interrupted; all frames completed so far have been written" in error
    assert out.read_bytes() == job.completed[: 3 * job.partial[0].nbytes]


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
