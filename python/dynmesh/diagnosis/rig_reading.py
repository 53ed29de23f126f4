"""How scans and template are read, the other ways in which they may be meant, and what is said."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..files.scans import AS_STATED, UNITS, Corrections, Rig, ScanCamera
from ..sequence import Positions

Turns = tuple[tuple[str, float], ...]
"""Axes, "x", "y" or "z", and angles in degrees, counterclockwise as seen from the end of the axis;
the first turn is done first."""

_FACTORS = (0.001, 0.01, 0.1, 10.0, 100.0, 1000.0)
"""Between units of length that are confused."""

_IMAGE_RATIOS = (0.2, 0.25, 1 / 3, 0.5, 2 / 3, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0)
"""Between sizes of images of the same camera."""

_MOST_SWAPPED = 8
"""Cameras, above which no exchange of two is tried, as there would be too many."""


@dataclass(frozen=True)
class Reading:
    """How scans and template are read.

    Attributes:
        corrections: what is said about the cameras.
        turns: of the template, around the middle of its bounding box.
        factor: the length of the unit of the scans in that of the template.
    """

    corrections: Corrections = AS_STATED
    turns: Turns = ()
    factor: float = 1.0

    def cameras_of(
        self, stated: Rig | None, sizes: Mapping[str, tuple[int, int]]
    ) -> dict[str, ScanCamera]:
        """Returns the cameras as they are meant, by name, for images of these sizes."""
        if stated is None:
            return {}
        return {
            camera.name: self.corrections.for_images(camera, *sizes[camera.name])
            for camera in self.corrections.of(stated).cameras
            if camera.name in sizes
        }


class Units(NamedTuple):
    """The units of length in metres, None if nothing says them.

    Attributes:
        scans: of the scans.
        template: of the template.
        is_stated: whether the files of the scans say theirs, so that no option changes it.
    """

    scans: float | None = None
    template: float | None = None
    is_stated: bool = False


NO_UNITS = Units()
"""Nothing says the units."""


class Hypothesis(NamedTuple):
    """Another way in which scans and template may be meant.

    Attributes:
        condition: in words, after "if".
        options: those that read them so, by the names of the options of :func:`track_file`.
        reading: with these options.
        advice: what else must be changed, for what no option changes.
    """

    condition: str
    options: dict[str, Any]
    reading: Reading
    advice: str = ""

    @property
    def is_of_units(self) -> bool:
        """Whether sizes change."""
        return bool(self.advice) or not {"scan_unit", "depth_scale"}.isdisjoint(self.options)

    @property
    def remedy(self) -> str:
        """What the user has to do: the options as the shell and Python take them, or the advice."""
        if self.advice:
            return self.advice
        options = (f"--{name.replace('_', '-')} {_written(v)}" for name, v in self.options.items())
        keywords = ", ".join(f"{name}={value!r}" for name, value in self.options.items())
        return f"{' '.join(options)} (in Python, {keywords})"


@dataclass(frozen=True)
class RigFinding:
    """Something that is wrong with a rig.

    Attributes:
        message: a sentence with the numbers, and what to do.
        options: those that repair it, by the names of the options of :func:`track_file`; empty if
            none does.
        camera: the name of the camera that it is about, or None.
        is_refused: whether tracking would be in vain.
    """

    message: str
    options: dict[str, Any]
    camera: str | None = None
    is_refused: bool = False


def turned(points: Positions, turns: Turns) -> Positions:
    """Returns a template after turns around the middle of its bounding box."""
    if not turns:
        return points
    middle = (points.min(axis=0) + points.max(axis=0)).astype(np.float64) / 2
    moved = (points - middle) @ _matrix_of(turns).T + middle
    return np.asarray(moved, points.dtype)


def about_poses(reading: Reading) -> Iterator[Hypothesis]:
    """Yields other conventions of the poses."""
    poses = {
        "camera-to-world": "the poses are taken as camera to world",
        "world-to-camera": "the poses are taken as world to camera",
    }
    axes = {
        "opencv": "the cameras have the axes of OpenCV (y down, z ahead)",
        "opengl": "the cameras have the axes of OpenGL (y up, z back)",
    }
    now = reading.corrections
    (pose,) = (name for name in poses if name != now.poses)
    (axis,) = (name for name in axes if name != now.axes)
    ways: list[tuple[str, dict[str, Any]]] = [
        (poses[pose], {"poses": pose}),
        (axes[axis], {"axes": axis}),
        (f"{poses[pose]} and {axes[axis]}", {"poses": pose, "axes": axis}),
    ]
    if now.matrices == "rows":
        how = "the rotations of the poses are listed column by column"
        matrices = {"matrices": "transposed-rotations"}
        ways += [(how, matrices), (f"{how} and {axes[axis]}", {**matrices, "axes": axis})]
    for condition, options in ways:
        yield _corrected(reading, condition, options)


def about_swapped(reading: Reading, rig: Rig) -> Iterator[Hypothesis]:
    """Yields the exchanges of two cameras."""
    names = [camera.name for camera in rig.cameras]
    for one, other in combinations(names, 2) if len(names) <= _MOST_SWAPPED else ():
        condition = f"cameras {one!r} and {other!r} are exchanged"
        yield _corrected(reading, condition, {"swap_cameras": (one, other)})


def about_images(
    reading: Reading, rig: Rig, sizes: dict[str, tuple[int, int]]
) -> Iterator[Hypothesis]:
    """Yields other sizes of the images that the intrinsics are for, as their centres suggest."""
    for camera in rig.cameras:
        if camera.name in sizes and camera.intrinsics is not None:
            width, height = sizes[camera.name]
            now = (2 * camera.intrinsics[:2, 2] + 1) / (width, height)
            likely = [r for r in _IMAGE_RATIOS if np.abs(now / r - 1).max() < 0.15]
            for ratio in sorted(likely, key=lambda r: float(np.abs(now / r - 1).max())):
                size = round(width * ratio), round(height * ratio)
                condition = f"the intrinsics are for images of {size[0]} x {size[1]} pixels"
                yield _corrected(reading, condition, {"intrinsics_size": size})
            return


def about_units(reading: Reading, rig: Rig | None, units: Units) -> Iterator[Hypothesis]:
    """Yields other units, of everything and of the depths alone."""
    for factor in _FACTORS:
        options, condition, advice = _units_after(factor, units)
        other = replace(reading, factor=reading.factor * factor)
        yield Hypothesis(condition, options, other, advice)
    scales = {c.depth_scale for c in rig.cameras} if rig is not None else {None}
    scale = reading.corrections.depth_scale or (scales.pop() if len(scales) == 1 else None)
    for factor in _FACTORS if scale is not None else ():
        new = float(f"{(scale or 1) * factor:.12g}")
        condition = f"the depth of one count is {new:g}, {factor:g} times that of the file"
        alone = _corrected(reading, condition, {"depth_scale": new})
        yield alone
        options, more, advice = _units_after(1 / factor, units)
        both = replace(alone.reading, factor=reading.factor / factor)
        told = alone.options | options
        advice = advice and f"--depth-scale {new:g}, and {advice}"
        yield Hypothesis(f"{condition}, and {more}", told, both, advice)


def about_turns(reading: Reading) -> Iterator[Hypothesis]:
    """Yields the other 23 rotations of the template that exchange axes, the simple ones first."""
    found = [np.eye(3)]
    quarter = [(axis, angle) for axis in "yxz" for angle in (180.0, 90.0, -90.0)]
    ways: list[Turns] = [(one,) for one in quarter]
    ways += [(one, other) for one in quarter for other in quarter if one[0] != other[0]]
    for turns in ways:
        matrix = np.round(_matrix_of(turns))
        if not any((matrix == known).all() for known in found):
            found.append(matrix)
            words = " and ".join(f"by {angle:g} degrees about {axis}" for axis, angle in turns)
            whole = reading.turns + turns
            other = replace(reading, turns=whole)
            yield Hypothesis(f"the template is turned {words}", {"turn_template": whole}, other)


def _corrected(reading: Reading, condition: str, options: dict[str, Any]) -> Hypothesis:
    other = replace(reading.corrections, **options)
    return Hypothesis(condition, options, replace(reading, corrections=other))


def _units_after(factor: float, units: Units) -> tuple[dict[str, Any], str, str]:
    """Returns the options, the words and the advice for scans that are `factor` times as large."""
    if units.scans is not None or units.template is not None:
        known = units.scans if units.scans is not None else units.template
        unit = _name_of((known or 1.0) * factor)
        condition = f"the unit of the scans is {unit}"
        if units.is_stated:
            stated = _name_of(known or 1.0)
            return {}, condition, f"write so in the files of the scans, which state {stated}"
        return {"scan_unit": unit}, condition, ""
    names = {length: name for name, length in UNITS.items()}
    for theirs in (1.0, 0.01, 0.001):
        ours = float(f"{theirs * factor:.12g}")
        if ours in names:
            one, other = names[ours], names[theirs]
            condition = f"the unit of the scans is {one} and that of the template {other}"
            return {"scan_unit": one, "template_unit": other}, condition, ""
    return {"scan_unit": factor, "template_unit": 1.0}, f"a unit of the scans is {factor:g}", ""


def _name_of(metres: float) -> str:
    rounded = float(f"{metres:.12g}")
    return {length: name for name, length in UNITS.items()}.get(rounded, f"{rounded:g}")


def _written(value: Any) -> str:
    """Returns the value of an option as the shell takes it."""
    if isinstance(value, tuple) and value and isinstance(value[0], tuple):
        return ",".join(f"{axis}:{angle:g}" for axis, angle in value)
    if isinstance(value, tuple):
        return ("x" if isinstance(value[0], int) else ",").join(map(str, value))
    return f"{value:g}" if isinstance(value, float) else str(value)


def _matrix_of(turns: Turns) -> NDArray[np.float64]:
    matrix = np.eye(3)
    for axis, degrees in turns:
        cosine, sine = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        i = "xyz".index(axis)
        one = np.eye(3)
        j, k = (i + 1) % 3, (i + 2) % 3
        one[j, j] = one[k, k] = cosine
        one[j, k], one[k, j] = -sine, sine
        matrix = one @ matrix
    return matrix
