"""Frames that script/dev/try-platforms completes and tracks on each platform, and differences.

platform_frames.py write FOLDER          body.obj, partial.raw, cameras.txt and depth.raw
platform_frames.py compare FOLDER A B    the largest distance of a vertex of two results
"""

import sys
from pathlib import Path

import numpy as np

import dynmesh
from dynmesh import losses
from dynmesh.losses.visibility import intrinsics_of, pose_of

SIDE, COUNT = 96, 0.001
LARGEST = 1e-3
"""In mean edges, what rounding may make."""


def write(folder: Path) -> None:
    """Writes an ocean, of whose frames a third is known, and depth images of it by two cameras."""
    sea = dynmesh.synth.ocean(30, grid=40)
    dynmesh.write(folder / "body.obj", sea[:1])
    known = np.stack(list(losses.random_known(30, 1600, 1 / 3)))[1:]
    partial = np.where(known[..., None], sea.vertices[1:], np.float32(np.nan))
    (folder / "partial.raw").write_bytes(partial.tobytes())
    cameras = losses.orbit(sea.vertices[0], 2)(0)
    numbers = [
        (SIDE, SIDE, COUNT, *intrinsics_of(one, SIDE, SIDE).ravel(), *pose_of(one).ravel())
        for one in cameras
    ]
    np.savetxt(folder / "cameras.txt", np.array(numbers), fmt="%.17g")
    scans = losses.depth_images(sea.vertices[:12], sea.faces, cameras, width=SIDE, height=SIDE)
    counts = [np.rint(np.stack(scan.depth) / COUNT).astype("<u2") for scan in scans]
    (folder / "depth.raw").write_bytes(np.stack(counts).tobytes())


def compare(folder: Path, one: Path, other: Path) -> None:
    """Prints the largest distance, and fails if it is more than that of rounding."""
    body = dynmesh.read(folder / "body.obj")
    corners = body.vertices[0][body.faces]
    mean_edge = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean()
    apart = np.subtract(*(np.fromfile(path, "<f4").reshape(-1, 3) for path in (one, other)))
    largest = np.linalg.norm(apart, axis=1).max() / mean_edge
    print(f"{largest:.2g}")
    if not largest < LARGEST:
        sys.exit(f"{other}: differs by more than rounding")


if __name__ == "__main__":
    verb, *paths = sys.argv[1:]
    (write if verb == "write" else compare)(*map(Path, paths))
