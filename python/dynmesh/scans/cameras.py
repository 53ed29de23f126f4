"""`cameras.json`: where the cameras of a scan stand, and how they project, as OpenCV does.

The file is an object with `unit`, the length of a unit in the poses and of `depth_scale` ("m",
"cm", "mm", a number of metres, or null if it is that of the template), and `cameras`, a list of
objects with `name`, `camera_to_world` (4 x 4, rows first: from camera coordinates, x right, y down,
z ahead, to the world) and, for depth images, `intrinsics` (3 x 3: from camera coordinates to
pixels, the centre of the first pixel at (0, 0)), `depth_scale` (the depth of one count) and,
optionally, `width` and `height` in pixels. With these, there may be a `distortion`: the
coefficients of the lens.
"""

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._checks import check_finite, check_integer, check_positive
from .._errors import naming
from ..files.units import UNITS, metres_of
from .matrices import check_intrinsics, check_pose, matrix_of

_Floats = NDArray[np.float64]

_BY_NAME = re.compile("[A-Za-z0-9.-]+")
_OPTIONAL = ("intrinsics", "depth_scale", "width", "height", "distortion")

_COEFFICIENTS = (4, 5, 8, 12, 14)
"""How many of them OpenCV knows: k1 k2 p1 p2, then k3, then k4 k5 k6, and so on."""


@dataclass(frozen=True, eq=False)
class ScanCamera:
    """A camera of a rig.

    Attributes:
        name: letters, digits, points and hyphens; the end of the names of its images.
        camera_to_world: (4, 4) its pose.
        intrinsics: (3, 3), or None if the camera only tells from where points were seen.
        depth_scale: the depth of one count of its images; None without intrinsics.
        size: width and height of its images, or None if they are not stated.
        distortion: the coefficients of its lens, in the order of OpenCV; empty if it has none.
    """

    name: str
    camera_to_world: _Floats
    intrinsics: _Floats | None = None
    depth_scale: float | None = None
    size: tuple[int, int] | None = None
    distortion: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False)
class Rig:
    """The cameras of a scan.

    Attributes:
        cameras: at least one, with different names.
        metres_per_unit: of the poses and of `depth_scale`; None if it is not stated.
        file: from which they were read, if they were.
    """

    cameras: tuple[ScanCamera, ...]
    metres_per_unit: float | None = None
    file: Path | None = None

    @property
    def viewpoints(self) -> _Floats:
        """(c, 3) the positions of the cameras."""
        return np.array([camera.camera_to_world[:3, 3] for camera in self.cameras])


def read_cameras(path: Path) -> Rig:
    """Reads `cameras.json`.

    Raises:
        OSError: the file cannot be read.
        ValueError: it does not hold cameras; the message names the file, the camera, the field and
            the value.
    """
    with naming(path):
        return _rig_of(json_in(path), path)


def json_in(path: Path) -> Any:
    """Returns what a JSON file holds.

    Raises:
        OSError: it cannot be read.
        ValueError: it is not JSON; the message names the line.
    """
    try:
        return json.loads(path.read_text(encoding="utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise ValueError(f"is not JSON: {error}") from error


def write_cameras(path: Path, rig: Rig) -> None:
    """Writes `cameras.json`."""
    listed = []
    for camera in rig.cameras:
        told = {
            "name": camera.name,
            "camera_to_world": camera.camera_to_world,
            "intrinsics": camera.intrinsics,
            "depth_scale": camera.depth_scale,
            "width": camera.size and camera.size[0],
            "height": camera.size and camera.size[1],
            "distortion": camera.distortion or None,
        }
        listed.append({name: value for name, value in told.items() if value is not None})
    names: dict[float | None, str] = {length: name for name, length in UNITS.items()}
    unit = names.get(rig.metres_per_unit, rig.metres_per_unit)
    text = json.dumps({"unit": unit, "cameras": listed}, indent=1, default=np.ndarray.tolist)
    path.write_text(text + "\n", encoding="utf-8")


def _rig_of(found: Any, file: Path) -> Rig:
    _check_fields(found, ("cameras",), ("unit",))
    if not isinstance(found["cameras"], list) or not found["cameras"]:
        raise ValueError(f"cameras: must be a list of them, not {found['cameras']!r:.60}")
    cameras: dict[str, ScanCamera] = {}
    for number, told in enumerate(found["cameras"]):
        try:
            camera = _camera_of(told)
            if camera.name in cameras:
                raise ValueError(f"name: there is a second {camera.name!r}")
        except (TypeError, ValueError) as error:
            raise ValueError(f"camera {number}: {error}") from error
        cameras[camera.name] = camera
    unit = found.get("unit")
    return Rig(tuple(cameras.values()), None if unit is None else metres_of(unit), file)


def _camera_of(told: Any) -> ScanCamera:
    _check_fields(told, ("name", "camera_to_world"), _OPTIONAL)
    name = told["name"]
    if not isinstance(name, str) or not _BY_NAME.fullmatch(name):
        raise ValueError(f"name: must be letters, digits, '.' or '-', not {name!r:.60}")
    pose = matrix_of("camera_to_world", told["camera_to_world"], 4)
    check_pose(pose)
    size = None
    if "width" in told or "height" in told:
        for field in ("width", "height"):
            check_integer(field, told.get(field), 1)
        size = told["width"], told["height"]
    if "intrinsics" not in told:
        for field in ("depth_scale", "distortion"):
            if field in told:
                raise ValueError(f"intrinsics: is missing, but there is a {field}")
        return ScanCamera(name, pose, size=size)
    intrinsics = matrix_of("intrinsics", told["intrinsics"], 3)
    check_intrinsics(intrinsics)
    if "depth_scale" not in told:
        raise ValueError("depth_scale: is missing; it is the depth of one count of the images")
    check_positive("depth_scale", told["depth_scale"])
    scale = float(told["depth_scale"])
    distortion = _distortion(told["distortion"]) if "distortion" in told else ()
    if distortion and size is None:
        raise ValueError("width: is missing; a distortion needs width and height")
    if distortion and intrinsics[0, 1] != 0:
        raise ValueError("intrinsics: with a distortion, the skew must be 0, as in OpenCV")
    return ScanCamera(name, pose, intrinsics, scale, size, distortion)


def _distortion(listed: Any) -> tuple[float, ...]:
    if not isinstance(listed, list) or len(listed) not in _COEFFICIENTS:
        counts = ", ".join(map(str, _COEFFICIENTS))
        raise ValueError(
            f"distortion: must be as many numbers as OpenCV has, one of {counts}: k1 k2 p1 p2 k3 "
            f"..., not {listed!r:.60}"
        )
    for value in listed:
        check_finite("distortion", value)
    return tuple(map(float, listed))


def _check_fields(told: Any, needed: tuple[str, ...], optional: tuple[str, ...]) -> None:
    """Refuses what is no object with these fields."""
    if not isinstance(told, dict):
        raise ValueError(f"must be an object with {' and '.join(needed)}, not {told!r:.60}")
    fields = (*needed, *optional)
    for name in told:
        if name not in fields:
            raise ValueError(f"unknown field {name!r:.60}; the fields are {', '.join(fields)}")
    for name in needed:
        if name not in told:
            raise ValueError(f"{name}: is missing")
