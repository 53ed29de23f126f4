"""Losses and noise, and scans, as real sensors make them."""

import contextlib
import math
import re
from collections.abc import Generator, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias

from .. import formats
from .._checks import (
    check_between,
    check_choice,
    check_flags,
    check_integer,
    check_not_negative,
    check_text,
)
from .._errors import InputError, numbering
from .._options import Input, Method
from .._report import OutputReport, Report, counted, tracked
from ..formats import OneSequence
from ..formats.names import FrameNames
from ..formats.output import refuse_inputs
from ..formats.times import numbers_of_files
from ..frame import Frame, Frames, frame_at
from ..header import Axis
from ..losses.sequences import Vector, degraded_frames, scanned
from ..polygons import Faces
from ..run import Run
from ..scans import ScanRun, scan_folder
from ..scans.depth_files import require_pillow
from ..sequence import result_of
from ..topology import likely_up, mean_edge_of

Share: TypeAlias = float | str
"""A number between 0 and 1, or a percentage such as "30%"."""

_NOISE = 0.02  # mean edges
_CAMERAS = 4
_POINTS = 20_000


def degrade(
    sequence: OneSequence,
    faces: Faces | None = None,
    *,
    known: Input[Share | None] = None,
    camera: Input[int | None] = None,
    patches: Input[Share | None] = None,
    dropout: Input[Share | None] = None,
    noise: Input[float | None] = None,
    outliers: Input[Share | None] = None,
    scan: Input[bool] = False,
    depth: Input[str | None] = None,
    cameras: Method[int] = _CAMERAS,
    points: Method[int] = _POINTS,
    up: Method[Axis | None] = None,
    seed: Method[int] = 0,
    progress: bool | None = None,
) -> Run[Report] | Any:
    """Removes vertices and adds noise, or makes scans, as real sensors do.

    Frame 0 remains complete. Losses can be combined. A share is a number between 0 and 1 or a
    percentage: 0.3 means 30%. Scans are points that belong to no vertex; frame 0 is scanned, too,
    and `known`, `patches` and `outliers` then apply to the points or pixels. Scans are written to a
    folder.

    Args:
        sequence: the sequence: a file, frames, a sequence in memory, positions (n, k, 3) or meshes.
        faces: of positions alone.
        known: keep this share of the vertices, at random in every frame.
        camera: the number of circling cameras, at least 1; what they see is kept.
        patches: hide this share under patches, for several frames.
        dropout: drop this share of the frames entirely.
        noise: add Gaussian noise of this standard deviation, in mean edges of frame 0; scans have
            0.02 unless it is given.
        outliers: move this share of the vertices by 10 mean edges of frame 0.
        scan: make loose points with normals, as scanners deliver them.
        depth: make depth images of this size, such as 640x480.
        cameras: number of cameras around the subject, of scans.
        points: points of a frame, of scans.
        up: the axis that cameras circle around; else, as the file states it, or as it seems.
        seed: equal seeds remove the same vertices: use another one to degrade a file twice.
        progress: whether to show on standard error how far it is; None for what takes long, in a
            terminal.

    Returns:
        The frames with masks: a :class:`dynmesh.Sequence` of frames in memory; of others, a
        :class:`dynmesh.frames.Run`, whose frames are made when they are gone through. Or a
        :class:`dynmesh.scans.ScanRun` of scans.
    """
    check_flags(scan=scan)
    shares = {"known": known, "patches": patches, "dropout": dropout, "outliers": outliers}
    losses: dict[str, Any] = {
        name: _share(name, value) for name, value in shares.items() if value is not None
    }
    if noise is not None:
        check_not_negative("noise", noise)
        losses["noise"] = noise
    for name, least, given in (("camera", 1, camera), ("cameras", 1, cameras), ("seed", 0, seed)):
        if given is not None:
            check_integer(name, given, least)
    if camera is not None:
        losses["camera"] = camera
    with contextlib.ExitStack() as stack:
        if scan or depth is not None:
            for name, value in (("camera", camera), ("dropout", dropout)):
                if value is not None:
                    raise InputError("is not for scans", argument=name)
            size = _size_of(depth, scan)
            if size is not None:
                require_pillow()
                if points != _POINTS:
                    raise InputError("is not for depth images", argument="points", value=points)
            source = stack.enter_context(formats.opened(sequence, faces=faces))
            how = {"size": size, "cameras": cameras, "points": points, "seed": seed}
            result = _scans(source, losses, up, how, progress)
            result.closing = stack.pop_all().close
            return result
        if cameras != _CAMERAS:
            message = "is for scans alone; `camera` is the number of cameras of a loss"
            raise InputError(message, argument="cameras", value=cameras)
        if points != _POINTS:
            raise InputError("is for scans alone", argument="points", value=points)
        if camera is None and up is not None:
            raise InputError("is for `camera` and scans alone", argument="up", value=up)
        if not losses:
            message = "nothing to do: ask for a loss, noise, outliers, a scan or depth images"
            raise InputError(message)
        source = stack.enter_context(formats.opened(sequence, faces=faces))
        upward, guess = _axis(source, up) if "camera" in losses else ((0.0, 0.0, 1.0), ())
        header = replace(source.header, attributes=["known"])

        def make() -> Generator[Frame, None, Report]:
            n_known = 0  # after frame 0
            with numbering(source.path, header.number):
                frames = degraded_frames(source, upward, losses, seed)
                watched = tracked(frames, source.n_frames, "degrading", progress)
                for number, (points, kept) in enumerate(watched):
                    yield Frame(points, kept)
                    n_known += int(kept.sum()) if number else 0
            return Report(remarks=(*_left(source, n_known, losses), *guess))

        run: Run[Report] = Run(
            header, make, source, origin=source.origin, close=stack.pop_all().close
        )
    return result_of(run, source)


