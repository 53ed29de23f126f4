"""Losses and noise, and scans, as real sensors make them, from file to file."""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from .. import degrade, files
from .._checks import check_between, check_integer, check_not_negative
from .._command import How, Output, What
from .._errors import InputError
from .._progress import tracked
from .._report import Report
from ..degrade.depth_buffer import intrinsics_of, pose_of
from ..degrade.shared import mean_edge_of
from ..files import PathLike, Reader, Source
from ..files.conversion import Axis
from ..files.naming import numbering
from ..files.times import numbers_of_files
from ..scans import DepthFolder, PointFolder, Rig, ScanCamera
from ..scans.depth_files import require_png
from ..sequence import Mask, Positions

Share: TypeAlias = float | str
"""A number between 0 and 1, or a percentage such as "30%"."""

_COUNTS = 60_000
"""Of the 65 535 that an image can hold, so many are used for the farthest point, at most."""

_NOISE = 0.02  # mean edges


@dataclass(frozen=True, kw_only=True)
class DegradeReport(Report):
    """What :func:`degrade_file` has done.

    Attributes:
        output: the file or folder that was written.
        frames: number of frames in it.
        told: what is left of them, in sentences.
    """

    output: Path
    frames: int
    told: tuple[str, ...]

    def lines(self) -> list[str]:
        """Says what is left."""
        return [*self.told, *super().lines()]


