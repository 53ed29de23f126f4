"""Files completed from a whole frame, a template, or both sides."""

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import to_file
from bending_sheet import poses
from commands import dynmesh_command as run
from meshes import sheet
from numpy.typing import NDArray
from plain_files import XYZ, ply
from sequences import assert_same, sea

import dynmesh
from dynmesh.completion import passes
from dynmesh.completion import training as training_module
from dynmesh.completion.passes import combined

WHOLE = 7
TRUTH = sea(15, 12)
PARTIAL = sea(15, 12, share=0.3, whole=[WHOLE], fps=25.0)
"""Of which only frame 7 is whole."""
KNOWN: Any = PARTIAL.known


def completed(sequence: dynmesh.Sequence, order: list[int], **settings: Any) -> dict[int, Any]:
    """The frames with these numbers, completed in this order, with their provenance."""
    assert sequence.known is not None
    completer = dynmesh.Completer(sequence.faces, sequence.vertices[order[0]], **settings)
    frames = {order[0]: (sequence.vertices[order[0]], completer.generation, completer.age)}
    for number in order[1:]:
        points = completer.push(sequence.vertices[number], sequence.known[number])
        frames[number] = (points, completer.generation, completer.age)
    return frames


def expected_of(sequence: dynmesh.Sequence, whole: int, **settings: Any) -> dynmesh.Sequence:
    """The sequence completed from its whole frame, backwards and forwards, in memory."""
    n = len(sequence.vertices)
    frames = completed(sequence, list(range(whole, -1, -1)), **settings)
    frames |= completed(sequence, list(range(whole, n)), **settings)
    points, generation, age = (np.stack([frames[i][part] for i in range(n)]) for part in range(3))
    return replace(sequence, vertices=points, known=None, generation=generation, age=age)


@pytest.fixture
def stored(tmp_path: Path) -> Path:
    dynmesh.write(tmp_path / "partial.npz", PARTIAL)
    return tmp_path / "partial.npz"


@pytest.mark.parametrize(
    "settings", [{}, {"method": "motion"}, {"reject_outliers": True, "start": WHOLE}]
)
@pytest.mark.parametrize("frames_in_a_block", [1, 3])
def test_frames_are_completed_backwards_and_forwards_with_a_few_in_memory(
    tmp_path: Path,
    stored: Path,
    monkeypatch: pytest.MonkeyPatch,
    frames_in_a_block: int,
    settings: Any,
) -> None:
    """From the first whole frame, if no other one is named."""
    held: list[int] = []
    read = dynmesh.frames.Stored.frames

    def counted(self: Any, *numbers: int) -> Iterator[Any]:
        held.append(len(range(15)[slice(*(numbers or (None,)))]))
        yield from read(self, *numbers)

    monkeypatch.setattr(passes, "_BLOCK", PARTIAL.vertices[0].nbytes * frames_in_a_block)
    monkeypatch.setattr(dynmesh.frames.Stored, "frames", counted)
    report = to_file.complete(stored, tmp_path / "out.npz", provenance=True, **settings)
    monkeypatch.undo()
    if "start" in settings:  # nothing is read to find it; the last call streams what follows it
        assert max(held[1:-1]) == frames_in_a_block
        assert sum(held[1:-1]) == WHOLE
    made = dynmesh.read(tmp_path / "out.npz")
    settings = {name: value for name, value in settings.items() if name != "start"}
    assert_same(made, expected_of(PARTIAL, WHOLE, **settings))
    assert any("frame 7" in line for line in report.lines())
    assert (report.frames, report.completed, report.start) == (15, 14, WHOLE)
    if not settings.get("reject_outliers"):
        assert report.known == np.count_nonzero(KNOWN) - 144


@pytest.fixture
def holed(tmp_path: Path) -> dynmesh.Sequence:
    """The same without a whole frame, also as holed.npz."""
    known = KNOWN.copy()
    known[WHOLE] = np.arange(144) % 5 > 0
    known[:, 143] = False
    made = replace(PARTIAL, known=known)
    dynmesh.write(tmp_path / "holed.npz", made)
    return made


