"""The frames of a sequence as sensors leave them: degraded, or scanned by cameras around them."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from .._arrays import Mask, Positions
from ..frame import Frames
from ..scan import Scan
from ..scans import Rig, ScanCamera
from .losses import (
    add_noise,
    add_outliers,
    camera_known,
    dropout,
    patch_known,
    random_known,
    round_up,
)
from .scans import depth_images, scan_points
from .visibility import Camera, intrinsics_of, orbit, pose_of

_COUNTS = 60_000
"""Of the 65 535 that an image can hold, so many are used for the farthest point, at most."""

Vector = tuple[float, float, float]


def degraded_frames(
    reader: Frames, up: Vector, losses: Mapping[str, Any], seed: int
) -> Iterator[tuple[Positions, Mask]]:
    """Yields positions, which are NaN where nothing was observed, and masks of a sequence.

    The losses are those of :func:`dynmesh.degrade` that are asked for, by name.
    """
    shape, faces = (reader.n_frames, reader.n_vertices), reader.faces
    masks: list[Iterator[Mask]] = []
    if "known" in losses:
        masks.append(random_known(*shape, losses["known"], seed=seed))
    if "camera" in losses:
        circling = orbit(_bounding_box(reader), losses["camera"], up=up)
        masks.append(camera_known(_points(reader), faces, circling))
    if "patches" in losses:
        masks.append(patch_known(faces, *shape, losses["patches"], seed=seed))
    if "dropout" in losses:
        masks.append(dropout(*shape, losses["dropout"], seed=seed))
    moved = _points(reader)
    if "noise" in losses:
        moved = add_noise(moved, faces, losses["noise"], seed=seed)
    if "outliers" in losses:
        moved = add_outliers(moved, faces, losses["outliers"], seed=seed)
    missing = reader.dtype.type(np.nan)
    for points, *seen in zip(moved, (frame.observed for frame in reader), *masks, strict=True):
        kept = np.logical_and.reduce(seen)
        # Unknown positions are erased, so that no method can use them.
        yield np.where(kept[:, None], points, missing), kept


def scanned(
    reader: Frames,
    up: Vector,
    *,
    size: tuple[int, int] | None,
    cameras: int,
    points: int,
    **options: Any,
) -> tuple[Rig, Iterator[Scan]]:
    """Returns cameras around a sequence, and their scans of its frames.

    The options are those of :func:`scan_points`; `size` is that of depth images, None for points.
    """
    box = _bounding_box(reader)
    around = orbit(box, cameras, degrees_per_frame=0.0, up=up)(0)
    rig = _rig_of(around, box, size, reader.header.metres_per_unit)
    given = _points(reader), reader.faces, around
    if size is None:
        return rig, scan_points(*given, points=points, **options)
    return rig, depth_images(*given, width=size[0], height=size[1], **options)


def _points(reader: Frames) -> Iterator[Positions]:
    """Yields the positions that there are; the rest is NaN."""
    missing = reader.dtype.type(np.nan)
    for frame in reader:
        yield np.where(frame.present[:, None], frame.points, missing)


def _bounding_box(reader: Frames) -> Positions:
    corners = np.array([[np.inf] * 3, [-np.inf] * 3])
    for points in _points(reader):
        finite = points[np.isfinite(points).all(axis=1)]
        if len(finite):
            corners[0] = np.minimum(corners[0], finite.min(axis=0))
            corners[1] = np.maximum(corners[1], finite.max(axis=0))
    return corners


def _rig_of(
    cameras: list[Camera],
    box: Positions,
    size: tuple[int, int] | None,
    metres_per_unit: float | None,
) -> Rig:
    corners = np.stack(np.meshgrid(*box.T), axis=-1).reshape(-1, 3)
    described = []
    for number, camera in enumerate(cameras):
        pose = pose_of(camera)
        if size is None:
            described.append(ScanCamera(str(number), pose))
            continue
        farthest = ((corners - pose[:3, 3]) @ pose[:3, 2]).max()
        scale = round_up(farthest / _COUNTS)
        described.append(ScanCamera(str(number), pose, intrinsics_of(camera, *size), scale, size))
    return Rig(tuple(described), metres_per_unit)
