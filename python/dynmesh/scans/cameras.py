"""`cameras.json`: where the cameras of a scan stand, and how they project, as OpenCV does.

docs/reference/scans.md says what its fields mean.
"""

import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .._arrays import Floats, Positions
from .._checks import (
    check_finite,
    check_flags,
    check_integer,
    check_not_negative,
    check_positive,
    path_of,
)
from .._errors import InputError, naming, within
from ..formats.conversion import UNITS, metres_of
from ..formats.names import Number
from ..formats.table import PathLike
from .matrices import intrinsics_of, inverted, pose_of, pose_or_lost
from .trajectories import (
    Direction,
    Trajectory,
    as_cameras,
    between,
    is_lost,
    poses_beside,
    poses_in,
    within_of,
)

CAMERAS = "cameras.json"
"""The name under which the cameras are found in a folder of scans."""

_COEFFICIENTS = (4, 5, 8, 12, 14)
"""How many of them OpenCV knows: k1 k2 p1 p2, then k3, then k4 k5 k6, and so on."""


_NOT_NEEDED = "with `gaps` lost, it is not needed"


class LostPoseError(InputError):
    """A camera has no pose in a frame."""


@dataclass(frozen=True, eq=False)
class ScanCamera:
    """A camera of a rig.

    Attributes:
        name: letters, digits, points, hyphens and underscores; the end of the names of its images,
            or of a folder in which they are.
        camera_to_world: (4, 4) its pose; (n, 4, 4) if it moves.
        intrinsics: (3, 3), or None if the camera only tells from where points were seen; (n, 3, 3)
            if it moves.
        depth_scale: the depth of one count of its images; None if they hold metres.
        size: width and height of its images, or None if they are not stated.
        distortion: the coefficients of its lens, in the order of OpenCV; empty if it has none.
        frames: the ascending numbers of the frames of n poses; empty if it stands still. A pose of
            NaN was lost.
        within: by how much the number of a frame may differ from that of the nearest pose. Between
            two poses, the camera moves evenly.
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
        nearest = self._nearest(number)
        told = f"pose of camera {self.name!r} for frame {number:.16g}"
        if abs(self.frames[nearest] - number) > self.within:
            raise LostPoseError(
                f"has no {told}; the nearest is that of {self.frames[nearest]:.16g}; {_NOT_NEEDED}"
            )
        if is_lost(pose := between(self.frames, self.camera_to_world, number, nearest)):
            raise LostPoseError(f"has no finite {told}; {_NOT_NEEDED}")
        intrinsics = None if self.intrinsics is None else self.intrinsics[nearest]
        return replace(self, camera_to_world=pose, intrinsics=intrinsics, frames=())

    def distance(self, number: Number) -> float:
        """Returns how far the number of a frame is from that of the nearest pose."""
        return abs(self.frames[self._nearest(number)] - number) if self.frames else 0.0

    def _nearest(self, number: Number) -> int:
        return int(np.abs(np.array(self.frames) - number).argmin())


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


class Upwards(NamedTuple):
    """What is up.

    Attributes:
        axis: "x", "y" or "z".
        is_reversed: whether it points down.
    """

    axis: str
    is_reversed: bool = False

    def __str__(self) -> str:
        return f"-{self.axis}" if self.is_reversed else self.axis


_UPRIGHT = 0.5
"""The least cosine between an axis and what is up for cameras, on average, that tells what is."""

_AHEAD = 0.5
"""The least cosine between the axis of a camera and the way to what it has seen."""


def upwards(poses: Floats) -> Upwards | None:
    """Returns what is up for cameras (c, 4, 4) that are mostly held upright; None if they differ.

    The y axis of a camera points down.
    """
    if len(poses) == 0:
        return None
    heads = -np.mean(poses[:, :3, 1], axis=0)
    axis = int(np.abs(heads).argmax())
    is_told = abs(heads[axis]) > _UPRIGHT
    return Upwards("xyz"[axis], bool(heads[axis] < 0)) if is_told else None


def upwards_of(rig: Rig | None, cloud: Positions) -> Upwards | None:
    """Returns what is up for the cameras of a rig, of which one scan has these points (n, 3).

    Without intrinsics, a pose may state a position alone: its axes count if what all cameras have
    seen lies ahead of them.
    """
    if rig is None or len(cloud) == 0:
        return None
    middle = np.median(cloud, axis=0)
    every = list[Floats]()
    for camera in rig.cameras:
        poses = camera.camera_to_world.reshape(-1, 4, 4)
        poses = poses[np.isfinite(poses).all(axis=(1, 2))]
        ways = middle - poses[:, :3, 3]
        ahead = np.einsum("pc,pc->p", ways, poses[:, :3, 2])
        if camera.intrinsics is None and (ahead < _AHEAD * np.linalg.norm(ways, axis=1)).any():
            return None
        every.append(poses)
    return upwards(np.concatenate(every))


def read_cameras(path: PathLike, poses: Direction | None = None, scans: Path | None = None) -> Rig:
    """Reads `cameras.json`, a `transforms.json` of nerfstudio, a trajectory or a folder of poses.

    `poses` is where these lead, if not as the kind of the file has it. Files with one pose each are
    sought in the folder of the scans, too.
    """
    path = path_of("path", path)
    with naming(path):
        is_json = path.suffix == ".json" or (
            path.is_file() and path.read_bytes().lstrip().startswith((b"{", b"["))
        )
        described: Any = {"cameras": [{"name": "camera", "poses": path.name}]}
        if is_json:
            described = json_in(path)
        if isinstance(described, dict) and "frames" in described:
            described = as_cameras(described, path.parent)
        folders = [one for one in (scans, path.parent) if one is not None]
        return _rig_of(described, path, partial(_camera_of, folders=folders, direction=poses))


def json_in(path: Path) -> Any:
    """Returns what a JSON file holds."""
    try:
        return json.loads(path.read_text(encoding="utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise InputError(f"is not JSON: {error}") from error


def write_cameras(path: PathLike, rig: Rig) -> None:
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
    path_of("path", path).write_text(text + "\n", encoding="utf-8")


def _matrices(camera: ScanCamera) -> dict[str, Floats]:
    pose = {"camera_to_world": camera.camera_to_world}
    return pose if camera.intrinsics is None else {**pose, "intrinsics": camera.intrinsics}


def _rig_of(described: Any, file: Path, camera_of: Callable[[Any], ScanCamera]) -> Rig:
    fields = _fields(described, {"cameras": _list, "unit": _as_given}, "cameras")
    cameras: dict[str, ScanCamera] = {}
    for number, entry in enumerate(fields["cameras"]):
        with within(f"camera {number}"):
            camera = camera_of(entry)
            if camera.name in cameras:
                raise InputError(f"name: there is a second {camera.name!r}")
        cameras[camera.name] = camera
    unit = fields.get("unit")
    return Rig(tuple(cameras.values()), None if unit is None else metres_of(unit), file)


def _camera_of(
    described: Any, *, folders: Sequence[Path], direction: Direction | None
) -> ScanCamera:
    fields = _fields(described, _CAMERA, "name")
    poses = fields.pop("poses", None)
    if poses is None and "camera_to_world" not in fields:
        poses = poses_beside(folders, fields["name"])
    if (poses is None) == ("camera_to_world" not in fields):
        raise InputError("camera_to_world: is needed or, if the camera moves, poses")
    size = fields.pop("width", None), fields.pop("height", None)
    if (size[0] is None) != (size[1] is None):
        raise InputError("width, height: must be given both or neither")
    if size[0] is not None:
        fields["size"] = size
    if poses is not None:
        moving = _moving(poses, fields.get("intrinsics"), folders[-1])
        listed = moving.pop("direction", None)
        direction = direction or listed
        fields = {**moving, **fields, "intrinsics": moving["intrinsics"]}
    if direction == "world-to-camera":
        fields["camera_to_world"] = inverted(fields["camera_to_world"])
    intrinsics = fields.get("intrinsics")
    if intrinsics is None:
        for field in ("depth_scale", "distortion", "flipped", "along_ray"):
            if field in fields:
                raise InputError(f"intrinsics: is missing, but there is a {field}")
    elif fields.get("distortion"):
        if "size" not in fields:
            raise InputError("width: is missing; a distortion needs width and height")
        if intrinsics[..., 0, 1].any():
            raise InputError("intrinsics: with a distortion, the skew must be 0, as in OpenCV")
        if (intrinsics != intrinsics.reshape(-1, 3, 3)[0]).any():
            raise InputError("intrinsics: with a distortion, all poses must have the same")
    return ScanCamera(**fields)


def _moving(poses: Any, intrinsics: Floats | None, folder: Path) -> dict[str, Any]:
    """Reads the poses of a camera, which are listed or in a file, and their intrinsics."""
    described = dict[str, Any]()
    if isinstance(poses, str):
        with naming(folder / poses):
            poses = poses_in(folder / poses)
    if isinstance(poses, Trajectory):
        described["within"] = within_of(poses)
        described["direction"] = poses.direction
        poses = poses.listed
    by_frame = dict[Number, tuple[Floats, Floats | None]]()
    for entry in _list("poses", poses, ", or a file,"):
        number = entry.get("frame") if isinstance(entry, dict) else None
        with within("poses" if number is None else f"poses: frame {number!r:.60}"):
            pose = _fields(entry, _POSE, "frame", "camera_to_world")
        frame = pose["frame"]
        if frame in by_frame:
            raise InputError(f"poses: there are two of frame {frame}")
        by_frame[frame] = pose["camera_to_world"], pose.get("intrinsics", intrinsics)
    frames = sorted(by_frame)
    matrices = [own for frame in frames if (own := by_frame[frame][1]) is not None]
    if len(matrices) not in (0, len(frames)):
        raise InputError("intrinsics: must be those of all poses, not of some")
    return {
        **described,
        "camera_to_world": np.stack([by_frame[frame][0] for frame in frames]),
        "intrinsics": np.stack(matrices) if matrices else None,
        "frames": tuple(frames),
    }


_Read = Callable[[str, Any], Any]
"""Returns the value of a field, None for what was given; its errors begin with the name."""


def _fields(described: Any, known: Mapping[str, _Read], *needed: str) -> dict[str, Any]:
    if not isinstance(described, dict):
        raise InputError(f"must be an object with {' and '.join(needed)}, not {described!r:.60}")
    for name in described:
        if name not in known:
            raise InputError(f"unknown field {name!r:.60}; the fields are {', '.join(known)}")
    for name in needed:
        if name not in described:
            raise InputError(f"{name}: is missing")
    read = {name: known[name](name, value) for name, value in described.items()}
    return {name: described[name] if value is None else value for name, value in read.items()}


def _list(name: str, value: Any, otherwise: str = ",") -> list[Any]:
    if not isinstance(value, list) or not value:
        raise InputError(f"{name}: must be a list of them{otherwise} not {value!r:.60}")
    return value


def _as_given(_: str, __: Any) -> None:
    """Is checked where it is used."""


def _name(field: str, name: Any) -> None:
    if not isinstance(name, str) or not re.fullmatch("[A-Za-z0-9._-]+", name):
        raise InputError(f"{field}: must be letters, digits, '.', '_' or '-', not {name!r:.60}")


def _distortion(name: str, listed: Any) -> tuple[float, ...]:
    if not isinstance(listed, list) or len(listed) not in _COEFFICIENTS:
        counts = ", ".join(map(str, _COEFFICIENTS))
        raise InputError(
            f"{name}: must be as many numbers as OpenCV has, one of {counts}: k1 k2 p1 p2 k3 "
            f"..., not {listed!r:.60}"
        )
    for value in listed:
        check_finite(name, value)
    return tuple(map(float, listed))


def _flipped(name: str, axes: Any) -> None:
    if axes not in ("", "x", "y", "xy"):
        raise InputError(f"{name}: must be 'x', 'y' or 'xy', not {axes!r:.60}")


_POSE: dict[str, _Read] = {
    "frame": check_finite,
    "camera_to_world": pose_or_lost,
    "intrinsics": intrinsics_of,
}
_CAMERA: dict[str, _Read] = {
    "name": _name,
    "camera_to_world": pose_of,
    "poses": _as_given,
    "within": check_not_negative,
    "intrinsics": intrinsics_of,
    "width": partial(check_integer, least=1),
    "height": partial(check_integer, least=1),
    "depth_scale": check_positive,
    "distortion": _distortion,
    "flipped": _flipped,
    "along_ray": lambda name, value: check_flags(**{name: value}),
}
"""What `cameras.json` may state of a camera and of one of its poses, and how it is read."""
