"""What makes the result of tracking doubtful."""

from pathlib import Path

import numpy as np
import pytest
from commands import dynmesh_command as run
from meshes import turned
from PIL import Image
from test_track import bumpy

import dynmesh
from dynmesh import track_file
from dynmesh.tracking.fits import Counts, Fits


@pytest.fixture(scope="module")
def ruined_first(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Depth images of a body, of which frame 1 has wrong depths.

    One image is damaged, and one frame is empty.
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
    return folder


def test_frames_cameras_and_images_are_told(ruined_first: Path, tmp_path: Path) -> None:
    scans, template = ruined_first / "scans", ruined_first / "body.obj"
    report = track_file(scans, tmp_path / "out.npz", template=template)
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
