"""The picture of docs/guides/track.md: points without correspondences, and the tracked mesh."""

from pathlib import Path

import numpy as np

import dynmesh
from dynmesh.draw import figures
from dynmesh.tracking.placing import push_scan

from ..harness import progress
from ..runner import vertex_error
from ..subjects import Subject
from .completions import Picture, view_of
from .strip import DOTS, Panel, draw_surface, save

WALKER = Picture("track/walker.png", [104], 40, (), (360, 480))
CAMERAS = 2
POINTS = 20_000


def draw(picture: Picture, subject: Subject, folder: Path) -> None:
    """Tracks a sequence that cameras scan up to one frame, and draws it beside the truth."""
    (shown,) = picture.frames
    frames = subject.vertices[: shown + 1]
    # The cameras circle the positions of all frames, so that no point leaves the pictures.
    cameras = dynmesh.degrade.orbit(frames.reshape(-1, 3), CAMERAS, up=subject.up_vector)
    scans = dynmesh.degrade.scan_points(
        frames, subject.faces, cameras, points=POINTS, outliers=0.01
    )
    tracker = dynmesh.Tracker(subject.faces, frames[0])
    for scan in progress(scans, picture.file, shown + 1):
        frame = push_scan(tracker, scan)
    truth = frames[shown]
    error = vertex_error(subject, shown, frame)
    view = view_of(picture, subject).around(truth)
    ahead = scan.points[scan.normals @ view.axes[2] > 0]
    dots = np.ones(len(ahead), np.bool_)
    points = figures.render(subject.faces[:0], ahead, view, np.zeros(len(ahead)), (DOTS,), dots)
    panels = [
        Panel("scan", f"{len(scan.points)} points, {CAMERAS} cameras", [points]),
        Panel("true", "", [draw_surface(subject.faces, truth, view)]),
        Panel(
            "tracked",
            f"off by {100 * np.mean(error):.2f} % on average",
            [draw_surface(subject.faces, frame, view, error)],
        ),
    ]
    save(panels, folder / picture.file)
