"""Losses and noise, and scans, as real sensors make them, from file to file."""

import math
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias

from .. import files
from .._checks import check_between, check_integer, check_not_negative
from .._command import How, Output, What
from .._errors import InputError, numbering
from .._progress import tracked
from .._report import OutputReport, counted
from ..completion.start import frame_at
from ..degrade.recordings import Vector, degraded, scanned
from ..degrade.shared import mean_edge_of
from ..draw.heatmap import likely_up
from ..files import PathLike, Reader, Source
from ..files.conversion import Axis
from ..files.new_output import refuse_inputs
from ..files.numbered import FrameNames
from ..files.times import numbers_of_files
from ..scans import scan_folder
from ..scans.depth_files import require_png

Share: TypeAlias = float | str
"""A number between 0 and 1, or a percentage such as "30%"."""

_NOISE = 0.02  # mean edges
_CAMERAS = 4
_POINTS = 20_000


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
    cameras: How[int] = _CAMERAS,
    points: How[int] = _POINTS,
    up: How[Axis | None] = None,
    seed: How[int] = 0,
    overwrite: Output[bool] = False,
    progress: bool = False,
) -> OutputReport:
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
        up: the axis that cameras circle around; else, as the file states it, or as it seems.
        seed: equal seeds remove the same vertices: use another one to degrade a file twice.
        overwrite: whether to replace an existing output.
        progress: whether to show on standard error how far it is.

    Raises:
        FileExistsError: the output exists.
        OSError, ImportError, TypeError, ValueError: a file cannot be read or written, or an
            argument is refused.
    """
    shares = {"known": known, "patches": patches, "dropout": dropout, "outliers": outliers}
    asked = {name: _share(name, value) for name, value in shares.items() if value is not None}
    if noise is not None:
        check_not_negative("noise", noise)
    for name, least, value in (("camera", 1, camera), ("cameras", 1, cameras), ("seed", 0, seed)):
        if value is not None:
            check_integer(name, value, least)
    is_scan = scan or depth is not None
    if is_scan:
        for name, given in (("camera", camera), ("dropout", dropout)):
            if given is not None:
                raise InputError("is not for scans", argument=name)
        size = _size_of(depth, scan)
        if size is not None:
            require_png()
            if points != _POINTS:
                raise InputError("is not for depth images", argument="points", value=points)
        with files.open(path, **(source or {})) as reader:
            refuse_inputs(Path(output).glob("*"), reader.files)
            upward, guess = _axis(reader, up)
            rig, scans = scanned(
                reader,
                upward,
                size=size,
                cameras=cameras,
                points=points,
                noise=_NOISE if noise is None else noise,
                missing=1 - asked.get("known", 1.0),
                holes=asked.get("patches", 0.0),
                outliers=asked.get("outliers", 0.0),
                seed=seed,
            )
            n, names = reader.n_frames, FrameNames(Path(output), "%05d")
            numbers = numbers_of_files(reader.header, names)
            with (
                numbering(reader.path, reader.header.number),
                scan_folder(Path(output), rig, overwrite=overwrite, numbers=numbers) as append,
            ):
                measured = 0
                for found in tracked(scans, n, "scanning", progress):
                    append(found)
                    measured += len(found.cloud)
        what = "points" if size is None else "measured pixels"
        told = f"{counted(n, 'frame')} of {measured / n:.0f} {what}"
        told += f" from {counted(cameras, 'camera')}"
        return OutputReport(output=Path(output), frames=n, remarks=(told, *guess))
    for name, value, usual in (("cameras", cameras, _CAMERAS), ("points", points, _POINTS)):
        if value != usual:
            raise InputError("is for scans alone", argument=name, value=value)
    if up is not None and camera is None:
        raise InputError("is for `camera` and scans alone", argument="up", value=up)
    others = {"camera": camera, "noise": noise}
    losses = asked | {name: given for name, given in others.items() if given is not None}
    if not losses:
        raise InputError("nothing to do: ask for a loss, noise, outliers, a scan or depth images")
    with files.open(path, **(source or {})) as reader:
        return _degrade(reader, output, losses, seed, up, overwrite, progress)


def _degrade(
    reader: Reader,
    output: PathLike,
    losses: Mapping[str, Any],
    seed: int,
    up: Axis | None,
    overwrite: bool,
    progress: bool,
) -> OutputReport:
    """Writes a sequence with fewer vertices, and says what is left."""
    target = files.target_of(files.named_like(reader.path, output))
    target.check(overwrite=overwrite, reader=reader)
    upward, guess = _axis(reader, up) if "camera" in losses else ((0.0, 0.0, 1.0), ())
    header = replace(reader.header, has_known=True, has_provenance=False, has_standard_error=False)
    n_known = 0  # after frame 0
    with (
        numbering(reader.path, header.number),
        target.create(header, overwrite=overwrite) as writer,
    ):
        frames = degraded(reader, upward, losses, seed)
        read = tracked(frames, reader.n_frames, "degrading", progress)
        for number, (points, kept) in enumerate(read):
            writer.append(points, kept)
            n_known += int(kept.sum()) if number else 0
    told = []
    if reader.n_frames > 1:
        left = n_known / ((reader.n_frames - 1) * reader.n_vertices)
        told = [f"{left:.1%} of the vertices are known after frame {reader.header.number(0)}"]
    if losses.get("noise"):
        sigma = losses["noise"] * mean_edge_of(frame_at(reader, 0).points, reader.faces)
        told.append(
            f"the noise is {sigma:.3g}, in the unit of the positions, as completion takes it"
        )
    return OutputReport(
        output=Path(output),
        frames=header.n_frames,
        remarks=(*told, *guess, *writer.remarks),
    )


def _share(name: str, value: Share) -> float:
    """Returns a share above 0 and below 1, of which text is a percentage."""
    if not isinstance(value, str):
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


def _axis(reader: Reader, up: Axis | None) -> tuple[Vector, tuple[str, ...]]:
    """Returns the axis that cameras stand around, and says if it is a guess."""
    if up not in (None, "x", "y", "z"):
        raise InputError(f"must be 'x', 'y' or 'z', not {up!r}", argument="up", value=up)
    said = up or reader.header.up_axis
    found = said or likely_up(frame_at(reader, 0).points, None)
    guess = () if said else (f"assuming that {found} is up, as the file does not state it",)
    x, y, z = (float(one == found) for one in "xyz")
    return (x, y, z), guess
