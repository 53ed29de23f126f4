"""`cameras.json`: where the cameras of a scan stand, and how they project, as OpenCV does.

docs/reference/scans.md says what its fields mean.
"""

import json
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from .._arrays import Floats
from .._checks import (
    check_finite,
    check_flags,
    check_integer,
    check_not_negative,
    check_positive,
)
from .._errors import DynmeshError, InputError, naming
from ..formats.names import Number
from ..formats.units import UNITS, metres_of
from .matrices import check_intrinsics, matrix_of, pose_of
from .trajectory import poses_in
from .transforms import as_cameras

_BY_NAME = re.compile("[A-Za-z0-9.-]+")
_OF_IMAGES = ("depth_scale", "distortion", "flipped", "along_ray")
_OPTIONAL = ("camera_to_world", "poses", "within", "intrinsics", "width", "height", *_OF_IMAGES)

_WITHIN = 0.02
"""Seconds between the time of an image and that of its pose, as TUM's own programs allow."""

_COEFFICIENTS = (4, 5, 8, 12, 14)
"""How many of them OpenCV knows: k1 k2 p1 p2, then k3, then k4 k5 k6, and so on."""


@dataclass(frozen=True, eq=False)
class ScanCamera:
    """A camera of a rig.

    Attributes:
        name: letters, digits, points and hyphens; the end of the names of its images.
        camera_to_world: (4, 4) its pose; (n, 4, 4) if it moves.
        intrinsics: (3, 3), or None if the camera only tells from where points were seen; (n, 3, 3)
            if it moves.
        depth_scale: the depth of one count of its images; None without intrinsics.
        size: width and height of its images, or None if they are not stated.
        distortion: the coefficients of its lens, in the order of OpenCV; empty if it has none.
        frames: the ascending numbers of the frames of n poses; empty if it stands still.
        within: by how much the number of a frame may differ from that of its pose.
        flipped: the axes along which the pixels of its images are in reverse order: "x", if left
            and right are exchanged, "y", "xy" or "".
        along_ray: whether its images hold distances from the camera itself, along the rays of the
            pixels, instead of along its axis.
    """

    name: str
    camera_to_world: Floats
    intrinsics: Floats | None = None
    depth_scale: float | None = None
    size: tuple[int, int] | None = None
    distortion: tuple[float, ...] = ()
    frames: tuple[Number, ...] = ()
    within: float = 0.0
    flipped: str = ""
    along_ray: bool = False

    def at(self, number: Number) -> "ScanCamera":
        """Returns the camera as it stands in the frame with this number."""
        if not self.frames:
            return self
        away = np.abs(np.array(self.frames) - number)
        nearest = int(away.argmin())
        if away[nearest] > self.within:
            raise InputError(
                f"has no pose of camera {self.name!r} for frame {number:.16g}; the nearest is that "
                f"of {self.frames[nearest]:.16g}"
            )
        intrinsics = None if self.intrinsics is None else self.intrinsics[nearest]
        pose = self.camera_to_world[nearest]
        return replace(self, camera_to_world=pose, intrinsics=intrinsics, frames=())


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
    def moves(self) -> bool:
        """Whether a camera does."""
        return any(camera.frames for camera in self.cameras)

    def viewpoints(self, number: Number) -> Floats:
        """Returns (c, 3) the positions of the cameras in a frame; errors are those of `at`."""
        poses = [camera.at(number).camera_to_world for camera in self.cameras]
        return np.array(poses)[:, :3, 3]


def read_cameras(path: Path) -> Rig:
    """Reads `cameras.json`, the `transforms.json` of nerfstudio, or a trajectory as those of TUM.

    Raises:
        OSError: the file cannot be read.
        ValueError: it does not hold cameras; the message names the file, the camera, the field and
            the value.
    """
    with naming(path):
        is_json = path.suffix == ".json" or path.read_bytes().lstrip().startswith((b"{", b"["))
        if not is_json:
            moving = {"name": "camera", "poses": poses_in(path), "within": _WITHIN}
            return _rig_of({"cameras": [moving]}, path)
        described = json_in(path)
        if isinstance(described, dict) and "frames" in described:
            described = as_cameras(described, path.parent)
        return _rig_of(described, path)


