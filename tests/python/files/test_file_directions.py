"""Files completed in both directions, and what they learn from training files."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import to_file
from bending_sheet import poses
from meshes import sheet
from sequences import sea
from streams import expected_of

import dynmesh
from dynmesh.completion import start as training_module
from dynmesh.completion.passes import combined

WHOLE_POSE = 4
REST = sheet(10)


def training_of(n: int, seed: int) -> dynmesh.Sequence:
    return dynmesh.Sequence(poses(REST.vertices, n, np.random.default_rng(seed)), REST.faces)


@pytest.fixture
def partial(tmp_path: Path) -> dynmesh.Sequence:
    """A sequence of which frames 0 and 4 are whole, stored as partial.npz."""
    known = np.random.default_rng(2).random((9, 100)) < 0.4
    known[[0, WHOLE_POSE]] = True
    sequence = replace(training_of(9, 1), known=known)
    dynmesh.write(tmp_path / "partial.npz", sequence)
    return sequence


def test_both_directions_learn_from_all_files(
    tmp_path: Path,
    partial: dynmesh.Sequence,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    read: list[int] = []

    def watched(frames: Iterator[Any], total: int, *_: Any) -> Iterator[Any]:
        read.append(total)
        for frame in frames:
            read[-1] -= 1
            yield frame

    monkeypatch.setattr(training_module, "tracked", watched)
    recordings = [tmp_path / "take0.npz", tmp_path / "take1.npz"]
    for seed, path in enumerate(recordings):
        dynmesh.write(path, training_of(8, 10 + seed))
    report = to_file.complete(
        tmp_path / "partial.npz", tmp_path / "out.npz", start=WHOLE_POSE, training=recordings
    )
    both = np.concatenate([dynmesh.read(training).vertices for training in recordings])
    expected = expected_of(partial, WHOLE_POSE, training=both).vertices
    made = dynmesh.read(tmp_path / "out.npz").vertices
    np.testing.assert_array_equal(made, expected)
    assert np.abs(made - expected_of(partial, WHOLE_POSE).vertices).max() > 0.01
    assert read == [0]  # once, all frames
    assert report.prior_weight is not None
    assert report.prior_share is not None
    assert 0.5 < report.prior_weight <= 1
    assert 0 < report.prior_share <= 1


def beside(path: Path, **files: str) -> Path:
    """A stage that has these files side by side."""
    prims = [f'def "{name}" (references = @{file}@) {{}}' for name, file in files.items()]
    path.write_text("\n".join(["#usda 1.0", *prims, ""]))
    return path


def test_a_mesh_of_a_scene_learns_from_the_mesh_at_its_path(
    tmp_path: Path, partial: dynmesh.Sequence
) -> None:
    pytest.importorskip("pxr.Usd")
    dynmesh.write(tmp_path / "partial.usda", partial)
    stage = beside(tmp_path / "shot.usda", one="partial.usda", other="partial.usda")
    for seed in (0, 1):
        dynmesh.write(tmp_path / f"training{seed}.usda", training_of(8, 10 + seed))
    pair = beside(tmp_path / "pair.usda", one="training0.usda", other="training1.usda")
    for seed, mesh in enumerate(("/one", "/other")):
        made, expected = tmp_path / f"made{seed}.npz", tmp_path / f"expected{seed}.npz"
        to_file.complete(stage, made, source={"prim": mesh}, training=pair)
        training = tmp_path / f"training{seed}.usda"  # whose only mesh has another path
        to_file.complete(stage, expected, source={"prim": mesh}, training=training)
        np.testing.assert_array_equal(dynmesh.read(made).vertices, dynmesh.read(expected).vertices)


N = 12
SEA = sea(N)


def one_way(
    sequence: dynmesh.Sequence, numbers: list[int], start: Any, **settings: Any
) -> dict[int, Any]:
    """The frames with these numbers, completed in this order from another one."""
    given = {"learn": True, "uncertainty": True} | settings
    completer, frames = dynmesh.Completer(sequence.faces, start.points, **given), {}
    known: Any = sequence.known
    for n_frames, number in enumerate(numbers, 1):
        made = completer.push(sequence.vertices[number], known[number])
        never = completer.age == n_frames
        error = np.hypot(completer.standard_error, np.where(never, start.standard_error, 0))
        frames[number] = dynmesh.Frame(
            made,
            generation=completer.generation,
            age=completer.age + never * start.age,
            standard_error=error.astype(np.float32),
        )
    return frames


def both_sides_of(sequence: dynmesh.Sequence, whole: int, points: Any, **settings: Any) -> Any:
    """To the nearer end, across, and back; the last two put together."""
    zeros: Any = np.zeros(100, np.int32)
    start = dynmesh.Frame(points, generation=zeros, age=zeros, standard_error=zeros)
    across = list(range(N)) if whole < N / 2 else list(range(N - 1, -1, -1))
    outwards = across[: across.index(whole)][::-1] if whole >= 0 else []
    made = {whole: start} | one_way(sequence, outwards, start, **settings)
    first = across[0] if whole >= 0 else whole
    there = [number for number in across if number != first]
    made |= one_way(sequence, there, made[first], **settings)
    back = one_way(sequence, across[-2::-1], made[across[-1]], **settings)
    made |= {number: combined(made[number], frame) for number, frame in back.items()}
    made |= {whole: start}
    return [made[number] for number in range(N)]


@pytest.mark.parametrize("settings", [{}, {"noise": 0.02}])
@pytest.mark.parametrize("whole", [0, 3, 8, N - 1, -1])
def test_a_file_is_completed_from_both_sides(tmp_path: Path, whole: int, settings: Any) -> None:
    """An ocean of which only one frame is whole, and in one nothing was observed."""
    rng = np.random.default_rng(max(whole, 0))
    known = rng.random((N, 100)) < 0.3
    known[N // 2] = False
    known[:, 55] = False
    known[max(whole, 0)] = True
    noise = settings.get("noise", 0)
    vertices = SEA.vertices + rng.normal(0, noise, SEA.vertices.shape).astype(np.float32)
    sequence, options = replace(SEA, vertices=vertices, known=known), {**settings}
    start = sequence.vertices[whole] if whole >= 0 else SEA.vertices[5]
    if whole < 0:
        dynmesh.write(tmp_path / "template.npz", replace(SEA, vertices=SEA.vertices[5:6]))
        options["template"] = tmp_path / "template.npz"
    else:
        options["start"] = whole
    dynmesh.write(tmp_path / "partial.npz", sequence)
    output = tmp_path / "out.npz"
    report = to_file.complete(
        tmp_path / "partial.npz", output, bidirectional=True, provenance=True, **options
    )
    made = dynmesh.read(output)
    expected = both_sides_of(sequence, whole, start, **settings)
    for number, frame in enumerate(expected):
        one: Any = made[number]
        np.testing.assert_allclose(one.points, frame.points, atol=2e-6)
        np.testing.assert_array_equal(one.age, frame.age)
        np.testing.assert_allclose(one.standard_error, frame.standard_error, atol=2e-6, rtol=1e-4)
    assert report.frames == N
    if not noise:  # what was observed comes back bit for bit
        np.testing.assert_array_equal(made.vertices[known], sequence.vertices[known])


def frame_of(points: list[float], age: list[int], error: list[float]) -> dynmesh.Frame:
    return dynmesh.Frame(
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