def _scans(
    source: Frames,
    losses: Mapping[str, Any],
    up: Axis | None,
    how: Mapping[str, Any],
    progress: bool | None,
) -> ScanRun:
    """Scans of a sequence, and how they are written."""
    upward, guess = _axis(source, up)
    rig, scans = scanned(
        source,
        upward,
        noise=losses.get("noise", _NOISE),
        missing=1 - losses.get("known", 1.0),
        holes=losses.get("patches", 0.0),
        outliers=losses.get("outliers", 0.0),
        **how,
    )
    n = source.n_frames

    def save(folder: Path, overwrite: bool, each: Iterator[Any]) -> OutputReport:
        refuse_inputs(folder.glob("*"), source.files)
        numbers, measured = numbers_of_files(source.header, FrameNames(folder, "%05d")), 0
        with (
            numbering(source.path, source.header.number),
            scan_folder(folder, rig, overwrite=overwrite, numbers=numbers) as append,
        ):
            for result in tracked(each, n, "scanning", progress):
                append(result)
                measured += len(result.cloud)
        what = "points" if how["size"] is None else "measured pixels"
        message = f"{counted(n, 'frame')} of {measured / n:.0f} {what}"
        message += f" from {counted(how['cameras'], 'camera')}"
        return OutputReport(output=folder, frames=n, remarks=(message, *guess))

    return ScanRun(n, scans, save)


def _left(source: Frames, n_known: int, losses: Mapping[str, Any]) -> Iterator[str]:
    if source.n_frames > 1:
        left = n_known / ((source.n_frames - 1) * source.n_vertices)
        first = source.header.number(0)
        yield f"{left:.1%} of the vertices are known after frame {first}"
    if losses.get("noise"):
        sigma = losses["noise"] * mean_edge_of(frame_at(source, 0).points, source.faces)
        yield f"the noise is {sigma:.3g}, in the unit of the positions, as completion takes it"


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
        message = f"must be a share between 0 and 1 such as 0.3 or 30%, not {value!r}"
        raise InputError(message, argument=name, value=value)
    return share


def _size_of(depth: str | None, scan: bool) -> tuple[int, int] | None:
    """Parses the size of depth images; None if points are wanted."""
    if depth is None:
        return None
    if scan:
        raise InputError("is one of two: points or depth images", argument="scan")
    check_text("depth", depth)
    size = re.fullmatch("([1-9][0-9]{0,4})x([1-9][0-9]{0,4})", depth)
    if size is None:
        message = f"must be width x height, such as 640x480, not {depth!r}"
        raise InputError(message, argument="depth", value=depth)
    return int(size[1]), int(size[2])


def _axis(reader: Frames, up: Axis | None) -> tuple[Vector, tuple[str, ...]]:
    """Returns the axis that cameras stand around, and says if it is a guess."""
    if up is not None:
        check_choice("up", up, Axis)
    said = up or reader.header.up_axis
    result = said or likely_up(frame_at(reader, 0).points, None)
    guess = () if said else (f"assuming that {result} is up, as the file does not state it",)
    x, y, z = (float(axis == result) for axis in "xyz")
    return (x, y, z), guess
