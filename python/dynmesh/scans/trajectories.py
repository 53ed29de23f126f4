"""Poses of cameras in files of other programs.

They lead from the axes of OpenCV to the world, but where a format says otherwise:

- TUM: lines `time tx ty tz qx qy qz qw`.
- EuRoC: lines `time,tx,ty,tz,qw,qx,qy,qz,...` with times in nanoseconds.
- KITTI: lines with the twelve numbers of the upper rows of a pose, one for each frame from 0.
- COLMAP, `images.txt`: lines `id qw qx qy qz tx ty tz camera name`, each before one of points, from
  the world to the camera.
- 7-Scenes and ScanNet: a file for each frame with the sixteen numbers of its pose.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats
from .._errors import InputError, naming, within
from ..formats.names import Number, files_in, numbers_in, usual_distance
from ..formats.text import lines_in, number_of, words_in

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
