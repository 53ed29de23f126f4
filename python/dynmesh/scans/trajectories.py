"""Cameras in files of other programs.

`transforms.json`, as nerfstudio and instant-ngp read it, has a pose for each image. They lead from
the axes of OpenGL, x right, y up, z back, to the world; the corner of the first pixel is at (0, 0);
and depth images may have fewer pixels than those of the intrinsics.

Others have only poses, which lead from the axes of OpenCV to the world, but where a format says
otherwise:

- TUM: lines `time tx ty tz qx qy qz qw`.
- EuRoC: lines `time,tx,ty,tz,qw,qx,qy,qz,...` with times in nanoseconds.
- KITTI: lines with the twelve numbers of the upper rows of a pose, one for each frame from 0.
- COLMAP, `images.txt`: lines `id qw qx qy qz tx ty tz camera name`, each before one of points, from
  the world to the camera.
- 7-Scenes and ScanNet: a file for each frame with the sixteen numbers of its pose.
"""

import re
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats
from .._checks import check_finite, check_positive
from .._errors import InputError, naming, within
from ..formats.names import Number, by_number, files_in, numbers_in, usual_distance
from ..formats.text import lines_in, number_of, words_in
from .matrices import pose_of

Direction: TypeAlias = Literal["camera-to-world", "world-to-camera"]
"""Where the poses in a file lead."""

_WITHIN = 0.02
"""Seconds between the time of an image and that of its pose, as TUM's own programs allow."""

_ROUNDED = 1e-3
"""By how much the length of a quaternion may deviate from 1, as it was written with few digits."""

_FOLDERS = ("pose", "poses")
"""Of files with one pose each, beside those of images."""


class Trajectory(NamedTuple):
    """The poses in a file.

    Attributes:
        listed: as `cameras.json` lists them.
        is_timed: whether they are numbered by times, which need not be those of images.
        direction: where they lead; None if the file does not say it.
    """

    listed: list[dict[str, Any]]
    is_timed: bool = False
    direction: Direction | None = None


def poses_in(path: Path) -> Trajectory:
    """Reads the poses in a file, or of a folder with a file for each."""
    if path.is_dir():
        if (found := _one_a_file(path)) is None:
            raise InputError("is a folder without poses, NUMBER.txt or NUMBER.pose.txt")
        return found
    lines = lines_in(path)
    rows = [(number, line) for number, line in enumerate(lines, start=1) if words_in(line)]
    first = rows[0][1] if rows else ""
    if "," in first:
        return Trajectory([_timed(n, line.split(","), _EUROC) for n, line in rows], True)
    words = words_in(first)
    if len(words) == 10 and _is_name(words[9]):
        return _colmap(lines)
    if len(words) == 12:
        return Trajectory([_matrix(number, at, line) for at, (number, line) in enumerate(rows)])
    return Trajectory([_timed(number, words_in(line), _TUM) for number, line in rows], True)


def poses_beside(folders: Sequence[Path], camera: str) -> Trajectory | None:
    """Finds files with one pose each beside images, or in a folder beside theirs."""
    for root in folders:
        for folder in (root, root / camera, root.parent):
            for name in ("", *_FOLDERS):
                if (folder != root.parent or name) and (found := _one_a_file(folder / name, name)):
                    return found
    return None


def within_of(poses: Trajectory) -> float:
    """Returns how far from a frame the nearest pose may be: as far as they usually are apart."""
    if not poses.is_timed:
        return 0.0
    return max(_WITHIN, float(usual_distance(sorted(one["frame"] for one in poses.listed))))


def is_lost(pose: Floats) -> bool:
    """Whether a pose is none."""
    return not np.isfinite(pose).all()


def between(
    frames: Sequence[Number], poses: NDArray[np.float64], number: Number, nearest: int
) -> Floats:
    """Returns the pose at a number, on an even motion between the two around it if there are two.

    The rotation is interpolated about a fixed axis (slerp), the position along a line.
    """
    other = nearest + (1 if number > frames[nearest] else -1)
    one: Floats = poses[nearest]
    if number == frames[nearest] or not 0 <= other < len(frames) or is_lost(poses[other]):
        return one
    share = float((number - frames[nearest]) / (frames[other] - frames[nearest]))
    first, second = _quaternion(one[:3, :3]), _quaternion(poses[other][:3, :3])
    second = second if first @ second >= 0 else -second
    angle = np.arccos(min(1.0, float(first @ second)))
    weights = np.array([1 - share, share])
    if angle > 1e-6:
        weights = np.sin(weights * angle) / np.sin(angle)
    mixed = weights[0] * first + weights[1] * second
    result = np.eye(4)
    result[:3, :3] = _rotation(mixed / np.linalg.norm(mixed))
    result[:3, 3] = (1 - share) * one[:3, 3] + share * poses[other][:3, 3]
    return result