def degrade_file(
    path: PathLike,
    output: PathLike,
    *,
    known: What[Share | None] = None,
    camera: What[int | None] = None,
    patches: What[Share | None] = None,
    dropout: What[Share | None] = None,
    noise: What[float | None] = None,
    outliers: What[Share | None] = None,
    scan: What[bool] = False,
    depth: What[str | None] = None,
    source: Source | None = None,
    cameras: How[int] = 4,
    points: How[int] = 20_000,
    flying: How[Share | None] = None,
    room: How[bool] = False,
    up: How[Axis | None] = None,
    seed: How[int] = 0,
    overwrite: Output[bool] = False,
    progress: bool = False,
) -> DegradeReport:
    """Removes vertices and adds noise, or makes scans, as real sensors do.

    Frame 0 remains complete. Losses can be combined. A share is a number between 0 and 1 or a
    percentage: 0.3 means 30%. Scans are points that belong to no vertex; frame 0 is scanned, too,
    and `known`, `patches` and `outliers` then apply to the points or pixels.

    Args:
        path: the sequence: a file, a folder, or a pattern such as 'scans/*.ply'.
        output: the result; of scans, a folder.
        known: keep this share of the vertices, at random in every frame.
        camera: keep what so many circling cameras see.
        patches: hide this share under patches, for several frames.
        dropout: drop this share of the frames entirely.
        noise: add Gaussian noise of this standard deviation, in mean edges of frame 0; scans have
            0.02 unless it is given.
        outliers: move this share of the vertices by 10 mean edges of frame 0.
        scan: write loose points with normals, as scanners deliver them.
        depth: write depth images of this size, such as 640x480.
        source: how to read the file.
        cameras: number of cameras around the subject, of scans.
        points: points of a frame, of scans.
        flying: share of flying pixels, which lie between a silhouette and what is behind it.
        room: put a floor under the subject and a wall behind it, in scans.
        up: the axis that cameras circle around; else, as the file states it, or z.
        seed: equal seeds remove the same vertices: use another one to degrade a file twice.
        overwrite: whether to replace an existing output.
        progress: whether to show a bar on standard error.

    Raises:
        FileExistsError: the output exists.
        OSError, ImportError, TypeError, ValueError: a file cannot be read or written, or an
            argument is refused.
    """
    shares = {
        "known": known,
        "patches": patches,
        "dropout": dropout,
        "outliers": outliers,
        "flying": flying,
    }
    asked = {name: _share(name, value) for name, value in shares.items() if value is not None}
    if noise is not None:
        check_not_negative("noise", noise)
    for name, least, value in (("camera", 1, camera), ("cameras", 1, cameras), ("seed", 0, seed)):
        if value is not None:
            check_integer(name, value, least)
    is_scan = scan or depth is not None
    for name, given, of_scans in (
        ("camera", camera is not None, False),
        ("dropout", dropout is not None, False),
        ("flying", flying is not None, True),
        ("room", room, True),
    ):
        if given and is_scan != of_scans:
            why = "is for scans and depth images alone" if of_scans else "is not for scans"
            raise InputError(why, argument=name)
    if is_scan:
        size = _size_of(depth, scan)
        return _scan(
            Path(path), Path(output), source or {}, asked, noise, size, cameras, points, room, up,
            seed, overwrite, progress,
        )  # fmt: skip
    if not asked and camera is None and noise is None:
        raise InputError("nothing to do: ask for a loss, noise, outliers, a scan or depth images")
    target = files.target_of(output)
    with files.open(path, **(source or {})) as reader:
        target.check(overwrite=overwrite, reader=reader)
        shape = reader.n_frames, reader.n_vertices
        guess: tuple[str, ...] = ()
        masks: list[Iterator[Mask]] = []
        if "known" in asked:
            masks.append(degrade.random_known(*shape, asked["known"], seed=seed))
        if camera is not None:
            axis, guess = _axis(reader, up)
            circling = degrade.orbit(_bounding_box(reader), camera, up=axis)
            frames = (frame.points for frame in reader)
            masks.append(degrade.camera_known(frames, reader.faces, circling))
        if "patches" in asked:
            masks.append(degrade.patch_known(reader.faces, *shape, asked["patches"], seed=seed))
        if "dropout" in asked:
            masks.append(degrade.dropout(*shape, asked["dropout"], seed=seed))
        moved: Iterator[Positions] = (frame.points for frame in reader)
        if noise is not None:
            moved = degrade.add_noise(moved, reader.faces, noise, seed=seed)
        if "outliers" in asked:
            moved = degrade.add_outliers(moved, reader.faces, asked["outliers"], seed=seed)
        header = replace(
            reader.header, has_known=True, has_provenance=False, has_standard_error=False
        )
        n_known, sigma = -reader.n_vertices, 0.0  # frame 0 is always complete and is not counted
        with (
            numbering(reader.path, header),
            target.create(header, overwrite=overwrite) as writer,
        ):
            rows = zip(moved, (frame.known for frame in reader), *masks, strict=True)
            for position, *observed in tracked(rows, reader.n_frames, "degrading", progress):
                if noise and not sigma:
                    sigma = noise * mean_edge_of(position, reader.faces)
                seen = [mask for mask in observed if mask is not None]
                kept = np.logical_and.reduce(seen) if seen else np.ones(len(position), np.bool_)
                # Unknown positions are erased, so that no method can use them.
                writer.append(np.where(kept[:, None], position, reader.dtype.type(np.nan)), kept)
                n_known += int(kept.sum())
        left = n_known / max(1, (reader.n_frames - 1) * reader.n_vertices)
        told = [f"{left:.1%} of the vertices are known after frame {reader.header.number(0)}"]
    if sigma:
        told.append(
            f"the noise is {sigma:.3g}, in the unit of the positions, as completion takes it"
        )
    return DegradeReport(
        output=Path(output),
        frames=header.n_frames,
        told=tuple(told),
        remarks=(*guess, *writer.remarks),
    )


