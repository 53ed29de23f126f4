"""Sequences in memory are completed, measured and shown as files are."""

import csv
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import dynmesh_command as run
from sequences import sea

import dynmesh
from dynmesh.sequence import StandardErrorOf

N = 8


TRUTH = sea(N)
PARTIAL = sea(N, share=0.6, fps=25.0, up_axis="z")
"""No frame of it is whole."""
KNOWN: Any = PARTIAL.known
COMPLETED = dynmesh.complete(PARTIAL, start=0, method="motion")


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"method": "motion"},
        {"start": 3, "uncertainty": True},
        {"bidirectional": True},
        {"bidirectional": True, "training": True},
        {"start": "best", "drop_above": 0.2},
    ],
    ids=str,
)
def test_a_sequence_is_completed_as_its_file_is(tmp_path: Path, options: dict[str, Any]) -> None:
    training = options.get("training")
    given = dict(options) | ({"training": TRUTH.vertices[2:6]} if training else {})
    made = dynmesh.complete(PARTIAL, **given)
    dynmesh.write(tmp_path / "partial.npz", PARTIAL)
    dynmesh.write(tmp_path / "training.npz", TRUTH[2:6])
    of_file = dict(options) | ({"training": tmp_path / "training.npz"} if training else {})
    output = tmp_path / "out.npz"
    dynmesh.complete_file(tmp_path / "partial.npz", output, provenance=True, **of_file)
    expected = dynmesh.read(output)
    assert made.described() == expected.described()
    np.testing.assert_array_equal(made.vertices, expected.vertices)
    assert made.attributes().keys() == expected.attributes().keys()
    for name, values in made.attributes().items():
        np.testing.assert_array_equal(values, expected.attributes()[name], err_msg=name)


def distances(completed: dynmesh.Sequence, truth: dynmesh.Sequence) -> Any:
    """In bounding-box diagonals of frame 0."""
    diagonal = np.linalg.norm(np.ptp(truth.vertices[0].astype(np.float64), axis=0))
    apart = completed.vertices.astype(np.float64) - truth.vertices.astype(np.float64)
    return np.linalg.norm(apart, axis=-1) / diagonal


def test_errors_by_frame_of_missing_vertices_alone(tmp_path: Path) -> None:
    """From the generations, from the partial sequence, and in the shell."""
    apart = distances(COMPLETED, TRUTH)
    frames = range(2, 7, 2)
    expected = [apart[t][~KNOWN[t]] for t in frames]
    bare = replace(COMPLETED, generation=None, age=None)
    for made, more in ((COMPLETED, {}), (bare, {"partial": PARTIAL})):
        found = dynmesh.evaluate(made, TRUTH, frames=frames, only="missing", **more)  # type: ignore[arg-type]
        assert [each.frame for each in found.each] == [2, 4, 6]
        assert [each.vertices for each in found.each] == [len(own) for own in expected]
        np.testing.assert_allclose([e.mean for e in found.each], [o.mean() for o in expected])
        np.testing.assert_allclose([e.maximum for e in found.each], [o.max() for o in expected])
        assert found.mean == pytest.approx(np.mean([own.mean() for own in expected]))
    whole = dynmesh.evaluate(COMPLETED, TRUTH)
    assert whole.frames == N - 1
    assert whole.mean == pytest.approx(apart[1:].mean())
    with pytest.raises(ValueError, match="partial: is needed"):
        dynmesh.evaluate(bare, TRUTH, only="missing")
    for name, sequence in (("bare", bare), ("truth", TRUTH), ("partial", PARTIAL)):
        dynmesh.write(tmp_path / f"{name}.npz", sequence)
    paths = [tmp_path / f"{name}.npz" for name in ("bare", "truth")]
    options = ("--only", "missing", "--input", tmp_path / "partial.npz", "--frames", "2:5")
    table = tmp_path / "errors.csv"
    said = json.loads(run("evaluate", *paths, *options, "--csv", table, "--json").stdout)
    with table.open() as file:
        rows = list(csv.DictReader(file))
    assert [int(row["frame"]) for row in rows] == [2, 3, 4]
    means = [apart[t][~KNOWN[t]].mean() for t in (2, 3, 4)]
    np.testing.assert_allclose([float(row["mean"]) for row in rows], means)
    assert said["summary"]["mean"] == pytest.approx(np.mean(means))
    run("evaluate", *paths, "--csv", table, code=1)  # it exists


