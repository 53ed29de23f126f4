"""The options of `dynmesh degrade`, and the part of it that makes scans."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import typer

from .. import degrade as degradation
from .. import files
from ..degrade.depth_buffer import intrinsics_of, pose_of
from ..files import Source
from ..files.scans import DepthFolder, PointFolder, Rig, ScanCamera
from ..files.scans.depth_files import require_png
from ..frames.naming import numbering
from ..frames.times import numbers_of_files
from ..jobs.option import given
from ..sequence import Positions
from .options import Axis, as_usage, share
from .terminal import say, track

_LOSS, _SCANS = "Loss and noise", "Scans without correspondences"

_COUNTS = 60_000
"""Of the 65 535 that an image can hold, so many are used for the farthest point, at most."""

_NOISE = 0.02  # mean edges


def _share(help: str, group: str = _LOSS) -> Any:
    return given(None, help, group, metavar="SHARE", parse=share)


@dataclass(frozen=True, kw_only=True)
class Degradation:
    """What can be asked of the command; :mod:`dynmesh.degrade` explains the losses."""

    known: float | None = _share("Keep this share of the vertices, at random in every frame.")
    camera: int | None = given(
        None, "Keep what N circling cameras see.", _LOSS, int, metavar="N", least=1
    )
    patches: float | None = _share("Hide this share under patches, for several frames.")
    dropout: float | None = _share("Drop this share of the frames entirely.")
    noise: float | None = given(
        None,
        "Add Gaussian noise of this standard deviation, in mean edges of frame 0. [0.02 for scans]",
        _LOSS,
        float,
        metavar="SIGMA",
    )
    outliers: float | None = _share("Move this share of the vertices by 10 mean edges of frame 0.")
    scan: bool = given(
        False,
        "Write loose points with normals, as scanners deliver them, into the folder OUT.",
        _SCANS,
        bool,
    )
    depth: str | None = given(
        None,
        "Write depth images of this size into the folder OUT, such as 640x480.",
        _SCANS,
        metavar="WxH",
    )
    cameras: int = given(
        4, "Number of cameras around the subject.", _SCANS, int, metavar="N", least=1
    )
    points: int = given(20_000, "Points per frame.", _SCANS, int, metavar="N", least=1)
    flying: float | None = _share(
        "Share of flying pixels, which lie between a silhouette and what is behind it.", _SCANS
    )
    room: bool = given(False, "Put a floor under the subject and a wall behind it.", _SCANS, bool)
    up: Axis | None = given(
        None, "The axis that cameras circle around. [as in IN, else z]", _LOSS, Axis
    )
    seed: int = given(
        0,
        "Equal seeds remove the same vertices: use another one to degrade a file twice.",
        _LOSS,
        int,
        metavar="N",
        least=0,
    )


def _size_of(depth: str | None, scan: bool) -> tuple[int, int] | None:
    """Parses the size of depth images; None if points are wanted."""
    if depth is None:
        return None
    if scan:
        raise typer.BadParameter("give one of --scan and --depth")
    size = re.fullmatch("([1-9][0-9]{0,4})x([1-9][0-9]{0,4})", depth)
    if size is None:
        raise typer.BadParameter(
            f"must be width x height, such as 640x480, not {depth}", param_hint="'--depth'"
        )
    return int(size[1]), int(size[2])


def simulate(
    path: Path,
    output: Path,
    source: Source,
    asked: Degradation,
    *,
    overwrite: bool,
    refused: Mapping[str, object],
) -> None:
    """Writes scans of a sequence into a folder, and where the cameras stand beside them."""
    depth, cameras = _size_of(asked.depth, asked.scan), asked.cameras
    for option, value in refused.items():
        if value is not None:
            raise typer.BadParameter(f"{option} cannot be combined with --scan or --depth")
    if depth is not None:
        require_png()
    with files.open(path, **source) as reader:
        axis = axis_of(reader, asked.up)
        box = bounding_box(reader)
        around = degradation.orbit(box, cameras, degrees_per_frame=0.0, up=axis.vector)(0)
        room = degradation.room_around(box, up=axis.vector) if asked.room else None
        seen = box if room is None else np.concatenate([box, room.points])
        rig = _rig_of(around, seen, depth, reader.header.metres_per_unit)
        frames = (frame.points for frame in reader)
        options: dict[str, Any] = {
            "noise": _NOISE if asked.noise is None else asked.noise,
            "missing": 0.0 if asked.known is None else 1 - asked.known,
            "holes": asked.patches or 0.0,
            "flying": asked.flying or 0.0,
            "outliers": asked.outliers or 0.0,
            "room": room,
        }
        scan: Any = degradation.scan_points
        folder_of: Any = PointFolder
        if depth is None:
            options["points"] = asked.points
        else:
            scan, folder_of = degradation.depth_images, DepthFolder
            options["width"], options["height"] = depth
        with as_usage("--noise"):
            scans = scan(frames, reader.faces, around, seed=asked.seed, **options)
        measured = 0
        n = reader.n_frames
        numbers = numbers_of_files(reader.header)
        with (
            numbering(reader.path, reader.header),
            folder_of(output, rig, overwrite=overwrite, numbers=numbers) as folder,
        ):
            for found in track(scans, n, "scanning"):
                folder.append(found)
                if depth is None:
                    measured += len(found.points)
                else:
                    measured += sum(int(np.count_nonzero(one)) for one in found.depth)
    what = "points" if depth is None else "measured pixels"
    many = "1 camera" if cameras == 1 else f"{cameras} cameras"
    say(f"{output}: {n} frames of {measured / n:.0f} {what} from {many}, on average")


def axis_of(reader: files.Reader, up: Axis | None) -> Axis:
    """Returns the axis that cameras stand around, and says if it is a guess."""
    if up is None and reader.header.up_axis is None:
        say("assuming that z is up; if not, use --up y")
    return up or Axis(reader.header.up_axis or "z")


def bounding_box(reader: files.Reader) -> Positions:
    """Returns the two opposite corners of the bounding box of all frames."""
    corners = np.array([[np.inf] * 3, [-np.inf] * 3])
    for points, _ in reader:
        finite = points[np.isfinite(points).all(axis=1)]
        if len(finite):
            corners[0] = np.minimum(corners[0], finite.min(axis=0))
            corners[1] = np.maximum(corners[1], finite.max(axis=0))
    return corners


def _rig_of(
    cameras: list[degradation.Camera],
    seen: Positions,
    size: tuple[int, int] | None,
    metres_per_unit: float | None,
) -> Rig:
    """Describes the cameras, as their file does."""
    box = np.stack([seen.min(axis=0), seen.max(axis=0)])
    corners = np.stack(np.meshgrid(*box.T), axis=-1).reshape(-1, 3)
    described = []
    for number, camera in enumerate(cameras):
        pose = pose_of(camera)
        if size is None:
            described.append(ScanCamera(str(number), pose))
            continue
        farthest = ((corners - pose[:3, 3]) @ pose[:3, 2]).max()
        scale = _round_number(farthest / _COUNTS)
        described.append(ScanCamera(str(number), pose, intrinsics_of(camera, *size), scale, size))
    return Rig(tuple(described), metres_per_unit)


def _round_number(least: float) -> float:
    """Returns the smallest number of at least this that is 1, 2 or 5 times a power of ten."""
    power = math.floor(math.log10(least))
    numbers = (float(f"{digit}e{power}") for digit in (1, 2, 5, 10))
    return next(number for number in numbers if number >= least)
