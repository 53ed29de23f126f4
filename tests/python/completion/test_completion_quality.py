"""What a completer says of its frames: right ones are good, wrong ones are not."""

from collections.abc import Callable, Iterator
from functools import cache, partial
from itertools import product
from typing import Any, Literal

import numpy as np
import pytest
from numpy.typing import NDArray

import dynmesh
from dynmesh.losses import Camera, camera_known, patch_known, random_known

Array = NDArray[np.floating[Any]]
RNG = np.random.default_rng(0)


@cache
def walker() -> dynmesh.Sequence:
    return dynmesh.synth.walker(60)


@cache
def ocean() -> dynmesh.Sequence:
    return dynmesh.synth.ocean(60)


def masks(kind: str, frames: Array, faces: Any) -> Iterator[Any]:
    """Of the frames after the first one."""
    n, k = frames.shape[:2]
    if kind == "patches":
        made = patch_known(faces, n, k, 0.4)
    elif kind == "camera":
        low, high = frames[0].min(axis=0), frames[0].max(axis=0)
        middle, size = (low + high) / 2, np.linalg.norm(high - low)
        place = (middle + size * np.array([0.3, 1.2, 0.4])).tolist()
        made = camera_known(frames, faces, [Camera(place, middle.tolist(), up=(0.0, 0.0, 1.0))])
    else:
        made = random_known(n, k, float(kind))
    next(made)
    return made


def qualities(
    sequence: dynmesh.Sequence, first: Array, frames: Array, kind: str, method: Any
) -> list[str]:
    """Of the frames after the first one in which something is known."""
    completer = dynmesh.Completer(sequence.faces, first, method=method)
    made: list[str] = []
    for points, known in zip(frames[1:], masks(kind, frames, sequence.faces), strict=True):
        completer.push(points, known)
        assert bool(completer.report.reason) == (completer.report.quality != "good")
        if known.any():
            made.append(completer.report.quality)
    return made


def noisy(frames: Array, share: float) -> Array:
    """With noise of a share of the distance of most vertices, but for the first frame."""
    edge = np.ptp(frames[0], axis=0).max() / np.sqrt(frames.shape[1])
    made = frames + share * edge * RNG.standard_normal(frames.shape)
    return np.concatenate([frames[:1], made[1:]])


RIGHT: dict[str, Callable[[Array], Array]] = {
    "as it is": lambda frames: frames[:6],
    "fast": lambda frames: frames[::9],
    "cut at once": lambda frames: np.concatenate([frames[:1], frames[40:45]]),
    "cut later": lambda frames: np.concatenate([frames[:4], frames[40:44]]),
    "larger at once": lambda frames: np.concatenate([frames[:6], 1.3 * frames[6:9]]),
    "noisy": lambda frames: noisy(frames[:6], 0.3),
    "far away": lambda frames: (frames[:6] + 1e4 * np.ptp(frames[0])).astype(np.float32),
}


@pytest.mark.parametrize("change", RIGHT)
@pytest.mark.parametrize(
    ("sequence", "kind"),
    [(walker, "0.1"), (walker, "camera"), (ocean, "0.1"), (ocean, "0.9"), (ocean, "patches")],
)
def test_right_frames_are_good(
    sequence: Callable[[], dynmesh.Sequence], kind: str, change: str
) -> None:
    subject = sequence()
    frames = RIGHT[change](subject.vertices)
    for method in ("motion", "detail"):
        assert set(qualities(subject, frames[0], frames, kind, method)) == {"good"}, method


def other_subject(first: Array) -> Array:
    """With thicker and thinner parts."""
    middle = first.mean(axis=0)
    waves = np.sin(9 * (first - middle)[:, [1, 2, 0]] / np.ptp(first) + 1)
    return np.asarray(middle + (first - middle) * (1 + 0.25 * waves))


def partly_in_another_order(share: float, first: Array) -> Array:
    """With a share of the vertices exchanged among themselves."""
    made = first.copy()
    some = RNG.choice(len(first), int(share * len(first)), replace=False)
    made[some] = made[RNG.permutation(some)]
    return made


Wanted = Literal["doubtful", "ruined"]
WRONG: dict[str, tuple[Callable[[Array], Array], Wanted]] = {
    "in millimetres": (lambda first: 1000 * first, "ruined"),
    "in inches": (lambda first: first / 0.0254 * 0.01, "doubtful"),
    "in another order": (RNG.permutation, "ruined"),
    "a hundredth in another order": (partial(partly_in_another_order, 0.01), "doubtful"),
    "in the order of another file": (lambda first: np.roll(first, 50, axis=0), "ruined"),
    "of another subject": (other_subject, "doubtful"),
    "mirrored": (lambda first: first * [1, -1, 1] + 3, "doubtful"),
    "with two axes exchanged": (lambda first: first[:, [1, 0, 2]], "doubtful"),
    "without extent": (lambda first: 0 * first, "ruined"),
}


