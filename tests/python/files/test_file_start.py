"""Files completed from any frame, a template or one put together, and in both directions."""

import re
import warnings
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
from plain_files import XYZ, ply
from sequences import assert_same, sea
from streams import expected_of

import dynmesh
from dynmesh.completion import passes
from dynmesh.completion import start as training_module
from dynmesh.completion.passes import combined

WHOLE = 7
TRUTH = sea(15, 12)
PARTIAL = sea(15, 12, share=0.3, whole=[WHOLE], fps=25.0)
"""Of which only frame 7 is whole."""
KNOWN: Any = PARTIAL.known


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
        # The frame before a block shows what is held in it.
        blocks = held[1:-1]
        assert max(blocks) == frames_in_a_block + 1
        assert sum(blocks) == WHOLE + len(blocks) - 1
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
    made: Any = dynmesh.read(output)
    assert holed.known is not None
    assert (report.start, report.quality, report.frames) == (number, "good", 15)
    whole = dynmesh.whole_frames.whole_frame(
        holed.faces,
        holed,
        frame=start if start == number else "best",
        noise=options.get("noise"),
        outliers=options.get("reject_outliers", False),
    )
    np.testing.assert_array_equal(made.vertices[number], whole.positions)
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
    made: Any = dynmesh.read(output)
    whole = dynmesh.whole_frames.whole_frame(holed.faces, holed)
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
    for again in (["--overwrite"], []):  # a verdict is kept
        told = run("batch", tmp_path / "jobs.csv", *again, "--quiet", code=3).stderr
        assert f"1 doubtful of 1 job: {tmp_path / 'batch.npz'}: " in told


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
    assert said.startswith(f"{words[-1]}: good; ") != bool(told)
    assert bool(told) == bool(re.search(f"probably ruined: .*{told}", said))


def test_frames_of_which_nothing_was_observed_count_once(tmp_path: Path) -> None:
    known = KNOWN & (np.arange(len(KNOWN)) < 3)[:, None]
    known[0] = True
    dynmesh.write(tmp_path / "in.npz", replace(TRUTH, known=known))
    report = to_file.complete(tmp_path / "in.npz", tmp_path / "out.npz", bidirectional=True)
    assert report.empty == len(KNOWN) - 3
    assert (report.quality, report.reason) == (
        "doubtful",
        "doubtful: hardly anything is known in most frames",
    )
    with pytest.warns(UserWarning, match="hardly anything is known in most frames"):
        dynmesh.read(dynmesh.complete(replace(TRUTH, known=known)))


@pytest.mark.parametrize(("share", "quality"), [(0.03, "good"), (0.1, "doubtful")])
def test_a_start_of_which_a_part_is_seen_in_no_frame_is_doubtful(
    share: float, quality: str
) -> None:
    k = KNOWN.shape[1]
    known = KNOWN & (np.arange(k) >= share * k)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        completed = dynmesh.complete(replace(TRUTH, known=known))
    assert completed.report.quality == quality
    told = "; ".join([completed.report.reason, *completed.report.remarks])
    assert len(re.findall("(seen|known) in no frame", told)) == (quality != "good")
    assert ("seen in no frame, and are a guess" in told) == (quality != "good")


@pytest.mark.parametrize("side", [1, 3])
def test_a_patch_that_no_completed_frame_knows_is_remarked(side: int) -> None:
    """But no single vertex, which those around it describe."""
    known = np.ones((15, 144), np.bool_)
    known.reshape(15, 12, 12)[1:, 4 : 4 + side, 4 : 4 + side] = False
    remarks = dynmesh.complete(replace(TRUTH, known=known)).report.remarks
    told = [one.split(",")[0] for one in remarks if "known in no frame" in one]
    assert told == ["9 vertices"] * (side > 1)


def test_a_start_without_extent_is_ruined(tmp_path: Path) -> None:
    """As one of zeros that an inverted mask says are known."""
    zeros = np.where(KNOWN[..., None], 0, PARTIAL.vertices)
    dynmesh.write(tmp_path / "in.npz", replace(PARTIAL, vertices=zeros))
    said = run("complete", tmp_path / "in.npz", tmp_path / "out.npz", code=3).stderr
    assert "100 % of the edges have no length where completion started" in said


def test_a_template_says_the_unit_and_the_axis_where_the_sequence_does_not() -> None:
    silent = replace(TRUTH, up_axis=None, metres_per_unit=None, known=None)
    whole = replace(TRUTH[:1], up_axis="z", metres_per_unit=0.01)
    made: Any = dynmesh.complete(silent, template=whole)
    assert (made.up_axis, made.metres_per_unit) == ("z", 0.01)
    made = dynmesh.complete(replace(silent, up_axis="y"), template=replace(whole, up_axis=None))
    assert (made.up_axis, made.metres_per_unit) == ("y", 0.01)


