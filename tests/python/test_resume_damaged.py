"""What an interrupted run left, damaged: refused where it is, or continued to the same result, and
never in the way of a run that starts again."""

import json
import os
import shutil
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bad_input.files import on_a_full_disk
from commands import dynmesh_command
from damage import check_damage
from meshes import sheet

import dynmesh
from dynmesh import degrade
from dynmesh.degrade.depth_buffer import intrinsics_of, pose_of
from dynmesh.files.lock import unfinished_folder
from dynmesh.files.scans import PointFolder, Rig, ScanCamera
from dynmesh.jobs.checkpoint import Checkpoint
from dynmesh.jobs.file_completion import complete_file
from dynmesh.jobs.tracking import track_file

pytestmark = pytest.mark.usefixtures("eager")

OUTPUTS = {"npz": "out.npz", "hdf5": "out.h5", "npy": "out.npy", "pc2": "out.pc2"} | {
    "ply": "f_%04d.ply", "pattern": "new/f_%04d.obj"
}  # fmt: skip
LIBRARIES = {"hdf5": "h5py"}
N_FRAMES = 6


@pytest.fixture
def eager(monkeypatch: pytest.MonkeyPatch) -> None:
    """Saves a checkpoint after every frame."""
    monkeypatch.setattr(Checkpoint, "is_due", lambda _: True)