def _scan(
    path: Path,
    output: Path,
    source: Source,
    asked: dict[str, float],
    noise: float | None,
    size: tuple[int, int] | None,
    cameras: int,
    points: int,
    room: bool,
    up: Axis | None,
    seed: int,
    overwrite: bool,
    progress: bool,
) -> DegradeReport:
    """Writes scans of a sequence into a folder, and where the cameras stand beside them."""
    if size is not None:
        require_png()
    with files.open(path, **source) as reader:
        axis, guess = _axis(reader, up)
        box = _bounding_box(reader)
        around = degrade.orbit(box, cameras, degrees_per_frame=0.0, up=axis)(0)
        built = degrade.room_around(box, up=axis) if room else None
        seen = box if built is None else np.concatenate([box, built.points])
        rig = _rig_of(around, seen, size, reader.header.metres_per_unit)
        options: dict[str, Any] = {
            "noise": _NOISE if noise is None else noise,
            "missing": 1 - asked.get("known", 1.0),
            "holes": asked.get("patches", 0.0),
            "flying": asked.get("flying", 0.0),
            "outliers": asked.get("outliers", 0.0),
            "room": built,
        }
        scan: Any = degrade.scan_points
        folder_of: Any = PointFolder
        if size is None:
            options["points"] = points
        else:
            scan, folder_of = degrade.depth_images, DepthFolder
            options["width"], options["height"] = size
        frames = (frame.points for frame in reader)
        scans = scan(frames, reader.faces, around, seed=seed, **options)
        measured, n = 0, reader.n_frames
        numbers = numbers_of_files(reader.header)
        with (
            numbering(reader.path, reader.header),
            folder_of(output, rig, overwrite=overwrite, numbers=numbers) as folder,
        ):
            for found in tracked(scans, n, "scanning", progress):
                folder.append(found)
                clouds = [found.points] if size is None else [one[one > 0] for one in found.depth]
                measured += sum(map(len, clouds))
    what = "points" if size is None else "measured pixels"
    many = "1 camera" if cameras == 1 else f"{cameras} cameras"
    told = f"{n} frames of {measured / n:.0f} {what} from {many}, on average"
    return DegradeReport(output=output, frames=n, told=(told,), remarks=guess)


def _share(name: str, value: Share) -> float:
    """Returns a share above 0 and below 1, of which text is a percentage."""
    if not isinstance(value, str):
        advice = f"; for {value:g} per cent, write {value:g}%" if 1 <= value < 100 else ""
        if advice:
            told = f"must be above 0 and below 1, not {value:g}{advice}"
            raise InputError(told, argument=name, value=value)
        check_between(name, value, 0, 1)
        return float(value)
    try:
        share = float(value.strip().removesuffix("%")) / 100
    except ValueError:
        share = math.nan
    if not (value.strip().endswith("%") and 0 < share < 1):
        told = f"must be a share between 0 and 1 such as 0.3 or 30%, not {value!r}"
        raise InputError(told, argument=name, value=value)
    return share


def _size_of(depth: str | None, scan: bool) -> tuple[int, int] | None:
    """Parses the size of depth images; None if points are wanted."""
    if depth is None:
        return None
    if scan:
        raise InputError("is one of two: points or depth images", argument="scan")
    size = re.fullmatch("([1-9][0-9]{0,4})x([1-9][0-9]{0,4})", depth)
    if size is None:
        told = f"must be width x height, such as 640x480, not {depth!r}"
        raise InputError(told, argument="depth", value=depth)
    return int(size[1]), int(size[2])


def _axis(reader: Reader, up: Axis | None) -> tuple[tuple[float, float, float], tuple[str, ...]]:
    """Returns the axis that cameras stand around, and says if it is a guess."""
    if up not in (None, "x", "y", "z"):
        raise InputError(f"must be 'x', 'y' or 'z', not {up!r}", argument="up", value=up)
    said = up or reader.header.up_axis
    x, y, z = (float(axis == (said or "z")) for axis in "xyz")
    return (x, y, z), () if said else ("assuming that z is up, as the file does not state it",)


def _bounding_box(reader: Reader) -> Positions:
    """Returns the two opposite corners of the bounding box of all frames."""
    corners = np.array([[np.inf] * 3, [-np.inf] * 3])
    for points, _ in reader:
        finite = points[np.isfinite(points).all(axis=1)]
        if len(finite):
            corners[0] = np.minimum(corners[0], finite.min(axis=0))
            corners[1] = np.maximum(corners[1], finite.max(axis=0))
    return corners


def _rig_of(
    cameras: list[degrade.Camera],
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
