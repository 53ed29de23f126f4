"""Known masks, noise and outliers as sensors leave them, made from whole sequences.

Frame 0 is always whole and untouched. Equal seeds give equal results, and what happens in a frame
depends on the seed and on the number of the frame, but not on how many frames there are. Arguments
are refused at the call, and frames when their turn comes.
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
