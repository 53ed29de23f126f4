"""Scans and cameras in files, as several tests need them."""

import io
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from dynmesh import degrade
from dynmesh.degrade.depth_buffer import intrinsics_of, pose_of
from dynmesh.scans import DepthFolder, DepthScan, PointScan, Rig, ScanCamera, ScanReader


def some_points(dtype: Any = np.float64, n: int = 7) -> PointScan:
    rng = np.random.default_rng(3)
    points, normals = rng.normal(size=(2, n, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return PointScan(points.astype(dtype), normals.astype(dtype), None)


def a_rig(n: int = 2, size: tuple[int, int] = (8, 6), unit: float | None = None) -> Rig:
    cameras = degrade.orbit(np.array([[0.0, 0, 0], [1, 1, 1]]), n)(0)
    described = [
        ScanCamera(f"c{i}", pose_of(camera), intrinsics_of(camera, *size), 0.001, size)
        for i, camera in enumerate(cameras)
    ]
    return Rig(tuple(described), unit)


def saved(image: Image.Image) -> bytes:
    """The bytes of a PNG file, by Pillow."""
    held = io.BytesIO()
    image.save(held, format="PNG")
    return held.getvalue()


def three_frames(folder: Path) -> Path:
    """Images of c0 and c1 that are 1, 2 and 3 away."""
    with DepthFolder(folder, a_rig(2)) as written:
        for depth in (1, 2, 3):
            image = np.full((6, 8), depth, np.float32)
            written.append(DepthScan([image, image], [], []))
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