@pytest.mark.usefixtures("stored")
def test_a_template_stands_before_frame_0_and_lends_its_faces(tmp_path: Path) -> None:
    """Scanners write points alone, and point caches hold no faces."""
    dynmesh.write(tmp_path / "template.ply", TRUTH[:1])
    holed = np.where(KNOWN[:, :, None], PARTIAL.vertices, np.float32(np.nan))
    np.save(tmp_path / "points.npy", holed)
    for number, points in enumerate(holed):
        rows = "".join(f"{x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in points.tolist())
        content = ply(f"vertex {len(points)}: {XYZ}", rows.encode())
        (tmp_path / f"scan_{number}.ply").write_bytes(content)
    completer = dynmesh.Completer(PARTIAL.faces, TRUTH.vertices[0], method="detail")
    expected = [completer.push(*frame) for frame in zip(PARTIAL.vertices, KNOWN, strict=True)]
    for name in ("partial.npz", "points.npy", "scan_%d.ply"):
        output = tmp_path / "out.npz"
        options: Any = {"template": tmp_path / "template.ply", "overwrite": True}
        report = to_file.complete(tmp_path / name, output, **options)
        assert (report.frames, report.completed, report.start) == (15, 15, None)
        np.testing.assert_array_equal(dynmesh.read(output).vertices, expected)
        np.testing.assert_array_equal(dynmesh.read(output).faces, TRUTH.faces)


def test_the_report_of_a_file_counts(tmp_path: Path) -> None:
    astray = list(dynmesh.losses.add_outliers(PARTIAL.vertices, PARTIAL.faces, 0.02))
    spoilt = replace(PARTIAL, vertices=np.stack(astray))[WHOLE:]
    dynmesh.write(tmp_path / "in.npz", spoilt)
    completer = dynmesh.Completer(spoilt.faces, spoilt.vertices[0], reject_outliers=True)
    reports = []
    for points, known in zip(spoilt.vertices[1:], KNOWN[WHOLE + 1 :], strict=True):
        completer.push(points, known)
        reports.append(completer.report)
    for rejects in (False, True):
        report: Any = to_file.complete(
            tmp_path / "in.npz", tmp_path / "out.npz", reject_outliers=rejects, overwrite=True
        )
        assert report.rejected == (sum(one.rejected for one in reports) if rejects else 0)
        assert any("rejected as outliers" in line for line in report.lines()) == rejects
    counts = [(one.known, one.filled, one.disconnected) for one in reports]
    assert (report.known, report.filled, report.disconnected) == tuple(np.sum(counts, axis=0))
    assert report.rejected > 0
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
    report: Any = to_file.complete(
        tmp_path / "partial.npz", tmp_path / "out.npz", start=WHOLE_POSE, training=recordings
    )
    both = np.concatenate([dynmesh.read(training).vertices for training in recordings])
    expected = expected_of(partial, WHOLE_POSE, training=both).vertices
    made = dynmesh.read(tmp_path / "out.npz").vertices
    np.testing.assert_array_equal(made, expected)
    assert np.abs(made - expected_of(partial, WHOLE_POSE).vertices).max() > 0.01
    assert read == [0]  # once, all frames
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


@pytest.mark.parametrize("noise", [None, 0.02])
@pytest.mark.parametrize("whole", [0, 3, N - 1])
def test_both_sides_are_those_of_the_sequence_played_backwards(
    whole: int, noise: float | None
) -> None:
    """An ocean of which only one frame is whole, and in one nothing was observed."""
    rng = np.random.default_rng(whole)
    known = rng.random((N, 100)) < 0.3
    known[N // 2] = False
    known[:, 55] = False
    known[whole] = True
    vertices = SEA.vertices + rng.normal(0, noise or 0, SEA.vertices.shape).astype(np.float32)
    partial = replace(SEA, vertices=vertices, known=known)
    back = replace(partial, vertices=vertices[::-1].copy(), known=known[::-1].copy())
    options: Any = {"bidirectional": True, "noise": noise, "uncertainty": True}
    made: Any = dynmesh.complete(partial, start=whole, **options)
    backwards: Any = dynmesh.complete(back, start=N - 1 - whole, **options)
    for name in ("vertices", "age", "standard_error"):
        np.testing.assert_array_equal(getattr(made, name), getattr(backwards, name)[::-1])
    apart = np.abs(np.subtract.outer(np.arange(N), np.arange(N)))[..., None]
    np.testing.assert_array_equal(made.age, np.where(known, apart, N).min(axis=1))
    last, before = made.standard_error[[-1, -2] if whole < N / 2 else [0, 1], 55]
    assert before > 0.45 * last > 0  # what is turned at is as uncertain on the way back
    if not noise:  # what was observed comes back bit for bit
        np.testing.assert_array_equal(made.vertices[known], partial.vertices[known])


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
