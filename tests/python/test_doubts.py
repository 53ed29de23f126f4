"""What makes a result doubtful is not forgotten: in a later run, or once the output is complete."""

import json
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import dynmesh_command as run
from meshes import turned
from PIL import Image
from test_track import bumpy

import dynmesh
from dynmesh.files import CannotResumeError
from dynmesh.files.lock import unfinished_folder
from dynmesh.files.scans import Scan
from dynmesh.jobs.checkpoint import Checkpoint
from dynmesh.jobs.fits import Counts, Fits
from dynmesh.jobs.tracking import track_file

FIRST = 3
"""Frames that the run before the interruption tracks."""


@pytest.fixture(scope="module")
def ruined_first(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Depth images of a body, of which frame 1 has wrong depths.

    One image is damaged, one frame is empty, and one camera was moved a little.
    """
    folder = tmp_path_factory.mktemp("doubts")
    mesh = bumpy()
    frames = [turned(mesh.vertices, 0.02 * i) + 0.01 * i for i in range(6)]
    truth = dynmesh.Sequence(np.stack(frames), mesh.faces, up_axis="z")
    dynmesh.write(folder / "truth.npz", truth)
    dynmesh.write(folder / "body.obj", truth[:1])
    scans = folder / "scans"
    run("degrade", folder / "truth.npz", scans, "--depth", "120x90")
    for camera in range(4):
        file = scans / f"depth_00001_{camera}.png"
        with Image.open(file) as image:
            farther = np.array(image, np.float64) * 1.1
        Image.fromarray(farther.astype(np.uint16)).save(file)
    damaged = scans / "depth_00000_2.png"
    damaged.write_bytes(damaged.read_bytes()[:-20])
    for camera in range(4):
        (scans / f"depth_00002_{camera}.png").write_bytes(b"")
    told = json.loads((scans / "cameras.json").read_text())
    told["cameras"][3]["camera_to_world"][2][3] += 0.1
    (scans / "cameras.json").write_text(json.dumps(told))
    return folder


def stopping(scans: Iterator[Scan | None], *_: int) -> Iterator[Scan | None]:
    for number, scan in enumerate(scans):
        if number == FIRST:
            raise KeyboardInterrupt
        yield scan


@pytest.fixture
def every_frame_saved(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Checkpoint, "least_seconds_between", 0.0)
    monkeypatch.setattr(Checkpoint, "most_of_the_time", 1e9)


@pytest.mark.usefixtures("every_frame_saved")
def test_a_resumed_tracking_tells_what_an_uninterrupted_one_does(
    ruined_first: Path, tmp_path: Path
) -> None:
    scans, template = ruined_first / "scans", ruined_first / "body.obj"
    whole = track_file(scans, tmp_path / "whole.npz", template=template)
    assert whole.quality == "ruined"
    assert [frame for frame, _ in whole.worst] == [1]
    assert whole.rig
    assert whole.empty == 1
    assert len(whole.lost) == 5
    output = tmp_path / "out.npz"
    with pytest.raises(KeyboardInterrupt):
        track_file(scans, output, template=template, watch=stopping)
    shutil.copytree(unfinished_folder(output), unfinished_folder(tmp_path / "again.npz"))
    with np.load(unfinished_folder(output) / "checkpoint.npz") as saved:
        kept = dict(saved)
    np.savez(unfinished_folder(output) / "checkpoint.npz", **kept | {"judged": '{"total": 3}'})
    with pytest.raises(CannotResumeError, match="does not say how well it was tracked"):
        track_file(scans, output, template=template, resume=True)
    np.savez(unfinished_folder(output) / "checkpoint.npz", **kept)
    report = track_file(scans, output, template=template, resume=True)
    assert report.resumed_at == FIRST
    same: dict[str, Any] = {"resumed_at": 0, "seconds_per_frame": None}
    assert replace(report, **same) == replace(whole, **same)
    words = ("track", scans, tmp_path / "again.npz", "--template", template, "--resume")
    assert whole.reason in run(*words, code=3).stderr
    told = run(*words, code=3).stderr  # of an output that is complete
    assert "already complete" in told
    assert whole.reason in told
    again = track_file(scans, output, template=template, resume=True)
    assert (again.existed, again.quality, again.reason) == (True, "ruined", whole.reason)
    dynmesh.write(output, dynmesh.read(output))
    changed = track_file(scans, output, template=template, resume=True)
    assert (changed.existed, changed.quality, changed.reason) == (True, "good", "")


def test_points_in_planes_do_not_count() -> None:
    assert Counts().share is None
    assert Counts(100, 100, 100).share is None
    assert Counts(100, 40, 20).share == 0.25
    assert Fits(total=Counts(1000, 300, 299)).quality == "good"
    assert Fits(total=Counts(1000, 300, 270)).quality == "doubtful"
    assert Fits(total=Counts(1000, 300, 200)).quality == "ruined"
    state = json.loads(json.dumps(Fits(total=Counts(9, 3, 2), worst=[(4, 0.2)]).state()))
    assert Fits.of(state) == Fits(total=Counts(9, 3, 2), worst=[(4, 0.2)])
