"""What a training sequence changes: the first half of a sequence is trained, the second completed.

The second half is completed by methods that have seen nothing, by detail with these training frames
and with others that are of no use, and by offline methods, which see all of the second half.
"""

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from dynmesh import degrade
from dynmesh.sequence import Mask, Positions
from dynmesh.study.completion import Faces
from dynmesh.study.losses import SCENARIOS, losses
from dynmesh.study.measure import Run, nmsve, run
from dynmesh.study.methods import DETAIL, MOTION
from dynmesh.study.subjects import Subject

from .baselines import BIHARMONIC, trained
from .matrix_completion import complete_at_once

MOST_FRAMES = 50
"""Of the training sequence, and of the frames that are completed."""

FEWEST_FRAMES = 3
"""Of a training sequence."""

TRAINED = "trained"
"""The key of detail after training that is of use."""

OfflineMethod = Callable[[Faces, Positions, Mask, Mask], Positions]
"""Takes the faces, (n, k, 3) positions, the (n, k) known mask, and an (n, k) mask of what may be
held out to choose parameters. Returns (n, k, 3) positions; those given of unknown vertices are not
used."""

OFFLINE: dict[str, OfflineMethod] = {
    "matrix_completion": complete_at_once,
    "graph_completion": partial(complete_at_once, smoothness=(0.01, 0.1, 1.0)),
}
"""The baselines that see all frames at once, by key."""

Runs = dict[str, dict[str, Run]]
"""The runs on one sequence, by loss and by key of the method."""

_HELD_OUT = 0.05  # of the known vertices, by which offline methods choose their parameters


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
    order = rng.permutation(len(training[0]))
    yield "moves of other vertices", still + (training - training[0])[:, order]
    for other in others:
        if np.array_equal(other.faces, faces) and (parts := halves(other)) is not None:
            yield other.name, parts[0]


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


def run_offline(
    subject: Subject, method: OfflineMethod, masks: Iterable[Mask], held_out: Iterable[Mask]
) -> Run:
    """Complete all frames at once, and measure; each frame takes an equal part of the time.

    The masks are (k,) bool of every frame; `held_out` may be held out to choose parameters.
    """
    known, apart = (np.stack(list(each)) for each in (masks, held_out))
    known[0], apart[0] = True, False
    result = Run.of(subject.n_frames - 1)
    start = time.thread_time()
    completed = method(subject.faces, subject.vertices, known, apart)
    result.seconds[:] = (time.thread_time() - start) / len(result.seconds)
    result.unknown[:] = np.count_nonzero(~known[1:], axis=1)
    result.complete = bool(np.isfinite(completed).all())
    whole = completed[1:].astype(subject.vertices.dtype)
    result.nmsve[:] = nmsve(subject, range(1, subject.n_frames), list(whole))
    return result


def training_study(
    subject: Subject,
    training: Positions | None,
    *,
    others: Iterable[Subject] = (),
    shares: Iterable[float] = (0.1, 0.3),
    scenarios: Iterable[str] = tuple(SCENARIOS),
    seed: int = 0,
) -> Runs:
    """Measure all methods on the frames of a subject, with the losses of :func:`losses`.

    Args:
        subject: the frames to complete.
        training: the training sequence, or None to measure the other methods only.
        others: other sequences; the first halves of those with the same mesh are trained too, to
            show what harm they do.
        shares: the shares of vertices that are known at random.
        scenarios: names of `SCENARIOS`.
        seed: the seed of the known masks.
    """
    methods = [MOTION, BIHARMONIC, DETAIL]
    if training is not None:
        methods.append(trained(TRAINED, "detail, trained", training))
        for what, frames in useless(training, subject.faces, others, seed):
            methods.append(trained(f"{TRAINED} on {what}", f"detail, trained on {what}", frames))
    runs: Runs = {}
    for loss, masks in losses(subject, shares, scenarios, seed).items():
        found = runs[loss] = {}
        for method in methods:
            try:
                found[method.key] = run(subject, method, masks)
            except (ImportError, RuntimeError):
                if method is not BIHARMONIC:
                    raise
        apart = held_out(subject, loss, masks, seed)
        for key, offline in OFFLINE.items():
            found[key] = run_offline(subject, offline, masks, apart)
    return runs