@pytest.mark.parametrize(
    ("start", "options", "number"),
    [
        ("auto", {}, WHOLE),
        ("best", {"uncertainty": True}, WHOLE),
        ("best", {"noise": 0.01, "reject_outliers": True}, WHOLE),
        (3, {}, 3),
    ],
)
def test_the_start_is_put_together_from_all_frames(
    tmp_path: Path, holed: dynmesh.Sequence, start: Any, options: Any, number: int
) -> None:
    output = tmp_path / "out.npz"
    report = to_file.complete(
        tmp_path / "holed.npz", output, start=start, provenance=True, **options
    )
    made = dynmesh.read(output)
    assert holed.known is not None
    assert made.generation is not None
    assert (report.start, report.quality, report.frames) == (number, "good", 15)
    whole = dynmesh.whole_frame(
        holed.faces,
        holed,
        frame=start if start == number else "best",
        noise=options.get("noise"),
        outliers=options.get("reject_outliers", False),
    )
    np.testing.assert_array_equal(made.vertices[number], whole.positions)
    known, unseen = np.count_nonzero(whole.known), np.count_nonzero(~whole.seen)
    assert (
        f"completion started from frame {number}, which knows {known} of 144 vertices; "
        f"{144 - known - unseen} were put together from other frames, {unseen} were seen in no "
        "frame"
    ) in report.remarks
    expected = expected_of(replace(holed, vertices=made.vertices), number)
    np.testing.assert_array_equal(made.generation[number], np.where(whole.known, 0, -2))
    others = np.arange(15) != number
    assert made.generation[others].min() >= 0
    if not options:
        np.testing.assert_array_equal(made.vertices[others], expected.vertices[others])


def test_standard_errors_begin_with_those_of_the_start(
    tmp_path: Path, holed: dynmesh.Sequence
) -> None:
    output = tmp_path / "out.npz"
    to_file.complete(
        tmp_path / "holed.npz", output, uncertainty=True, provenance=True, drop_above=0.2
    )
    made = dynmesh.read(output)
    whole = dynmesh.whole_frame(holed.faces, holed)
    assert made.standard_error is not None
    assert made.known is not None
    np.testing.assert_array_equal(made.standard_error[WHOLE], whole.standard_error)
    assert (made.standard_error[:, 143] >= whole.standard_error[143]).all()
    np.testing.assert_array_equal(made.known, made.standard_error <= 0.2)


def test_a_doubtful_start_is_said_to_be(tmp_path: Path, holed: dynmesh.Sequence) -> None:
    garbage = holed.vertices.copy()
    garbage[WHOLE] = np.random.default_rng(0).normal(size=garbage[WHOLE].shape)  # the best frame
    dynmesh.write(tmp_path / "garbage.npz", replace(holed, vertices=garbage))
    words = ("complete", tmp_path / "garbage.npz", tmp_path / "out.npz", "--quiet")
    assert "is probably wrong, as its edges" in run(*words, code=3).stderr
    assert len(dynmesh.read(tmp_path / "out.npz")) == 15
    (tmp_path / "jobs.csv").write_text("input,output\ngarbage.npz,batch.npz\n")
    batch = ("batch", tmp_path / "jobs.csv", "--overwrite")
    assert "0 done, 1 doubtful" in run(*batch, code=3).stderr
    for again in (["--overwrite"], []):  # a verdict is kept
        told = run(*batch[:2], *again, "--quiet", code=3).stderr
        assert f"1 doubtful of 1 job: {tmp_path / 'batch.npz'}: " in told
    dynmesh.write(tmp_path / "garbage.npz", holed)
    assert "1 done" in run(*batch).stderr
    assert "1 already there" in run(*batch[:2]).stderr


@pytest.mark.parametrize(
    ("places", "factor", "told"),
    [
        (np.s_[:, 40:], 0, "in frames 0 to 14, .* % of the edges"),
        (np.s_[3], 1000, "in frame 3, what is known is 1000 times as large"),
        (np.s_[:], 100, "what is known is 100.* times as large .* in another unit"),
        (np.s_[:0], 1, ""),
    ],
)
def test_ruined_frames_are_said_to_be(
    places: Any, factor: float, told: str, tmp_path: Path
) -> None:
    vertices = PARTIAL.vertices.copy()
    vertices[places] *= factor
    dynmesh.write(tmp_path / "in.npz", replace(PARTIAL, vertices=vertices))
    dynmesh.write(tmp_path / "whole.npz", TRUTH[:1])
    words = ("complete", tmp_path / "in.npz", tmp_path / "out.npz")
    said = run(*words, "--template", tmp_path / "whole.npz", code=3 if told else 0).stderr
    assert bool(told) == bool(re.search(f"probably ruined: .*{told}.*; dynmesh info", said))


def test_frames_of_which_nothing_was_observed_count_once(tmp_path: Path) -> None:
    known = KNOWN & (np.arange(len(KNOWN)) < 3)[:, None]
    known[0] = True
    dynmesh.write(tmp_path / "in.npz", replace(TRUTH, known=known))
    report = to_file.complete(tmp_path / "in.npz", tmp_path / "out.npz", bidirectional=True)
    assert report.empty == len(KNOWN) - 3
    assert (report.quality, report.reason) == ("doubtful", "nothing was observed in most frames")
    with pytest.warns(UserWarning, match="nothing was observed in most frames"):
        dynmesh.read(dynmesh.complete(replace(TRUTH, known=known)))


