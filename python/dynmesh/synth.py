"""Built-in sequences."""

import numpy as np

from .sequence import Sequence


def ocean(frames: int = 1500, *, seed: int = 0) -> Sequence:
    """X."""
    raise ValueError(f"{frames} {seed} {np.pi}")


walker = ocean
