"""What makes the result of tracking doubtful."""

from pathlib import Path

import numpy as np
from commands import dynmesh_command as run
from meshes import turned
from PIL import Image
from test_track import bumpy

import dynmesh
from dynmesh import track_file
from dynmesh.tracking.fits import Counts, Fits


def test_frames_cameras_and_images_are_told(tmp_path: Path) -> None:
    """Frame 1 has wrong depths, one image is damaged, and one frame is empty."""
    mesh, scans = bumpy(), tmp_path / "scans"
    frames = [turned(mesh.vertices, 0.02 * i) + 0.01 * i for i in range(6)]
    truth = dynmesh.Sequence(np.stack(frames), mesh.faces, up_axis="z")
    dynmesh.write(tmp_path / "truth.npz", truth)
    dynmesh.write(tmp_path / "body.obj", truth[:1])
    run("degrade", tmp_path / "truth.npz", scans, "--depth", "120x90")
    for file in scans.glob("depth_00001_*.png"):
        with Image.open(file) as image:
            farther = np.array(image, np.float64) * 1.1
        Image.fromarray(farther.astype(np.uint16)).save(file)
    damaged = scans / "depth_00000_2.png"
    damaged.write_bytes(damaged.read_bytes()[:-20])
    for file in scans.glob("depth_00002_*.png"):
        file.write_bytes(b"")
    report = track_file(scans, tmp_path / "out.npz", template=tmp_path / "body.obj")
    assert report.quality == "ruined"
    assert [frame for frame, _ in report.worst] == [1]
    assert report.empty == 1
    assert len(report.lost) == 5


def test_the_share_of_far_points_is_the_quality() -> None:
    assert Counts().share is None
    assert Counts(100, 25).share == 0.25
    assert Fits(total=Counts(1000, 19)).quality == "good"
    assert Fits(total=Counts(1000, 40)).quality == "doubtful"
    assert Fits(total=Counts(1000, 60)).quality == "ruined"