def test_a_start_without_extent_is_ruined(tmp_path: Path) -> None:
    """As one of zeros that an inverted mask says are known."""
    zeros = np.where(KNOWN[..., None], 0, PARTIAL.vertices)
    dynmesh.write(tmp_path / "in.npz", replace(PARTIAL, vertices=zeros))
    said = run("complete", tmp_path / "in.npz", tmp_path / "out.npz", code=3).stderr
    assert "100 % of the edges have no length where completion started" in said


def test_a_template_stands_before_frame_0(tmp_path: Path, stored: Path) -> None:
    dynmesh.write(tmp_path / "template.obj", TRUTH[9:10])
    points = dynmesh.read(tmp_path / "template.obj").vertices[0]
    completer = dynmesh.Completer(PARTIAL.faces, points.astype(np.float32), method="detail")
    expected = [completer.push(*frame) for frame in zip(PARTIAL.vertices, KNOWN, strict=True)]
    output = tmp_path / "out.npz"
    report = to_file.complete(stored, output, template=tmp_path / "template.obj")
    assert (report.frames, report.completed, report.start) == (15, 15, None)
    np.testing.assert_array_equal(dynmesh.read(output).vertices, expected)


@pytest.mark.usefixtures("stored")
def test_a_template_lends_its_faces(tmp_path: Path) -> None:
    """Scanners write points alone, and point caches hold no faces."""
    dynmesh.write(tmp_path / "template.ply", TRUTH[:1])
    holed = np.where(KNOWN[:, :, None], PARTIAL.vertices, np.float32(np.nan))
    np.save(tmp_path / "points.npy", holed)
    for number, points in enumerate(holed):
        rows = "".join(f"{x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in points.tolist())
        content = ply(f"vertex {len(points)}: {XYZ}", rows.encode())
        (tmp_path / f"scan_{number}.ply").write_bytes(content)
    made: list[dynmesh.Sequence] = []
    for name in ("partial.npz", "points.npy", "scan_%d.ply"):
        output = tmp_path / f"{len(made)}.npz"
        to_file.complete(tmp_path / name, output, template=tmp_path / "template.ply")
        made.append(dynmesh.read(output))
    for other in made[1:]:
        np.testing.assert_array_equal(other.vertices, made[0].vertices)
        np.testing.assert_array_equal(other.faces, TRUTH.faces)


def test_the_report_of_a_file_counts(tmp_path: Path) -> None:
    astray = list(dynmesh.degrade.add_outliers(PARTIAL.vertices, PARTIAL.faces, 0.02))
    spoilt = replace(PARTIAL, vertices=np.stack(astray))[WHOLE:]
    dynmesh.write(tmp_path / "in.npz", spoilt)
    completer = dynmesh.Completer(spoilt.faces, spoilt.vertices[0], reject_outliers=True)
    reports = []
    for points, known in zip(spoilt.vertices[1:], KNOWN[WHOLE + 1 :], strict=True):
        completer.push(points, known)
        reports.append(completer.report)
    for rejects in (False, True):
        report = to_file.complete(
            tmp_path / "in.npz", tmp_path / "out.npz", reject_outliers=rejects, overwrite=True
        )
        assert report.rejected == (sum(one.rejected for one in reports) if rejects else 0)
        assert any("rejected as outliers" in line for line in report.lines()) == rejects
    counts = [(one.known, one.filled, one.disconnected) for one in reports]
    assert (report.known, report.filled, report.disconnected) == tuple(np.sum(counts, axis=0))
    assert report.rejected > 0
    assert report.seconds_per_frame is not None
    assert report.seconds_per_frame > 0


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


def both_sides_of(sequence: dynmesh.Sequence, whole: int, points: Any, **settings: Any) -> Estimate:
    """A literal transcription: to the nearer end, across, and back; the mean of the last two."""
    origin = {whole: (points, np.zeros(100, int), np.zeros(100))}
    across = list(range(N)) if whole < N / 2 else list(range(N - 1, -1, -1))
    outwards = across[: across.index(whole)][::-1] if whole >= 0 else []
    made = origin | one_way(sequence, outwards, origin[whole], **settings)
    first = across[0] if whole >= 0 else whole
    there = [number for number in across if number != first]
    made |= one_way(sequence, there, made[first], **settings)
    back = one_way(sequence, across[-2::-1], made[across[-1]], **settings)
    made |= {number: mean_of(made[number], estimate) for number, estimate in back.items()}
    made |= origin
    y, ages, errors = (np.array([made[i][part] for i in range(N)]) for part in range(3))
    return y, ages, errors


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
    points, ages, errors = both_sides_of(sequence, whole, start, **settings)
    np.testing.assert_allclose(made.vertices, points, atol=2e-6)
    np.testing.assert_array_equal(made.age, ages)
    assert made.standard_error is not None
    np.testing.assert_allclose(made.standard_error, errors, atol=2e-6, rtol=1e-4)
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
