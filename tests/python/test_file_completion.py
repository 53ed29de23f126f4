"""Completion from file to file."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from commands import dynmesh_command as run

import dynmesh
from dynmesh import complete_file


@pytest.fixture(scope="module")
def partial(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An ocean with missing vertices."""
    path = tmp_path_factory.mktemp("partial") / "partial.npz"
    ocean = dynmesh.synth.ocean(30, grid=20, seed=3)
    known = np.stack(list(dynmesh.degrade.random_known(30, 400, 0.3, seed=1)))
    dynmesh.write(path, dynmesh.Sequence(ocean.vertices, ocean.faces, known, fps=30.0))
    return path


def test_rejected_outliers_are_reported(tmp_path: Path, partial: Path) -> None:
    sequence = dynmesh.read(partial)
    assert sequence.known is not None
    astray = list(dynmesh.degrade.add_outliers(sequence.vertices, sequence.faces, 0.01))
    spoilt = tmp_path / "spoilt.npz"
    dynmesh.write(spoilt, replace(sequence, vertices=np.stack(astray)))
    completer = dynmesh.Completer(
        sequence.faces, sequence.vertices[0], method="detail", reject_outliers=True
    )
    rejected = 0
    for points, known in zip(astray[1:], sequence.known[1:], strict=True):
        completer.push(points, known)
        rejected += completer.report.rejected
    assert rejected > 0
    out = tmp_path / "out.npz"
    report = complete_file(spoilt, out, method="detail", reject_outliers=True)
    assert report.rejected == rejected
    assert complete_file(spoilt, tmp_path / "none.npz", method="detail").rejected == 0
    options = ("--method", "detail", "--reject-outliers", "--overwrite")
    shown = run("complete", spoilt, out, *options).stderr
    assert f"out.npz: {rejected} outliers rejected, " in shown
    assert "outliers rejected" not in run("complete", spoilt, out, "--overwrite").stderr


def test_the_report_of_a_file(tmp_path: Path, partial: Path) -> None:
    report = complete_file(partial, tmp_path / "out.npz")
    assert report.frames == 30
    assert report.seconds_per_frame is not None
    assert report.seconds_per_frame > 0
    sequence = dynmesh.read(partial)
    assert sequence.known is not None
    n_known = int(sequence.known[1:].sum())
    assert (report.known, report.filled, report.disconnected) == (n_known, 29 * 400 - n_known, 0)