def _one_a_file(folder: Path, name: str = "pose") -> Trajectory | None:
    """Reads the poses of a folder; only those that say so by their names if the folder does not."""
    files = [file for file in files_in(folder, ".txt") if name or file.stem.endswith(".pose")]
    if not files:
        return None
    numbers, pattern = numbers_in(files, [file.stem.removesuffix(".pose") for file in files])
    if pattern is None and len(files) > 1:
        raise InputError(f"the names of its poses, as {files[0].name}, differ in several numbers")
    listed = []
    for number, file in zip(numbers, files, strict=True):
        with naming(file):
            words = [word for line in lines_in(file) for word in words_in(line)]
            values = [number_of(word, 1) for word in words]
            if len(values) != 16:
                raise InputError(f"must hold the 16 numbers of a pose, not {len(values)}")
        listed.append(_entry(number, np.reshape(values, (4, 4))))
    return Trajectory(listed)


def _entry(number: Number, pose: Any) -> dict[str, Any]:
    return {"frame": number, "camera_to_world": np.asarray(pose).tolist()}


_TUM = "time tx ty tz qx qy qz qw"
_EUROC = "time,tx,ty,tz,qw,qx,qy,qz"


def _timed(line: int, words: Sequence[str], form: str) -> dict[str, Any]:
    """Reads the time, the position and the quaternion of a line."""
    is_tum = form == _TUM
    if len(words) != 8 and (is_tum or len(words) < 8):
        raise InputError(f"line {line}: must be a pose, {form}, but has {len(words)} words")
    time = int(words[0]) if words[0].strip().isdigit() else number_of(words[0], line)
    *position, a, b, c, d = (number_of(word.strip(), line) for word in words[1:8])
    return _entry(time, _posed(line, position, [d, a, b, c] if is_tum else [a, b, c, d]))


def _posed(line: int, position: Sequence[float], quaternion: Sequence[float]) -> Floats:
    """Returns the pose of a position and a quaternion whose real part comes first."""
    pose = np.eye(4)
    if not np.isfinite([*position, *quaternion]).all():
        return np.full((4, 4), np.nan)
    length = float(np.linalg.norm(quaternion))
    if not abs(length - 1) <= _ROUNDED:
        raise InputError(f"line {line}: its quaternion must have length 1, not {length:g}")
    pose[:3, :3] = _rotation(np.array(quaternion) / length)
    pose[:3, 3] = position
    return pose


def _matrix(line: int, frame: int, text: str) -> dict[str, Any]:
    words = words_in(text)
    if len(words) != 12:
        raise InputError(f"line {line}: must be the 12 numbers of a pose, but has {len(words)}")
    upper = np.reshape([number_of(word, line) for word in words], (3, 4))
    return _entry(frame, np.concatenate([upper, [[0.0, 0, 0, 1]]]))


def _colmap(lines: Sequence[str]) -> Trajectory:
    """Reads every second line that is no comment, of which the others may be empty."""
    rows = [(at, line) for at, line in enumerate(lines, start=1) if not line.startswith("#")]
    poses, names = list[Floats](), list[Path]()
    for number, line in rows[::2]:
        words = words_in(line)
        if not words:
            continue
        if len(words) != 10:
            raise InputError(
                f"line {number}: must be an image, id qw qx qy qz tx ty tz camera name, but has "
                f"{len(words)} words"
            )
        values = [number_of(word, number) for word in words[1:8]]
        poses.append(_posed(number, values[4:], values[:4]))
        names.append(Path(words[9]))
    with within("names of images"):
        numbers, _ = numbers_in(names, [name.stem for name in names])
    listed = [_entry(number, pose) for number, pose in zip(numbers, poses, strict=True)]
    return Trajectory(listed, False, "world-to-camera")


def _is_name(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return True
    return False


def _rotation(quaternion: NDArray[np.float64]) -> Floats:
    w, x, y, z = quaternion
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + 2 * (w * cross + cross @ cross))


def _quaternion(rotation: Floats) -> NDArray[np.float64]:
    """Returns the quaternion of a rotation, that of the largest eigenvalue (Bar-Itzhack 2000)."""
    r = rotation
    symmetric = np.array(
        [
            [r[0, 0] + r[1, 1] + r[2, 2], 0, 0, 0],
            [r[2, 1] - r[1, 2], r[0, 0] - r[1, 1] - r[2, 2], 0, 0],
            [r[0, 2] - r[2, 0], r[0, 1] + r[1, 0], r[1, 1] - r[0, 0] - r[2, 2], 0],
            [r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], r[2, 2] - r[0, 0] - r[1, 1]],
        ]
    )
    return np.asarray(np.linalg.eigh(symmetric, "L")[1][:, -1])


OPENGL = np.diag([1.0, -1, -1, 1])
"""From the axes of a camera in OpenGL to those in OpenCV."""