def test_pages_and_pictures_are_those_of_the_file(tmp_path: Path) -> None:
    pytest.importorskip("k3d")
    dynmesh.write(tmp_path / "completed.npz", COMPLETED)
    dynmesh.write(tmp_path / "truth.npz", TRUTH)
    made = dynmesh.view(COMPLETED, tmp_path / "page.html", reference=TRUTH, max_frames=3)
    assert (tmp_path / "page.html").read_text() == made.html
    assert made.shown.frames == 3
    assert '"sequence": "sequence", "reference": "the reference"' in made.html
    with pytest.raises(FileExistsError):
        dynmesh.view(COMPLETED, tmp_path / "page.html")
    drawn = dynmesh.picture(COMPLETED, tmp_path / "a.png", frames=3, reference=TRUTH, title="A")
    own, reference = tmp_path / "completed.npz", tmp_path / "truth.npz"
    words = ("--reference", reference, "--frame", "3", "--title", "A", "-o", tmp_path / "b.png")
    run("picture", own, *words)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert drawn.size[0] > 480
    with pytest.raises(ValueError, match="frame 99"):
        dynmesh.picture(COMPLETED, frames=99)


@pytest.mark.parametrize("kind", ["position", "surface"])
def test_a_sequence_is_described_as_its_file_is(tmp_path: Path, kind: StandardErrorOf) -> None:
    sequence = replace(PARTIAL, standard_error_of=kind)
    dynmesh.write(tmp_path / "partial.npz", sequence)
    assert dynmesh.info(sequence).as_dict() == dynmesh.info(tmp_path / "partial.npz").as_dict()


@pytest.fixture
def ocean() -> dynmesh.Sequence:
    return dynmesh.synth.ocean(6, grid=10)


@pytest.mark.parametrize(
    ("factor", "units"),
    [
        (1000, "mm and the reference in m"),
        (0.1, "cm and the reference in mm"),
        (1 / 25.4, "inch and the reference in mm"),
        (1.02, None),
    ],
)
def test_another_unit_is_named(ocean: dynmesh.Sequence, factor: float, units: str | None) -> None:
    other = replace(ocean, vertices=np.float32(factor) * ocean.vertices)
    told = dynmesh.evaluate(other, ocean).remarks
    assert len(told) == (units is not None)
    assert all(f"as if it were in {units}" in remark for remark in told)


def test_exchanged_arguments_are_told(ocean: dynmesh.Sequence, tmp_path: Path) -> None:
    known = np.stack(list(dynmesh.degrade.random_known(6, 100, 0.5)))
    completed = dynmesh.complete(replace(ocean, known=known))
    dynmesh.write(tmp_path / "completed.npz", completed)
    dynmesh.write(tmp_path / "truth.npz", ocean)
    files = tmp_path / "completed.npz", tmp_path / "truth.npz"
    assert "exchanged" not in run("evaluate", *files).stdout
    assert (
        "were they exchanged? The completed one comes first" in run("evaluate", *files[::-1]).stdout
    )


def test_zeros_may_tell_what_was_missing(ocean: dynmesh.Sequence) -> None:
    known = np.stack(list(dynmesh.degrade.random_known(6, 100, 0.5)))
    zeros = np.where(known[..., None], ocean.vertices + 1, 0)
    truth = replace(ocean, vertices=ocean.vertices + 1)
    off = replace(truth, vertices=truth.vertices + np.where(known[..., None], 0, 0.5))
    told = dynmesh.evaluate(off, truth, only="missing", partial=replace(truth, vertices=zeros))
    distance = told.mean * told.bounding_box_diagonal
    assert distance == pytest.approx(0.5 * np.sqrt(3), rel=1e-3)
