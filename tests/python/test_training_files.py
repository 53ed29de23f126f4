"""Files, scenes and tables of jobs completed with frames from which method detail learns."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import sheet
from test_file_start import expected_of
from test_training import poses

import dynmesh
from dynmesh.completion import training as training_module

pytestmark = pytest.mark.usefixtures("partial")  # which stores it

WHOLE = 4
REST = sheet(10)


def training_of(n: int, seed: int) -> dynmesh.Sequence:
    return dynmesh.Sequence(poses(REST.vertices, n, np.random.default_rng(seed)), REST.faces)


@pytest.fixture
def partial(tmp_path: Path) -> dynmesh.Sequence:
    """A sequence of which frames 0 and 4 are whole, stored as partial.npz."""
    known = np.random.default_rng(2).random((9, 100)) < 0.4
    known[[0, WHOLE]] = True
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
    report = dynmesh.complete_file(
        tmp_path / "partial.npz", tmp_path / "out.npz", start=WHOLE, training=recordings
    )
    both = np.concatenate([dynmesh.read(training).vertices for training in recordings])
    expected = expected_of(partial, WHOLE, training=both).vertices
    made = dynmesh.read(tmp_path / "out.npz").vertices
    np.testing.assert_array_equal(made, expected)
    assert np.abs(made - expected_of(partial, WHOLE).vertices).max() > 0.01
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
        dynmesh.complete_file(stage, made, source={"prim": mesh}, training=pair)
        training = tmp_path / f"training{seed}.usda"  # whose only mesh has another path
        dynmesh.complete_file(stage, expected, source={"prim": mesh}, training=training)
        np.testing.assert_array_equal(dynmesh.read(made).vertices, dynmesh.read(expected).vertices)
