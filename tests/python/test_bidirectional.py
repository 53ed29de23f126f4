"""Files completed from both sides."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from sequences import sea

import dynmesh
from dynmesh.completion.ways import combined

N = 12


TRUTH = sea(N)


def partial(truth: dynmesh.Sequence, whole: int, noise: float = 0) -> dynmesh.Sequence:
    """The ocean of which only this frame is whole, and in one nothing was observed."""
    rng = np.random.default_rng(whole)
    known = rng.random((N, 100)) < 0.3
    known[N // 2] = False
    known[:, 55] = False
    known[whole] = True
    vertices = truth.vertices + rng.normal(0, noise, truth.vertices.shape).astype(np.float32)
    return replace(truth, vertices=vertices, known=known)


Estimate = tuple[NDArray[Any], NDArray[Any], NDArray[Any]]
"""The points of a frame, and the ages and the standard errors of its vertices."""


def one_way(
    sequence: dynmesh.Sequence, numbers: list[int], origin: Estimate, **settings: Any
) -> dict[int, Estimate]:
    """The frames with these numbers, completed in this order from another one."""
    settings = {"learn": True, "uncertainty": True, **settings}
    completer = dynmesh.Completer(sequence.faces, origin[0], **settings)
    frames = {}
    assert sequence.known is not None
    for n_frames, number in enumerate(numbers, 1):
        made = completer.push(sequence.vertices[number], sequence.known[number])
        never = completer.age == n_frames
        error = np.hypot(completer.standard_error, np.where(never, origin[2], 0))
        frames[number] = (made, completer.age + never * origin[1], error.astype(np.float32))
    return frames


def mean_of(one: Estimate, other: Estimate) -> Estimate:
    points, ages, errors = (np.stack(both).astype(float) for both in zip(one, other, strict=True))
    with np.errstate(divide="ignore"):
        weights = np.minimum(errors**-1.5, 1e30)
    weights[:, np.isinf(errors).all(axis=0)] = 1
    weights /= weights.sum(axis=0)
    y = (weights[:, :, None] * points).sum(axis=0)
    spread = (weights * ((points - y) ** 2).sum(axis=2)).sum(axis=0) / 3
    shared = (weights * np.where(weights, errors, 0) ** 2).sum(axis=0)
    return y, ages.min(axis=0), np.sqrt(0.4 * shared + spread)


def expected_of(sequence: dynmesh.Sequence, whole: int, points: Any, **settings: Any) -> Estimate:
    """A literal transcription: to the nearer end, across, and back; the mean of the last two."""
    start = (points, np.zeros(100, int), np.zeros(100))
    across = list(range(N)) if whole < N / 2 else list(range(N - 1, -1, -1))
    outwards = across[: across.index(whole)][::-1] if whole >= 0 else []
    if whole < 0:
        made = one_way(sequence, across, start, **settings)
        back = one_way(sequence, across[-2::-1], made[across[-1]], **settings)
    elif outwards:
        made = one_way(sequence, outwards, start, **settings)
        made |= one_way(sequence, across[1:], made[across[0]], **settings)
        back = one_way(sequence, across[-2::-1], made[across[-1]], **settings)
    else:
        made = one_way(sequence, across[1:], start, **settings)
        back = one_way(sequence, across[-2:0:-1], made[across[-1]], **settings)
    made |= {number: mean_of(made[number], estimate) for number, estimate in back.items()}
    if whole >= 0:
        made[whole] = start
    y, ages, errors = (np.array([made[i][part] for i in range(N)]) for part in range(3))
    return y, ages, errors


@pytest.mark.parametrize("settings", [{}, {"noise": 0.02}])
@pytest.mark.parametrize("whole", [0, 3, 8, N - 1, -1])
def test_a_file_is_completed_from_both_sides(tmp_path: Path, whole: int, settings: Any) -> None:
    noise = settings.get("noise", 0)
    sequence, options = partial(TRUTH, max(whole, 0), noise), {**settings}
    start = sequence.vertices[whole] if whole >= 0 else TRUTH.vertices[5]
    if whole < 0:
        dynmesh.write(tmp_path / "template.npz", replace(TRUTH, vertices=TRUTH.vertices[5:6]))
        options["template"] = tmp_path / "template.npz"
    else:
        options["start"] = whole
    dynmesh.write(tmp_path / "partial.npz", sequence)
    output = tmp_path / "out.npz"
    report = dynmesh.complete_file(
        tmp_path / "partial.npz", output, bidirectional=True, provenance=True, **options
    )
    made = dynmesh.read(output)
    points, ages, errors = expected_of(sequence, whole, start, **settings)
    np.testing.assert_allclose(made.vertices, points, atol=2e-6)
    np.testing.assert_array_equal(made.age, ages)
    assert made.standard_error is not None
    np.testing.assert_allclose(made.standard_error, errors, atol=2e-6, rtol=1e-4)
    assert report.frames == N
    if not noise:  # what was observed comes back bit for bit
        assert sequence.known is not None
        np.testing.assert_array_equal(
            made.vertices[sequence.known], sequence.vertices[sequence.known]
        )


def frame_of(points: list[float], age: list[int], error: list[float]) -> dynmesh.files.Frame:
    return dynmesh.files.Frame(
        np.repeat(np.array(points, np.float32)[:, None], 3, axis=1),
        generation=np.array(age, np.int32),
        age=np.array(age, np.int32),
        standard_error=np.array(error, np.float32),
    )


def test_what_one_way_rejects_or_does_not_know_comes_from_the_other() -> None:
    """Observed; rejected by the second; unknown to the first; unknown to both; disagreeing."""
    one = frame_of([1, 5, 7, 2, 0], [0, 0, 3, 3, 1], [0, 0, np.inf, np.inf, 1])
    other = frame_of([1, 1, 3, 4, 6], [0, 2, 3, 3, 1], [0, 0.5, 1, np.inf, 1])
    for made in (combined(one, other), combined(other, one)):
        np.testing.assert_allclose(made.points[:, 0], [1, 1, 3, 3, 3], atol=1e-6)
        np.testing.assert_array_equal(made.age, [0, 2, 3, 3, 1])
        assert made.standard_error is not None
        assert made.standard_error[0] == 0
        assert np.isinf(made.standard_error[3])
        assert made.standard_error[4] > 3  # they are 6 apart