@pytest.fixture(scope="module")
def partial(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small sheet of which every frame lacks vertices, except for frame 3."""
    mesh = sheet(3)
    path = tmp_path_factory.mktemp("partial") / "partial.npz"
    steps = np.linspace(0, 1, N_FRAMES)[:, None, None] ** 2
    vertices = (mesh.vertices * (1 + steps)).astype(np.float32)
    known = np.random.default_rng(0).random(vertices.shape[:2]) < 0.6
    known[[0, 3]] = True
    dynmesh.write(path, dynmesh.Sequence(vertices, mesh.faces.astype(np.int32), known, fps=25.0))
    return path


def stop_after(n: int) -> Callable[..., Iterator[Any]]:
    """Passes n frames on, then interrupts."""

    def watch(frames: Iterator[Any], _: int, done: int) -> Iterator[Any]:
        for number, frame in enumerate(frames, done):
            if number == n:
                raise KeyboardInterrupt
            yield frame

    return watch


def visible(folder: Path) -> dict[str, bytes]:
    """The content of all files that are not hidden."""
    found = {str(f.relative_to(folder)): f for f in sorted(folder.rglob("*")) if f.is_file()}
    return {name: f.read_bytes() for name, f in found.items() if "/." not in f"/{name}"}


def everything(folder: Path) -> dict[str, bytes]:
    """The content of all files."""
    return {str(f): f.read_bytes() for f in sorted(folder.rglob("*")) if f.is_file()}


def job_of(partial: Path, kind: str, **options: Any) -> Callable[..., dict[str, bytes]]:
    """Completes to an output of that kind in a folder; returns the files."""
    pytest.importorskip(LIBRARIES.get(kind, "numpy"))
    provenance = kind not in ("pc2", "pattern")

    def run(folder: Path, **more: Any) -> dict[str, bytes]:
        output = folder / OUTPUTS[kind]
        complete_file(partial, output, provenance=provenance, **options, **more)
        return visible(folder)

    return run


def check_each_damage(
    tmp_path: Path,
    run: Callable[..., dict[str, bytes]],
    interrupt: Callable[[Path], None],
    **options: Any,
) -> None:
    """Interrupts a job and continues it after each damage of what it left."""
    sound, work, fresh = (tmp_path / name for name in ("sound", "work", "fresh"))
    work.mkdir()  # the job remembers no place, but errors and results name this one
    interrupt(work)
    work.rename(sound)
    fresh.mkdir()
    expected = run(fresh)
    plans = [plan.relative_to(sound) for plan in sound.rglob("placing.json")]
    outcomes = check_damage(
        sound,
        lambda folder: run(folder, resume=True),
        work=work,
        victims=plans or None,
        afterwards=lambda folder: run(folder, overwrite=True),
        same=lambda one, _: one == expected,
        **options,
    )
    assert plans or outcomes["refused"] > 0


def damaged_unfinished(tmp_path: Path, run: Callable[..., dict[str, bytes]], stop: int) -> None:
    """As the job is left that is interrupted after some frames."""

    def interrupt(work: Path) -> None:
        with pytest.raises(KeyboardInterrupt):
            run(work, watch=stop_after(stop))

    check_each_damage(tmp_path, run, interrupt, most=6)


@pytest.mark.parametrize("kind", OUTPUTS)
def test_any_byte_of_what_was_left(tmp_path: Path, partial: Path, kind: str) -> None:
    damaged_unfinished(tmp_path, job_of(partial, kind), 2)


@pytest.mark.parametrize("stop", [2, 5])
def test_any_byte_while_frames_wait(tmp_path: Path, partial: Path, stop: int) -> None:
    """Completed backwards, they are in a file of their own."""
    damaged_unfinished(tmp_path, job_of(partial, "npz", start=3), stop)


def test_any_byte_of_a_tracking_job(tmp_path: Path) -> None:
    walk = dynmesh.synth.ocean(N_FRAMES, grid=6, seed=1)
    cameras = degrade.orbit(walk.vertices[0], 1)(0)
    rig = Rig(
        tuple(
            ScanCamera(str(i), pose_of(camera), intrinsics_of(camera, 32, 24), 0.001, (32, 24))
            for i, camera in enumerate(cameras)
        )
    )
    clouds = degrade.scan_points(walk.vertices, walk.faces, cameras, points=200)
    with PointFolder(tmp_path / "scans", rig) as folder:
        for cloud in clouds:
            folder.append(cloud)
    template = tmp_path / "template.npz"
    dynmesh.write(template, dynmesh.Sequence(walk.vertices[:1], walk.faces))

    def run(folder: Path, **options: Any) -> dict[str, bytes]:
        output = folder / "out.npz"
        track_file(tmp_path / "scans", output, template=template, provenance=True, **options)
        return visible(folder)

    damaged_unfinished(tmp_path, run, 2)


@pytest.mark.parametrize(("kind", "moved"), [("npz", 0), ("npy", 1), ("ply", 2), ("pattern", 0)])
def test_any_byte_of_what_is_left_to_place(
    tmp_path: Path, partial: Path, kind: str, moved: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After some of the finished files were moved."""
    run = job_of(partial, kind)
    check_each_damage(tmp_path, run, lambda work: kill_while_placing(work, run, moved, monkeypatch))


def kill_while_placing(
    work: Path, run: Callable[..., Any], moved: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ends a job, as a kill does, after it has moved some of its files."""
    usual = Path.replace
    moves: list[Path] = []

    def replace(file: Path, target: Path) -> Path:
        if ".unfinished" not in str(target):
            if len(moves) == moved:
                raise KeyboardInterrupt
            moves.append(file)
        return usual(file, target)

    with monkeypatch.context() as patched:
        patched.setattr(Path, "replace", replace)
        with pytest.raises(KeyboardInterrupt):
            run(work)


def interrupted(partial: Path, output: Path, n: int = 2, **options: Any) -> Path:
    """Returns the folder that an interrupted job leaves."""
    with pytest.raises(KeyboardInterrupt):
        complete_file(partial, output, watch=stop_after(n), **options)
    return unfinished_folder(output)


def change_checkpoint(folder: Path, **values: Any) -> None:
    """Writes a sound checkpoint with other values."""
    file = folder / "checkpoint.npz"
    with np.load(file) as saved:
        np.savez(file, **{**saved, **values})


NO_STATE = np.zeros(0, np.uint8)


@pytest.mark.parametrize(
    ("start", "values", "why"),
    [
        (0, {"state": NO_STATE}, "its state cannot be restored"),
        (0, {"done": 1, "written": 1}, "1 frames are done, but its state is that after 1"),
        (0, {"done": 5, "written": 5}, "5 frames are done, but its state is that after 1"),
        (0, {"written": 1}, "2 frames are done, but 1 written"),
        (0, {"written": 3}, "2 frames are done, but 3 written"),
        (0, {"done": N_FRAMES + 1}, f"{N_FRAMES + 1} of {N_FRAMES} frames are done"),
        (0, {"done": -1}, "-1 frames are done"),
        (3, {"state": NO_STATE}, "its state cannot be restored"),
        (3, {"done": 1}, "1 frames are done, but its state is that after 2"),
        (3, {"done": 3}, "3 frames are done, but its state is that after 2"),
        (3, {"done": 5, "written": 5}, "5 frames are done, but its state is that after 2"),
        (3, {"written": 1}, "2 frames are done, but 1 written"),
    ],
)
def test_a_checkpoint_that_contradicts_itself(
    tmp_path: Path, partial: Path, start: int, values: dict[str, Any], why: str
) -> None:
    """Without a state, a fresh completer would go on with other numbers."""
    output = tmp_path / "out.npz"
    change_checkpoint(interrupted(partial, output, start=start), **values)
    before = everything(tmp_path)
    with pytest.raises(ValueError, match=rf"checkpoint\.npz: .*{why}.*; run with --overwrite to"):
        complete_file(partial, output, start=start, resume=True)
    assert everything(tmp_path) == before
    complete_file(partial, output, start=start, overwrite=True)
    assert [file.name for file in tmp_path.iterdir()] == ["out.npz"]


def plant_folder(file: Path) -> None:
    file.unlink(missing_ok=True)
    file.mkdir()


def cut(file: Path) -> None:
    os.truncate(file, file.stat().st_size // 2)


def instead(made: Callable[[Path], Any]) -> Callable[[Path], None]:
    """Puts something in the place of the whole folder."""

    def make(checkpoint: Path) -> None:
        shutil.rmtree(checkpoint.parent)
        made(checkpoint.parent)

    return make


def of_version_0(checkpoint: Path) -> None:
    with np.load(checkpoint) as saved:
        job = json.loads(str(saved["job"])) | {"version": "0.0.1"}
        np.savez(checkpoint, job=json.dumps(job), done=2, written=2, state=saved["state"])


def plan(content: bytes) -> Callable[[Path], None]:
    return lambda checkpoint: (checkpoint.parent / "files" / "placing.json").write_bytes(content)  # type: ignore[return-value]


DAMAGES: dict[str, tuple[Callable[[Path], Any], str]] = {
    "empty": (lambda file: file.write_bytes(b""), "checkpoint.npz"),
    "cut": (cut, "checkpoint.npz"),
    "folder": (plant_folder, "checkpoint.npz"),
    "version": (of_version_0, r"checkpoint.npz: is of dynmesh 0\.0\.1, not"),
    "plan cut": (plan(b'{"places": {"out'), "placing.json"),
    "plan list": (plan(b"[]"), "placing.json"),
    "plan folder": (
        lambda file: (file.parent / "files" / "placing.json").mkdir(),
        "placing.json: is a folder",
    ),
    "file": (instead(lambda folder: folder.write_text("mine")), "unfinished: is not a folder"),
    "link": (
        instead(lambda folder: folder.symlink_to("nowhere")),
        "unfinished: is not a folder",
    ),
}


@pytest.mark.parametrize("what", DAMAGES)
@pytest.mark.parametrize("overwrite", [False, True])
def test_damage_does_not_stay_in_the_way(
    tmp_path: Path, partial: Path, what: str, overwrite: bool
) -> None:
    damage, named = DAMAGES[what]
    output = tmp_path / "out.npz"
    damage(interrupted(partial, output) / "checkpoint.npz")
    if overwrite:
        output.write_bytes(b"older")
    before = everything(tmp_path)
    resume = ["--resume", *(["--overwrite"] if overwrite else [])]
    refused = dynmesh_command("complete", partial, output, *resume, code=1).stderr
    assert len(refused.splitlines()) == 1
    with pytest.raises(ValueError, match=rf"{named}.*; run with --overwrite to start again"):
        complete_file(partial, output, resume=True, overwrite=overwrite)
    assert everything(tmp_path) == before
    shown = dynmesh_command("complete", partial, output, *resume[1:]).stderr
    assert "the unfinished output cannot be continued and was moved to" in shown
    assert "plan" in what or "--resume continues" not in shown
    assert sorted(f.name for f in tmp_path.iterdir()) == [".out.npz.set-aside", "out.npz"]
    whole = complete_file(partial, tmp_path / "whole.npz")
    assert (tmp_path / "whole.npz").read_bytes() == output.read_bytes()
    assert not whole.remarks


@pytest.mark.parametrize(
    ("places", "remove"),
    [
        ({}, ["../../victim.txt"]),
        ({}, ["../../../outside.txt"]),
        ({"vertices.npy": "../../victim.txt"}, []),
        ({"vertices.npy": "../../../vertices.npy"}, []),
        ({"../checkpoint.npz": "../../checkpoint.npz"}, []),
    ],
)
def test_a_plan_names_only_files_of_the_output(
    tmp_path: Path, partial: Path, places: dict[str, str], remove: list[str]
) -> None:
    """Whoever has written it; its checksum is right."""
    home = tmp_path / "home"
    home.mkdir()
    output = home / "out.npz"
    for victim in (home / "victim.txt", tmp_path / "outside.txt"):
        victim.write_text("dear")
    folder = interrupted(partial, output) / "files"
    stamps = {}
    for name in places:
        found = (folder / name).stat()
        stamps[name] = [found.st_size, found.st_mtime_ns]
    text = json.dumps({"places": places, "stamps": stamps, "remove": remove}).encode()
    (folder / "placing.json").write_bytes(b"%s\n%d" % (text, zlib.crc32(text)))
    before = everything(tmp_path)
    with pytest.raises(ValueError, match=r"placing\.json: would (put|remove) "):
        complete_file(partial, output, resume=True)
    assert everything(tmp_path) == before
    complete_file(partial, output)
    assert {name: text for name, text in visible(tmp_path).items() if "out.npz" not in name} == {
        "home/victim.txt": b"dear", "outside.txt": b"dear"
    }  # fmt: skip


@pytest.mark.parametrize(
    ("start", "limit", "file"), [(0, 80_000, r"checkpoint\.npz"), (2, 20_000, "before")]
)
def test_a_full_disk_is_not_blamed_on_the_input(
    tmp_path: Path, start: int, limit: int, file: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The state of the completer is larger than a frame, as are two that wait."""
    monkeypatch.setattr(Checkpoint, "is_due", lambda _: start == 0)
    ocean = dynmesh.synth.ocean(3, grid=40, seed=1)
    known = np.random.default_rng(0).random(ocean.vertices.shape[:2]) < 0.6
    known[start] = True
    big, output = tmp_path / "big.npz", tmp_path / "out_%04d.ply"
    dynmesh.write(big, dynmesh.Sequence(ocean.vertices, ocean.faces, known))
    with pytest.raises(OSError, match=rf"File too large: '.*{file}'") as caught:
        on_a_full_disk(lambda: complete_file(big, output, start=start), limit)
    assert "big.npz" not in str(caught.value)
