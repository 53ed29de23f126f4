"""Poses of a camera that moves, in lines `time tx ty tz qx qy qz qw`, as TUM has them.

They lead from the axes of the camera, as in OpenCV, to the world; the quaternion has its real part
last.
"""

from pathlib import Path
from typing import Any

import numpy as np

from .._errors import InputError
from ..formats.text import lines_in, number_of, words_in

_ROUNDED = 1e-3
"""By how much the length of a quaternion may deviate from 1, as it was written with few digits."""


def poses_in(file: Path) -> list[dict[str, Any]]:
    """Returns the poses in a file, as `cameras.json` lists them; their frames are the times."""
    poses = []
    for number, line in enumerate(lines_in(file), start=1):
        words = words_in(line)
        if not words:
            continue
        if len(words) != 8:
            raise InputError(
                f"line {number}: must be a pose, time tx ty tz qx qy qz qw, but has {len(words)} "
                "words"
            )
        time, *position, x, y, z, w = (number_of(word, number) for word in words)
        length = float(np.linalg.norm([x, y, z, w]))
        if not abs(length - 1) <= _ROUNDED:
            raise InputError(f"line {number}: its quaternion must have length 1, not {length:g}")
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) / length
        pose = np.eye(4)
        pose[:3, :3] += 2 * (w / length * cross + cross @ cross)
        pose[:3, 3] = position
        poses.append({"frame": time, "camera_to_world": pose.tolist()})
    return poses
