"""Sequences and masks in memory: completed, measured and shown as files are."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import to_file
from sequences import assert_same, sea

import dynmesh
from dynmesh.draw.heatmap import Heatmap

N = 8
TRUTH = sea(N)
PARTIAL = sea(N, share=0.6, up_axis="z")
"""No frame of it is whole."""
KNOWN: Any = PARTIAL.known
COMPLETED = dynmesh.read(dynmesh.complete(PARTIAL, start=0, method="motion"))


OPTIONS: list[dict[str, Any]] = [
    {},
    {"method": "motion"},
    {"start": 3, "uncertainty": True},
    {"bidirectional": True},
    {"bidirectional": True, "training": True},
    {"start": "best", "drop_above": 0.2},
]


@pytest.mark.parametrize("options", OPTIONS, ids=str)
def test_what_was_estimated_is_estimated_again(options: dict[str, Any]) -> None:
    """A completed sequence is completed as that of which it was made."""
    options = options | ({"training": TRUTH.vertices[2:6]} if "training" in options else {})
    completed = dynmesh.read(dynmesh.complete(PARTIAL, **options))
    assert_same(dynmesh.read(dynmesh.complete(completed, **options)), completed)


def test_estimates_are_no_observations_elsewhere(tmp_path: Path) -> None:
    """With a mask, after a loss, and in a format that cannot say so."""
    again = dynmesh.read(dynmesh.complete(replace(COMPLETED, known=np.ones_like(KNOWN)), start=0))
    np.testing.assert_array_equal(
        again.vertices, dynmesh.read(dynmesh.complete(PARTIAL, start=0)).vertices
    )
    dynmesh.write(tmp_path / "completed.npz", COMPLETED)
    to_file.write(dynmesh.degrade(tmp_path / "completed.npz", known=0.99), tmp_path / "partial.npz")
    left: Any = dynmesh.read(tmp_path / "partial.npz").known
    np.testing.assert_array_equal(left & ~KNOWN, np.zeros_like(KNOWN))
    assert left.sum() > 0.9 * KNOWN.sum()
    diagnosis: Any = dynmesh.info(COMPLETED).diagnosis
    np.testing.assert_allclose(diagnosis.known_share, KNOWN.mean(axis=1))
    whole = dynmesh.whole_frames.whole_frame(COMPLETED.faces, COMPLETED, frame=3)
    np.testing.assert_array_equal(whole.known, KNOWN[3])
    for made in (
        to_file.complete(tmp_path / "completed.npz", tmp_path / "a_%02d.obj"),
        to_file.convert(tmp_path / "completed.npz", tmp_path / "b_%02d.obj"),
    ):
        (told,) = (one for one in made.remarks if "generation" in one)
        assert "counts as observed" in told


def test_errors_by_frame_of_missing_vertices_alone() -> None:
    """From the generations, and from the partial sequence, also if zeros stand for missing ones."""
    completed, truth = (each.vertices.astype(np.float64) for each in (COMPLETED, TRUTH))
    diagonal = np.linalg.norm(np.ptp(truth[0], axis=0))
    apart = np.linalg.norm(completed - truth, axis=-1) / diagonal
    frames = range(2, 7, 2)
    expected = [apart[t][~KNOWN[t]] for t in frames]
    bare = replace(COMPLETED, generation=None, age=None)
    zeros = np.where(KNOWN[..., None], PARTIAL.vertices, 0)
    of_zeros = replace(PARTIAL, vertices=zeros, known=None)
    for made, more in ((COMPLETED, {}), (bare, {"input": PARTIAL}), (bare, {"input": of_zeros})):
        found = dynmesh.evaluate(made, TRUTH, frames=frames, only="missing", **more)  # type: ignore[arg-type]
        assert [each.frame for each in found.each] == [2, 4, 6]
        assert [each.vertices for each in found.each] == [len(own) for own in expected]
        np.testing.assert_allclose([e.mean for e in found.each], [o.mean() for o in expected])
        np.testing.assert_allclose([e.maximum for e in found.each], [o.max() for o in expected])
        assert found.mean == pytest.approx(np.mean([own.mean() for own in expected]))
    whole = dynmesh.evaluate(COMPLETED, TRUTH)
    assert whole.frames == N - 1
    assert whole.mean == pytest.approx(apart[1:].mean())
    with pytest.raises(ValueError, match="input: is needed"):
        dynmesh.evaluate(bare, TRUTH, only="missing")
    with pytest.raises(ValueError, match="no vertex was missing in these frames"):
        dynmesh.evaluate(bare, TRUTH, only="missing", input=TRUTH)


def test_frames_of_a_longer_truth_are_found_by_their_numbers() -> None:
    for part, frames in ((slice(2, 5), slice(2, 5)), ([0, 3, 6], slice(3, 7, 3))):
        whole = dynmesh.evaluate(COMPLETED, TRUTH, frames=frames)
        found = dynmesh.evaluate(COMPLETED[part], TRUTH, only="missing", input=PARTIAL)
        missing = dynmesh.evaluate(COMPLETED, TRUTH, frames=frames, only="missing")
        assert dynmesh.evaluate(COMPLETED[part], TRUTH).each == whole.each
        assert (found.each, found.bounding_box_diagonal) == (
            missing.each,
            missing.bounding_box_diagonal,
        )
        assert "that have the numbers of the 3 of completed" in found.remarks[0]
        here = Heatmap(COMPLETED[part], reference=TRUTH, input=PARTIAL).frames(range(1, 2))
        there = Heatmap(COMPLETED, reference=TRUTH, input=PARTIAL).frames(range(3, 4))
        np.testing.assert_array_equal(next(here).values["error"], next(there).values["error"])
    with pytest.raises(ValueError, match="reference has 2, and none of the numbers 2, 3, 4, and 3"):
        dynmesh.evaluate(COMPLETED, TRUTH[:2])


def test_a_comparison_that_may_be_meant_otherwise_is_remarked() -> None:
    for ours, truth, told in (
        (COMPLETED, replace(TRUTH, start=3), "is number 0, and that of reference is 3"),
        (COMPLETED, replace(TRUTH, times=np.arange(float(N)) ** 2), "frame 2 from the first on"),
    ):
        (remark,) = dynmesh.evaluate(ours, truth).remarks
        assert told in remark
    assert dynmesh.evaluate(COMPLETED, TRUTH).remarks == ()


def test_nothing_is_said_of_frames_that_were_not_completed() -> None:
    report = dynmesh.complete(TRUTH[:1]).report
    assert (report.completed, report.remarks) == (0, ())


def test_arrays_hold_nan_where_nothing_is_known() -> None:
    for given, known in ((PARTIAL, KNOWN), (PARTIAL[3], KNOWN[3])):
        np.testing.assert_array_equal(np.isfinite(np.asarray(given)).all(axis=-1), known)
        with pytest.raises(ValueError, match="a copy is needed"):
            np.array(given, copy=False)
    assert np.shares_memory(np.array(TRUTH, copy=False), TRUTH.vertices)


def test_the_template_of_arrays_is_an_array_of_the_same_faces() -> None:
    arrays = np.where(KNOWN[..., None], TRUTH.vertices, np.nan)
    of_a_slice = dynmesh.complete(PARTIAL, template=TRUTH[:1])
    for completed in (
        dynmesh.complete(PARTIAL, template=TRUTH.vertices[:1]),
        dynmesh.complete(arrays, PARTIAL.faces, template=TRUTH.vertices[:1]),
    ):
        np.testing.assert_array_equal(completed.vertices, of_a_slice.vertices)
    with pytest.raises(TypeError, match=r"template: is a Frame.*\[:1\]"):
        dynmesh.complete(PARTIAL, template=TRUTH[0])  # type: ignore[arg-type]


@pytest.mark.parametrize("factor", [1.0, 0.0254, 1000.0])
def test_sizes_are_those_of_whole_meshes_however_few_vertices_were_observed(factor: float) -> None:
    truth = dynmesh.synth.walker(3)
    generation = np.full(truth.vertices.shape[:2], 3, np.int32)
    generation[:, 100:104] = 0
    completed = replace(
        truth, vertices=factor * truth.vertices, generation=generation, age=generation
    )
    if factor == 1:
        assert dynmesh.evaluate(completed, truth).maximum == 0
    else:
        with pytest.raises(ValueError, match="times as large as"):
            dynmesh.evaluate(completed, truth)
