"""Scans and cameras in files, as several tests need them."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from commands import dynmesh_command
from meshes import Array, Mesh, turned
from PIL import Image

import dynmesh
from dynmesh import Sequence, losses
from dynmesh.losses.visibility import intrinsics_of, pose_of
from dynmesh.scans import (
    DepthScan,
    PointScan,
    Rig,
    ScanCamera,
    ScanReader,
    open_scans,
    scan_folder,
)
from dynmesh.topology import mean_edge_of


def opened(path: Path, **options: Any) -> Any:
    """The scans of a path, whose kind a test knows."""
    return open_scans(path, **options)


def moving_body(n: int, shift: float = 0.01, scale: Any = 1) -> Sequence:
    """A smooth closed body without symmetries, which moves and turns."""
    sphere = trimesh.creation.icosphere(subdivisions=3)
    x, y, z = np.asarray(sphere.vertices, np.float64).T
    radii = 1 + 0.25 * np.sin(3 * x + 1) * np.cos(2 * y) + 0.2 * np.sin(2.5 * z + x)
    vertices = np.stack([1.3 * x, y, 0.7 * z], axis=1) * radii[:, None] * scale
    frames = [turned(vertices, 0.02 * i) + shift * i for i in range(n)]
    return Sequence(np.stack(frames), np.asarray(sphere.faces, np.int64), up_axis="z")


def scanned_body(folder: Path, n: int, *words: str, name: str = "points") -> Sequence:
    """Writes a moving body, its first frame and what a command makes of it into a folder."""
    truth = moving_body(n)
    dynmesh.write(folder / "truth.npz", truth)
    dynmesh.write(folder / "body.obj", truth[:1])
    dynmesh_command("degrade", folder / "truth.npz", folder / name, *words)
    return truth


def error(tracked: Sequence, truth: Sequence) -> Array:
    """The mean distance from the true vertex in each frame, in mean edges."""
    distances = np.linalg.norm(tracked.vertices - truth.vertices, axis=2)
    return np.asarray(distances.mean(axis=1) / mean_edge_of(truth.vertices[0], truth.faces))


def some_points(dtype: Any = np.float64, n: int = 7) -> PointScan:
    rng = np.random.default_rng(3)
    points, normals = rng.normal(size=(2, n, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return PointScan(points.astype(dtype), normals.astype(dtype), None)


def a_rig(n: int = 2, size: tuple[int, int] = (8, 6), unit: float | None = None) -> Rig:
    cameras = losses.orbit(np.array([[0.0, 0, 0], [1, 1, 1]]), n)(0)
    described = [
        ScanCamera(f"c{i}", pose_of(camera), intrinsics_of(camera, *size), 0.001, size)
        for i, camera in enumerate(cameras)
    ]
    return Rig(tuple(described), unit)


def room_around(points: Any) -> Mesh:
    """A floor under a subject and a wall behind it, as seen by the first camera of an orbit."""
    low, high = points.min(axis=0), points.max(axis=0)
    middle, size = (low + high) / 2, np.linalg.norm(high - low)
    origin = np.array([middle[0], middle[1], low[2]])
    floor = [(-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0)]
    wall = [(-2.5, -4, 0), (-2.5, 4, 0), (-2.5, 4, 3), (-2.5, -4, 3)]
    square = np.array([[0, 1, 2], [0, 2, 3]])
    faces = np.concatenate([square, square + 4])
    return Mesh(faces, origin + size * np.array(floor + wall, np.float64))


def scanned_in_a_room(
    truth: Sequence, folder: Path, size: tuple[int, int] | None = None, cameras: int = 4
) -> None:
    """Writes points of a subject in a room, or depth images, and the cameras."""
    everywhere = truth.vertices.reshape(-1, 3)
    room = room_around(everywhere)
    n, k, _ = truth.vertices.shape
    frames = np.concatenate([truth.vertices, np.repeat(room.vertices[None], n, axis=0)], axis=1)
    faces = np.concatenate([truth.faces, room.faces + k])
    noise = 0.02 * mean_edge_of(truth.vertices[0], truth.faces) / mean_edge_of(frames[0], faces)
    around = losses.orbit(everywhere, cameras, degrees_per_frame=0)(0)
    described = [
        ScanCamera(str(i), pose_of(camera), intrinsics_of(camera, *size), 0.001, size)
        if size
        else ScanCamera(str(i), pose_of(camera))
        for i, camera in enumerate(around)
    ]
    scans: Any = losses.scan_points(frames, faces, around, noise=noise)
    if size:
        width, height = size
        scans = losses.depth_images(frames, faces, around, width=width, height=height, noise=noise)
    with scan_folder(folder, Rig(tuple(described), None)) as append:
        for scan in scans:
            append(scan)


def saved(image: Image.Image) -> bytes:
    """The bytes of a PNG file, by Pillow."""
    held = io.BytesIO()
    image.save(held, format="PNG")
    return held.getvalue()


def three_frames(folder: Path) -> Path:
    """Images of c0 and c1 that are 1, 2 and 3 away."""
    with scan_folder(folder, a_rig(2)) as append:
        for depth in (1, 2, 3):
            image = np.full((6, 8), depth, np.float32)
            append(DepthScan([image, image], [], []))
    return folder


def seen(reader: ScanReader) -> list[list[tuple[str, float]]]:
    """The cameras of each frame, and what they see in the middle."""
    return [
        []
        if scan is None
        else list(
            zip(reader.cameras_of(n), (round(float(d[3, 4]), 3) for d in scan.depth), strict=True)
        )
        for n, scan in enumerate(reader)
        if not isinstance(scan, PointScan)
    ]
