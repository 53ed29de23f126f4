"""Known masks, noise and outliers like those of real sensors, made from complete sequences.

Frame 0 always stays complete and unchanged. Equal seeds give equal results, and the result for a
frame depends on the seed and on the number of the frame, but not on the number of frames.
Arguments are checked when a function is called, frames when they are reached.
"""

from .losses import add_noise, add_outliers, camera_known, dropout, patch_known, random_known
from .visibility import Camera, orbit

__all__ = [
    "Camera",
    "add_noise",
    "add_outliers",
    "camera_known",
    "dropout",
    "orbit",
    "patch_known",
    "random_known",
]
