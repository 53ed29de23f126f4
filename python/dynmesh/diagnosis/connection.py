"""Connected groups, given as arrays of pairs."""

import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.int64]


def connected(n: int, a: Indices, b: Indices) -> Indices:
    """Labels `n` items with the smallest member of their group; a[i] and b[i] are connected."""
    label = np.arange(n)
    while True:
        before = label.copy()
        smaller = np.minimum(before[a], before[b])
        # Update the old roots too, so that whole groups are joined and not only their ends.
        for end in (a, b):
            np.minimum.at(label, before[end], smaller)
            np.minimum.at(label, end, smaller)
        while not np.array_equal(root := label[label], label):
            label = root
        if np.array_equal(label, before):
            return label