@pytest.mark.parametrize("kind", ["0.1", "0.9", "camera"])
@pytest.mark.parametrize("change", WRONG)
def test_a_first_frame_that_does_not_fit_is_told(change: str, kind: str) -> None:
    subject = walker()
    make, wanted = WRONG[change]
    first = make(subject.vertices[0])
    for method in ("motion", "detail"):
        found = qualities(subject, first, subject.vertices[:8], kind, method)
        assert found[-1] == wanted, method
        assert set(found[:4]) != {"good"}, method


@pytest.mark.parametrize("kind", ["0.005", "0.02"])
@pytest.mark.parametrize("change", ["in another order", "mirrored"])
def test_a_few_known_vertices_tell_that_a_first_frame_does_not_fit(change: str, kind: str) -> None:
    """They share hardly any edges."""
    subject = walker()
    make, _ = WRONG[change]
    for method in ("motion", "detail"):
        for first, wanted in (
            (subject.vertices[0], "good"),
            (make(subject.vertices[0]), "doubtful"),
        ):
            found = qualities(subject, first, subject.vertices[:8], kind, method)
            assert found[-1] == wanted, method


def test_points_of_other_vertices_are_told_in_the_frame_that_has_them() -> None:
    subject = walker()
    frames = subject.vertices[:6].copy()
    frames[3] = RNG.permutation(frames[3])
    frames[4, ::10] = 0
    completer = dynmesh.Completer(subject.faces, frames[0])
    found: list[str] = []
    for points in frames[1:]:
        completer.push(points)
        found.append(completer.report.quality)
    assert found == ["good", "good", "ruined", "ruined", "good"]


@pytest.mark.parametrize(
    ("change", "kinds"),
    [
        (lambda x: x * [-1, 1, 1], ("0.1", "0.9", "camera")),
        (lambda x: x * [1, -1, 1] + 3, ("0.1", "0.9")),
        (other_subject, ("0.5", "0.9", "camera")),
    ],
)
def test_a_frame_of_something_else_in_the_middle_is_told(
    change: Callable[[Array], Array], kinds: tuple[str, ...]
) -> None:
    """It is ruined, and alone: no later frame follows from it."""
    subject = walker()
    frames = subject.vertices[:14].astype(np.float64)
    frames[9] = change(frames[9])
    for kind, method in product(kinds, ("motion", "detail")):
        found = qualities(subject, frames[0], frames, kind, method)
        assert found == 8 * ["good"] + ["ruined"] + 4 * ["good"], (kind, method)


@pytest.mark.parametrize("method", ["motion", "detail"])
def test_frames_do_not_follow_from_a_ruined_one(method: Any) -> None:
    subject = walker()
    frames = subject.vertices[:9].astype(np.float64)
    known = np.random.default_rng(1).random(frames.shape[:2]) < 0.5
    errors = []
    for wrong in (None, RNG.permutation(frames[5]), 1.7 * frames[5, ::-1]):
        completer = dynmesh.Completer(subject.faces, frames[0], method=method)
        for n in range(1, 9):
            points = frames[n] if n != 5 or wrong is None else wrong
            made = completer.push(np.where(known[n, :, None], points, np.nan))
            if n == 5 and wrong is not None:
                assert completer.report.quality == "ruined"
                np.testing.assert_array_equal(made[known[n]], wrong[known[n]])
        errors.append(float(np.abs(made - frames[8]).max()))
    assert max(errors[1:]) < 1.5 * errors[0]


@pytest.mark.parametrize("method", ["motion", "detail"])
def test_ruined_frames_that_agree_are_followed(method: Any) -> None:
    """After a cut, another subject is known, whose vertices have another order."""
    subject = walker()
    frames = subject.vertices[:14].astype(np.float64)
    other = RNG.permutation(frames.shape[1])
    known = np.random.default_rng(1).random(frames.shape[:2]) < 0.9
    completer = dynmesh.Completer(subject.faces, frames[0], method=method)
    errors = []
    for n in range(1, 14):
        truth = frames[n] if n < 5 else frames[n][other]
        made = completer.push(np.where(known[n, :, None], truth, np.nan))
        errors.append(float(np.linalg.norm(made - truth, axis=1).mean()))
    assert errors[-1] < 0.4 * errors[4]