_MODELS = ("OPENCV", "PINHOLE", "SIMPLE_PINHOLE")
_LENS = ("k1", "k2", "k3", "k4", "p1", "p2", "is_fisheye")
_MATRIX = ("fl_x", "fl_y", "cx", "cy", "w", "h")


def as_cameras(transforms: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Returns what `cameras.json` would hold: a camera that moves for each folder of images.

    The names of images lead to them from the folder of the file.
    """
    frames = transforms["frames"]
    if not isinstance(frames, list) or not frames:
        raise InputError(f"frames: must be a list of them, not {frames!r:.60}")
    by_folder = dict[str, dict[Path, dict[str, Any]]]()
    for number, frame in enumerate(frames):
        if not isinstance(frame, dict):
            raise InputError(f"frames: {number} must be an object, not {frame!r:.60}")
        name = frame.get("depth_file_path", frame.get("file_path"))
        if not isinstance(name, str):
            raise InputError(f"frames: {number}: file_path: must be a name, not {name!r:.60}")
        file = folder / name.replace("\\", "/")
        by_folder.setdefault(file.parent.name, {})[file] = frame
    return {"cameras": [_camera(name, images, transforms) for name, images in by_folder.items()]}


def _camera(
    name: str, images: dict[Path, dict[str, Any]], transforms: dict[str, Any]
) -> dict[str, Any]:
    files, poses = [*images], list[dict[str, Any]]()
    described: dict[str, Any] = {
        "name": re.sub("[^A-Za-z0-9.-]", "-", name) or "camera",
        "poses": poses,
    }
    numbers, pattern = numbers_in(files, [file.stem for file in files])
    if pattern is None:
        raise InputError(
            f"frames: {files[0].name}: has no number of a frame, or the names differ in several"
        )
    for number, file in by_number(zip(numbers, files, strict=True)).items():
        with within(f"frames: {file.name}"):
            stated = _joined(transforms, images[file])
            pose = pose_of("transform_matrix", _needed("transform_matrix", stated)) @ OPENGL
            poses.append({"frame": number, "camera_to_world": pose.tolist()})
            if "fl_x" in stated:
                if "width" not in described:
                    described |= _images(files[0], stated)
                size = described["width"], described["height"]
                poses[-1]["intrinsics"] = _intrinsics(stated, *size)
    return described


def _joined(transforms: dict[str, Any], frame: dict[str, Any]) -> dict[str, Any]:
    """Returns what the file states of all images and of this one, which must not disagree."""
    stated = {**transforms, **frame}
    for field in _MATRIX:
        if transforms.get(field, stated.get(field)) != stated.get(field):
            message = f"is {frame[field]!r:.40}, but {transforms[field]!r:.40} for all images"
            raise InputError(f"{field}: {message}; remove one of them")
    for field in _LENS:
        if stated.get(field):
            message = f"is {stated[field]!r:.40}, but must be 0: undistort the images"
            raise InputError(f"{field}: {message}")
    if stated.get("camera_model", _MODELS[0]) not in _MODELS:
        message = f"must be one of {', '.join(_MODELS)}, not {stated['camera_model']!r:.60}"
        raise InputError(f"camera_model: {message}")
    return stated


def _intrinsics(stated: dict[str, Any], width: int, height: int) -> list[list[float]]:
    """Returns those of images of this size, with the centre of the first pixel at (0, 0)."""
    for field in ("fl_x", "fl_y", "cx", "cy"):
        check_finite(field, _needed(field, stated))
    across, down = width / stated["w"], height / stated["h"]
    return [
        [stated["fl_x"] * across, 0, stated["cx"] * across - 0.5],
        [0, stated["fl_y"] * down, stated["cy"] * down - 0.5],
        [0, 0, 1],
    ]


def _images(first: Path, stated: dict[str, Any]) -> dict[str, Any]:
    """Describes depth images like the first, which may have fewer pixels than is stated."""
    for field in ("w", "h"):
        check_positive(field, _needed(field, stated))
    width, height = int(stated["w"]), int(stated["h"])
    if first.suffix.lower() == ".png" and first.is_file():
        with first.open("rb") as image:
            header = image.read(24)
        if len(header) == 24:
            width, height = struct.unpack(">II", header[16:])
    metres, scale = stated.get("depth_unit_scale_factor", 1e-3), stated.get("applied_scale", 1.0)
    for field, value in (("depth_unit_scale_factor", metres), ("applied_scale", scale)):
        check_positive(field, value)
    # That of instant-ngp is in the unit of the poses.
    count = stated.get("integer_depth_scale", metres * scale)
    return {"width": width, "height": height, "depth_scale": count}


def _needed(field: str, stated: dict[str, Any]) -> Any:
    if field not in stated:
        raise InputError(f"{field}: is missing")
    return stated[field]
