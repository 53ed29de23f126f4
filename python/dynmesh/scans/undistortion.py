"""What lenses do to depth images, undone by OpenCV."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._errors import InputError
from .._extras import require
from .cameras import ScanCamera

_APART = 1.0
"""Pixels by which a point of the border may miss its place, there and back."""


class Undistortion:
    """Undoes the distortion of a camera, without interpolation between depths.

    Attributes:
        intrinsics: (3, 3) of the new images, which show everything that the distorted ones do.
    """

    def __init__(self, camera: ScanCamera) -> None:
        """Finds for each pixel of a new image the one that it takes its depth from.

        Raises:
            ImportError: OpenCV is not installed.
            ValueError: the distortion cannot be undone.
        """
        self._cv: Any = require("cv2", extra="scans")
        size, coefficients = camera.size, np.array(camera.distortion)
        assert size is not None
        _refuse_folds(self._cv, camera, size)
        self.intrinsics: NDArray[np.float64]
        self.intrinsics, _ = self._cv.getOptimalNewCameraMatrix(
            camera.intrinsics, coefficients, size, 1
        )
        self._places = self._cv.initUndistortRectifyMap(
            camera.intrinsics, coefficients, None, self.intrinsics, size, self._cv.CV_32FC1
        )

    def undo(self, depth: NDArray[np.float32]) -> NDArray[np.float32]:
        """Returns the new image; it has no depth where the distorted one has no pixel."""
        return np.asarray(self._cv.remap(depth, *self._places, self._cv.INTER_NEAREST))


def _refuse_folds(cv: Any, camera: ScanCamera, size: tuple[int, int]) -> None:
    """Refuses a distortion that shows several directions at one place of the image."""
    width, height = size
    columns, rows = np.meshgrid(np.linspace(0, width - 1, 32), np.linspace(0, height - 1, 32))
    pixels = np.stack([columns, rows], axis=-1).reshape(-1, 1, 2)
    coefficients = np.array(camera.distortion)
    seen = cv.undistortPoints(pixels, camera.intrinsics, coefficients)
    seen = cv.convertPointsToHomogeneous(seen)
    back, _ = cv.projectPoints(seen, np.zeros(3), np.zeros(3), camera.intrinsics, coefficients)
    if not np.abs(back - pixels).max() < _APART:
        raise InputError(
            f"distortion: that of camera {camera.name!r} folds over, or is too strong, within its "
            f"images of {width} x {height} pixels"
        )
