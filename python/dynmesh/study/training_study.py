"""What a training sequence changes: the first half of a sequence is trained, the second completed.

The second half is completed by methods that have seen nothing, by detail with these training frames
and with others that are of no use, and by offline methods, which see all of the second half.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .. import degrade
from ..sequence import Mask, Positions
from .baselines import BIHARMONIC, OFFLINE
from .completion import Faces
from .losses import SCENARIOS, losses
from .measure import Run, run, run_offline
from .methods import DETAIL, MOTION, trained
from .subjects import Subject

MOST_FRAMES = 50
"""Of the training sequence, and of the frames that are completed."""

FEWEST_FRAMES = 3
"""Of a training sequence."""

TRAINED = "trained"
"""The key of detail after training that is of use."""

_HELD_OUT = 0.05  # of the known vertices, by which offline methods choose their parameters


@dataclass(frozen=True, eq=False)
class TrainingStudy:
    """What was measured on the second half of one sequence.

    Attributes:
        subject: the frames that were completed.
        runs: the runs by loss and method key.
        labels: how the methods are shown, by key.
        missing: why methods were left out, by key.
    """

    subject: Subject
    runs: dict[tuple[str, str], Run]
    labels: dict[str, str]
    missing: dict[str, str]

    def numbers(self) -> dict[str, Any]:
        """Return what results.json contains of it."""
        runs: dict[str, dict[str, Any]] = {}
        for (loss, key), measured in self.runs.items():
            runs.setdefault(loss, {})[key] = measured.summary()
        frames = self.subject.n_frames
        return {"frames": frames, "runs": runs, "labels": self.labels, "missing": self.missing}


def halves(subject: Subject) -> tuple[Positions, Subject] | None:
    """Return the training frames and the frames to complete, or None if there are too few."""
    half = subject.n_frames // 2
    if half < FEWEST_FRAMES:
        return None
    training = subject.vertices[np.unique(np.linspace(0, half - 1, MOST_FRAMES).astype(int))]
    return training, replace(subject, vertices=subject.vertices[half : half + MOST_FRAMES])


def useless(
    training: Positions, faces: Faces, others: Iterable[Subject], seed: int = 0
) -> Iterator[tuple[str, Positions]]:
    """Yield training sequences that say nothing about the subject, each with what it is.

    They are noise as large as the moves of the training frames, these moves at other vertices, and
    the training frames of other sequences that have the same mesh.
    """
    rng = np.random.default_rng(seed)
    still = np.broadcast_to(training[0], training.shape)
    spread = np.abs(training - training[0]).mean()
    yield "noise", (still + spread * rng.normal(size=training.shape)).astype(training.dtype)
    yield (
        "moves of other vertices",
        still + (training - training[0])[:, rng.permutation(len(training[0]))],
    )
    for other in others:
        if np.array_equal(other.faces, faces) and (parts := halves(other)) is not None:
            yield other.name, parts[0]


def seconds_of_work(subject: Subject, frame: float, n_losses: int) -> float:
    """Estimate how long `training_study` will take, from the seconds of a frame of all methods."""
    n = subject.n_frames
    entries = 3.0 * n * subject.n_vertices
    offline = 900 * entries * (12 * n + 100) / 3e9  # steps; multiplications; entries of memory
    return n_losses * (n * frame + offline)


def held_out(subject: Subject, loss: str, masks: list[Mask], seed: int) -> list[Mask]:
    """Return what offline methods hold out: 5 % of the vertices, in the way in which they are lost.

    Where whole parts are lost, these are patches, as far as they are known; otherwise, or if
    nothing in them is known, single vertices.
    """
    shape = (subject.n_frames, subject.n_vertices)
    patches = list(degrade.patch_known(subject.faces, *shape, _HELD_OUT, seed=seed + 1))
    rng = np.random.default_rng(seed + 1)
    single = [rng.random(subject.n_vertices) < _HELD_OUT for _ in masks]
    in_patches = [known & ~kept for known, kept in zip(masks, patches, strict=True)]
    if loss in SCENARIOS and any(mask.any() for mask in in_patches[1:]):
        return in_patches
    return [known & apart for known, apart in zip(masks, single, strict=True)]


def training_study(
    subject: Subject,
    training: Positions | None,
    *,
    others: Iterable[Subject] = (),
    shares: Iterable[float] = (0.1, 0.3),
    scenarios: Iterable[str] = tuple(SCENARIOS),
    seed: int = 0,
    advance: Callable[[float], object] = lambda _: None,
) -> TrainingStudy:
    """Measure all methods on the frames of a subject.

    Args:
        subject: the frames to complete.
        training: the training sequence, or None to measure the other methods only.
        others: other sequences; the first halves of those with the same mesh are trained too, to
            show what harm they do.
        shares: the shares of vertices that are known at random.
        scenarios: names of `SCENARIOS`.
        seed: the seed of the known masks.
        advance: called with the share of the work that was done since the last call.
    """
    result = TrainingStudy(subject, {}, {}, {})
    methods = [MOTION, BIHARMONIC, DETAIL]
    useful = [] if training is None else [trained(TRAINED, "detail, trained", training)]
    misled = [
        trained(f"trained on {what}", f"detail, trained on {what}", frames)
        for what, frames in (
            [] if training is None else useless(training, subject.faces, others, seed)
        )
    ]
    all_masks = losses(subject, shares, scenarios, seed)
    for loss, masks in all_masks.items():
        for method in (*methods, *useful, *misled):
            try:
                result.runs[loss, method.key] = run(subject, method, masks)
            except (ImportError, RuntimeError) as error:
                if method is not BIHARMONIC:
                    raise
                result.missing[method.key] = str(error)
            result.labels[method.key] = method.label
        advance(0.3 / len(all_masks))
        for offline in OFFLINE:
            apart = held_out(subject, loss, masks, seed)
            result.runs[loss, offline.key] = run_offline(subject, offline, masks, apart)
            result.labels[offline.key] = offline.label
            advance(0.35 / len(all_masks))
    return result