def json_in(path: Path) -> Any:
    """Returns what a JSON file holds."""
    try:
        return json.loads(path.read_text(encoding="utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise InputError(f"is not JSON: {error}") from error


def write_cameras(path: Path, rig: Rig) -> None:
    """Writes `cameras.json`."""
    listed = []
    for camera in rig.cameras:
        poses = [{"frame": frame, **_matrices(camera.at(frame))} for frame in camera.frames]
        values = {
            "name": camera.name,
            **({"poses": poses} if poses else _matrices(camera)),
            "within": camera.within or None,
            "depth_scale": camera.depth_scale,
            "width": camera.size and camera.size[0],
            "height": camera.size and camera.size[1],
            "distortion": camera.distortion or None,
            "flipped": camera.flipped or None,
            "along_ray": camera.along_ray or None,
        }
        listed.append({name: value for name, value in values.items() if value is not None})
    names: dict[float | None, str] = {length: name for name, length in UNITS.items()}
    unit = names.get(rig.metres_per_unit, rig.metres_per_unit)
    text = json.dumps({"unit": unit, "cameras": listed}, indent=1, default=np.ndarray.tolist)
    path.write_text(text + "\n", encoding="utf-8")


def _matrices(camera: ScanCamera) -> dict[str, Floats]:
    pose = {"camera_to_world": camera.camera_to_world}
    return pose if camera.intrinsics is None else {**pose, "intrinsics": camera.intrinsics}


def _rig_of(described: Any, file: Path) -> Rig:
    _check_fields(described, ("cameras",), ("unit",))
    if not isinstance(described["cameras"], list) or not described["cameras"]:
        raise InputError(f"cameras: must be a list of them, not {described['cameras']!r:.60}")
    cameras: dict[str, ScanCamera] = {}
    for number, entry in enumerate(described["cameras"]):
        try:
            camera = _camera_of(entry, file.parent)
            if camera.name in cameras:
                raise InputError(f"name: there is a second {camera.name!r}")
        except DynmeshError as error:
            raise InputError(f"camera {number}: {error}") from error
        cameras[camera.name] = camera
    unit = described.get("unit")
    return Rig(tuple(cameras.values()), None if unit is None else metres_of(unit), file)


def _camera_of(described: Any, folder: Path) -> ScanCamera:
    _check_fields(described, ("name",), _OPTIONAL)
    name = described["name"]
    if not isinstance(name, str) or not _BY_NAME.fullmatch(name):
        raise InputError(f"name: must be letters, digits, '.' or '-', not {name!r:.60}")
    size = None
    if "width" in described or "height" in described:
        for field in ("width", "height"):
            check_integer(field, described.get(field), 1)
        size = described["width"], described["height"]
    if ("poses" in described) == ("camera_to_world" in described):
        raise InputError("camera_to_world: is needed or, if the camera moves, poses")
    camera = _moving(name, described, folder) if "poses" in described else _fixed(name, described)
    camera = replace(camera, size=size)
    if camera.intrinsics is None:
        for field in _OF_IMAGES:
            if field in described:
                raise InputError(f"intrinsics: is missing, but there is a {field}")
        return camera
    if "depth_scale" not in described:
        raise InputError("depth_scale: is missing; it is the depth of one count of the images")
    check_positive("depth_scale", described["depth_scale"])
    scale = float(described["depth_scale"])
    distortion = _distortion(described["distortion"]) if "distortion" in described else ()
    if distortion and size is None:
        raise InputError("width: is missing; a distortion needs width and height")
    if distortion and camera.intrinsics[..., 0, 1].any():
        raise InputError("intrinsics: with a distortion, the skew must be 0, as in OpenCV")
    if distortion and (camera.intrinsics != camera.intrinsics.reshape(-1, 3, 3)[0]).any():
        raise InputError("intrinsics: with a distortion, all poses must have the same")
    flipped, along_ray = described.get("flipped", ""), described.get("along_ray", False)
    if flipped not in ("", "x", "y", "xy"):
        raise InputError(f"flipped: must be 'x', 'y' or 'xy', not {flipped!r:.60}")
    check_flags(along_ray=along_ray)
    return replace(
        camera, depth_scale=scale, distortion=distortion, flipped=flipped, along_ray=along_ray
    )


def _fixed(name: str, described: Any) -> ScanCamera:
    """Reads a pose and, if there are any, intrinsics."""
    pose = pose_of("camera_to_world", described["camera_to_world"])
    if "intrinsics" not in described:
        return ScanCamera(name, pose)
    intrinsics = matrix_of("intrinsics", described["intrinsics"], 3)
    check_intrinsics(intrinsics)
    return ScanCamera(name, pose, intrinsics)


def _moving(name: str, described: Any, folder: Path) -> ScanCamera:
    """Reads the poses of a camera, which are listed or in a file, and their intrinsics."""
    entries, is_file = described["poses"], isinstance(described["poses"], str)
    if is_file:
        with naming(folder / entries):
            entries = poses_in(folder / entries)
    if not isinstance(entries, list) or not entries:
        raise InputError(f"poses: must be a list of them, or a file, not {entries!r:.60}")
    by_frame = dict[Number, ScanCamera]()
    of_all = {field: described[field] for field in ("intrinsics",) if field in described}
    for entry in entries:
        _check_fields(entry, ("frame", "camera_to_world"), ("intrinsics",))
        frame = entry["frame"]
        check_finite("poses: frame", frame)
        if frame in by_frame:
            raise InputError(f"poses: there are two of frame {frame}")
        try:
            by_frame[frame] = _fixed(name, {**of_all, **entry})
        except DynmeshError as error:
            raise InputError(f"poses: frame {frame}: {error}") from error
    frames = sorted(by_frame)
    poses = np.stack([by_frame[frame].camera_to_world for frame in frames])
    matrices = [m for frame in frames if (m := by_frame[frame].intrinsics) is not None]
    if len(matrices) not in (0, len(frames)):
        raise InputError("intrinsics: must be those of all poses, not of some")
    within = described.get("within", _WITHIN if is_file else 0.0)
    check_not_negative("within", within)
    intrinsics = np.stack(matrices) if matrices else None
    return ScanCamera(name, poses, intrinsics, frames=tuple(frames), within=within)


def _distortion(listed: Any) -> tuple[float, ...]:
    if not isinstance(listed, list) or len(listed) not in _COEFFICIENTS:
        counts = ", ".join(map(str, _COEFFICIENTS))
        raise InputError(
            f"distortion: must be as many numbers as OpenCV has, one of {counts}: k1 k2 p1 p2 k3 "
            f"..., not {listed!r:.60}"
        )
    for value in listed:
        check_finite("distortion", value)
    return tuple(map(float, listed))


def _check_fields(described: Any, needed: tuple[str, ...], optional: tuple[str, ...]) -> None:
    """Refuses what is no object with these fields."""
    if not isinstance(described, dict):
        raise InputError(f"must be an object with {' and '.join(needed)}, not {described!r:.60}")
    fields = (*needed, *optional)
    for name in described:
        if name not in fields:
            raise InputError(f"unknown field {name!r:.60}; the fields are {', '.join(fields)}")
    for name in needed:
        if name not in described:
            raise InputError(f"{name}: is missing")
