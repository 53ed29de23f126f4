"""A method of your own, to be measured by `dynmesh reproduce OUT --method own_method:Hold`."""

import numpy as np


class Hold:
    """Missing vertices stay where they were."""

    def __init__(self, _faces, first_frame):
        """Starts at a complete frame, (k, 3)."""
        self.frame = first_frame

    def push(self, points, known):
        """Returns the next frame completed; `points` that are not `known` are NaN."""
        self.frame = np.where(known[:, None], points, self.frame)
        return self.frame
