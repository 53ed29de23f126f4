"""Known masks as sensors leave them, made from whole sequences."""

from collections.abc import Iterator

import numpy as np

from .sequence import Mask


def random_known(n_frames: int, n_vertices: int, share: float, *, seed: int = 0) -> Iterator[Mask]:
    """Masks that observe the same number of vertices in every frame, picked anew at random.

    Args:
        n_frames: number of masks; the first is True throughout, as frame 0 must be complete.
        n_vertices: k.
        share: of the vertices that is known, above 0 and below 1; at least one vertex is.
        seed: equal seeds give equal masks. Frame i does not depend on `n_frames`.

    Yields:
        (k,) bool.

    Raises:
        ValueError: `share` is not between 0 and 1.
    """
    if not 0 < share < 1:
        raise ValueError(f"share: must be above 0 and below 1, not {share}")
    count = max(1, round(share * n_vertices))
    for frame in range(n_frames):
        known = np.full(n_vertices, frame == 0)
        if frame > 0:
            rng = np.random.default_rng([seed, frame])
            known[rng.choice(n_vertices, count, replace=False)] = True
        yield known
