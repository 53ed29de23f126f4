"""What `dynmesh.evaluate` says of sequences that were chosen by mistake."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from commands import dynmesh_command as run

import dynmesh


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
