"""Which things hang together, for arrays of pairs."""

import numpy as np
from numpy.typing import NDArray

Indices = NDArray[np.int64]


def connected(n: int, a: Indices, b: Indices) -> Indices:
    """The smallest member of the connected group of each of `n` things; a[i] and b[i] are tied."""
    label = np.arange(n)
    while True:
        before = label.copy()
        smaller = np.minimum(before[a], before[b])
        # The old roots follow, so that groups join and not only their rims.
        for end in (a, b):
            np.minimum.at(label, before[end], smaller)
            np.minimum.at(label, end, smaller)
        while not np.array_equal(root := label[label], label):
            label = root
        if np.array_equal(label, before):
            return label
