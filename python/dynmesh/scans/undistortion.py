"""What lenses do to depth images, undone by OpenCV."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._extras import require
from .cameras import ScanCamera


class Undistortion:
    """Undoes the distortion of a camera, without interpolation between depths.

    Attributes:
        intrinsics: (3, 3) of the new images, which show everything that the distorted ones do.
    """

    def __init__(self, camera: ScanCamera) -> None:
        """Finds for each pixel of a new image the one that it takes its depth from.

        Raises:
            ImportError: OpenCV is not installed.
        """
        self._cv: Any = require("cv2", extra="scans")
        size, coefficients = camera.size, np.array(camera.distortion)
        assert size is not None
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
