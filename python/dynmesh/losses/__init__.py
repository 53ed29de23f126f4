"""Known masks, noise, outliers and scans like those of real sensors, made from complete sequences.

Frame 0 always stays complete and unchanged, except in scans. Equal seeds give equal results, and
the result for a frame depends on the seed and on the number of the frame, but not on the number of
frames. Arguments are checked when a function is called, frames when they are reached, of which only
one is held at a time.

Functions that make masks yield `n_frames` of them, (k,) bool for `n_vertices` = k. Those that take
frames take positions (k, 3), and yield one item for each.
"""

from ..scan import DepthScan, PointScan
from .losses import add_noise, add_outliers, camera_known, dropout, patch_known, random_known
from .scans import Sensor, depth_images, scan_points
from .visibility import Camera, orbit

__all__ = [
    "Camera",
    "DepthScan",
    "PointScan",
    "Sensor",
    "add_noise",
    "add_outliers",
    "camera_known",
    "depth_images",
    "dropout",
    "orbit",
    "patch_known",
    "random_known",
    "scan_points",
]
