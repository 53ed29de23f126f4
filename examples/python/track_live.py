"""Tracks a mesh in depth frames that arrive through a pipe, as from a depth camera's own program.

    camera_program | python track_live.py body.obj cameras.json > tracked.raw

The pipe carries raw frames without headers: for each camera of cameras.json, in their order, width
times height little-endian 16-bit counts, row by row from the top, 0 where nothing was measured. The
output has the positions of all vertices for each frame, little-endian float32, as
`dynmesh-complete` writes them. The mesh has about the pose of the first frame, and is in the unit
of cameras.json. Standard error tells how long each frame took.
"""

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

import dynmesh
from dynmesh.scans import Rig, read_cameras


def main(template: Path, cameras: Path, source: IO[bytes], sink: IO[bytes]) -> None:
    """Tracks frames as they arrive, until the pipe ends."""
    with dynmesh.open(template) as reader:
        mesh = next(iter(reader)).points.astype(np.float32)
        tracker = dynmesh.Tracker(reader.faces, mesh)
    rig = read_cameras(cameras)
    intrinsics = [np.asarray(camera.intrinsics) for camera in rig.cameras]
    poses = [camera.camera_to_world for camera in rig.cameras]
    completed = np.empty_like(mesh)
    for number, depth in enumerate(frames_in(source, rig)):
        tracker.push_depth(depth, intrinsics, poses, out=completed)
        sink.write(completed.astype("<f4").tobytes())
        sink.flush()
        seen = 100 * np.mean(tracker.observed)
        milliseconds = 1e3 * tracker.report.seconds
        print(f"frame {number}: {milliseconds:.1f} ms, {seen:.0f} % seen", file=sys.stderr)


def frames_in(source: IO[bytes], rig: Rig) -> Iterator[list[NDArray[np.float32]]]:
    """Yields the depth images of each frame, in the unit of the rig."""
    while True:
        images: list[NDArray[np.float32]] = []
        for camera in rig.cameras:
            if camera.size is None or camera.depth_scale is None:
                raise SystemExit(f"camera {camera.name} needs width, height and depth_scale")
            width, height = camera.size
            content = source.read(2 * width * height)
            if not content and not images:
                return
            if len(content) < 2 * width * height:
                raise SystemExit(f"the pipe ends in an image of camera {camera.name}")
            counts = np.frombuffer(content, "<u2").reshape(height, width)
            images.append((counts * camera.depth_scale).astype(np.float32))
        yield images


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Tracks a mesh in depth frames from a pipe.")
    parser.add_argument("template", type=Path, help="the mesh, in any format that dynmesh reads")
    parser.add_argument("cameras", type=Path, help="cameras.json")
    arguments = parser.parse_args()
    main(arguments.template, arguments.cameras, sys.stdin.buffer, sys.stdout.buffer)
