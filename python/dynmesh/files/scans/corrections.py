"""How the file of the cameras is to be read where it follows another convention."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from ..._errors import InputError
from .cameras import Matrices, Rig, ScanCamera

Poses = Literal["camera-to-world", "world-to-camera"]
"""From which axes to which the poses in the file lead."""

Axes = Literal["opencv", "opengl"]
"""Those of a camera: x right, y down, z ahead; or x right, y up, z back."""


@dataclass(frozen=True, kw_only=True)
class Corrections:
    """What a user says about the cameras; without arguments, the file follows the convention.

    Attributes:
        poses: what the matrices of the poses mean.
        axes: of the cameras.
        matrices: how matrices are written.
        swap_cameras: the names of two cameras of which each has the images of the other.
        depth_scale: the depth of one count, for all cameras.
        intrinsics_size: width and height of the images that the intrinsics are for.
    """

    poses: Poses = "camera-to-world"
    axes: Axes = "opencv"
    matrices: Matrices = "rows"
    swap_cameras: tuple[str, str] | None = None
    depth_scale: float | None = None
    intrinsics_size: tuple[int, int] | None = None

    def of(self, rig: Rig) -> Rig:
        """Returns the cameras as they are meant; only their intrinsics stay as they are.

        Raises:
            ValueError: there are no such cameras to swap.
        """
        names = [camera.name for camera in rig.cameras]
        swapped = {}
        if self.swap_cameras is not None:
            one, other = self.swap_cameras
            for name in (one, other):
                if name not in names:
                    raise InputError(
                        f"there is no camera {name!r}; the cameras are {', '.join(names)}",
                        argument="swap_cameras",
                    )
            swapped = {one: other, other: one}
        return replace(
            rig,
            cameras=tuple(
                replace(self._of_camera(camera), name=swapped.get(camera.name, camera.name))
                for camera in rig.cameras
            ),
        )

    def _of_camera(self, camera: ScanCamera) -> ScanCamera:
        pose = camera.camera_to_world.copy()
        if self.matrices == "transposed-rotations":
            pose[:3, :3] = pose[:3, :3].T
        if self.poses == "world-to-camera":
            pose[:3, :3] = pose[:3, :3].T
            pose[:3, 3] = -pose[:3, :3] @ pose[:3, 3]
        if self.axes == "opengl":
            pose[:3, 1:3] *= -1
        scale = camera.depth_scale if self.depth_scale is None else self.depth_scale
        return replace(camera, camera_to_world=pose, depth_scale=scale)

    def for_images(self, camera: ScanCamera, width: int, height: int) -> ScanCamera:
        """Returns a camera with the intrinsics for images of this size.

        Raises:
            ValueError: the size that the intrinsics are for has another aspect ratio.
        """
        if self.intrinsics_size is None or camera.intrinsics is None:
            return camera
        old = self.intrinsics_size
        x, y = width / old[0], height / old[1]
        if abs(x / y - 1) > 0.01:
            raise InputError(
                f"images of {old[0]} x {old[1]} pixels have another aspect ratio than those of "
                f"camera {camera.name!r}, {width} x {height}",
                argument="intrinsics_size",
            )
        # The centre of the first pixel is at 0, its edge at -0.5.
        to_new = np.array([[x, 0, (x - 1) / 2], [0, y, (y - 1) / 2], [0, 0, 1]])
        size = width, height
        if camera.lens is not None:
            lens = camera.lens.scaled(to_new, size)
            return replace(camera, intrinsics=lens.undistorted, size=size, lens=lens)
        return replace(camera, intrinsics=to_new @ camera.intrinsics, size=size)


AS_STATED = Corrections()
"""The file follows the convention."""
