"""The ways in which vertices are lost in every comparison."""

from collections.abc import Iterable, Iterator

from .. import degrade
from ..sequence import Mask
from .subjects import Subject
from .tables import percent

PAPER_SHARES = (0.1, 0.3, 0.5, 0.7)
"""The shares of known vertices in the figures of the paper."""

SCENARIOS = {"camera": "seen by one camera", "patches": "30 % hidden by patches"}
"""The losses that are not random, which the paper does not have, and their descriptions."""


def random_masks(subject: Subject, share: float, seed: int = 0) -> Iterator[Mask]:
    """Yield the known mask of every frame; a new random choice of vertices is known in each."""
    return degrade.random_known(subject.n_frames, subject.n_vertices, share, seed=seed)


def scenario_masks(name: str, subject: Subject, seed: int = 0) -> list[Mask]:
    """Return the known mask of every frame for one of `SCENARIOS`."""
    if name == "camera":
        # The camera circles the positions of all frames, so that no vertex leaves the picture.
        everywhere = subject.vertices.reshape(-1, 3)
        cameras = degrade.orbit(everywhere, up=subject.up_vector)
        return list(degrade.camera_known(subject.vertices, subject.faces, cameras))
    shape = (subject.n_frames, subject.n_vertices)
    return list(degrade.patch_known(subject.faces, *shape, 0.3, seed=seed))


def losses(
    subject: Subject,
    shares: Iterable[float] = PAPER_SHARES,
    scenarios: Iterable[str] = tuple(SCENARIOS),
    seed: int = 0,
) -> dict[str, list[Mask]]:
    """Return the known masks of random losses, named like "10 %", and of scenarios."""
    masks = {percent(share): list(random_masks(subject, share, seed)) for share in shares}
    return masks | {name: scenario_masks(name, subject, seed) for name in scenarios}
