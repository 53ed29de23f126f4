"""Standard errors in files: what is written, dropped, said and measured."""

import json
from dataclasses import replace
from pathlib import Path

import meshes
import numpy as np
import pytest
from commands import dynmesh_command as run

import dynmesh

N_FRAMES = 6


@pytest.fixture(scope="module")
def truth() -> dynmesh.Sequence:
    """A waving sheet, and a small one far away, which is lost after frame 0."""
    mesh = meshes.join(meshes.sheet(12), meshes.sheet(3, 40.0))
    frames = []
    for t in range(N_FRAMES):
        moved = mesh.vertices.copy()
        moved[:, 2] += np.sin(0.6 * moved[:, 0] + 0.5 * t) * np.cos(0.3 * moved[:, 1])
        frames.append(moved)
    return dynmesh.Sequence(np.stack(frames).astype(np.float32), mesh.faces, fps=25.0)


@pytest.fixture(scope="module")
def partial(truth: dynmesh.Sequence) -> dynmesh.Sequence:
    """The same with a third of the first sheet."""
    known = np.random.default_rng(3).random(truth.vertices.shape[:2]) < 0.35
    known[:, 144:] = False
    known[0] = True
    vertices = np.where(known[..., None], truth.vertices, np.float32(np.nan))
    return replace(truth, vertices=vertices, known=known)


@pytest.fixture(scope="module")
def completed(
    partial: dynmesh.Sequence, tmp_path_factory: pytest.TempPathFactory
) -> dynmesh.Sequence:
    """Completed with standard errors."""
    folder = tmp_path_factory.mktemp("completed")
    dynmesh.write(folder / "in.npz", partial)
    dynmesh.complete_file(folder / "in.npz", folder / "out.npz", provenance=True, uncertainty=True)
    return dynmesh.read(folder / "out.npz")


def test_uncertain_vertices_are_left_missing(
    tmp_path: Path, partial: dynmesh.Sequence, completed: dynmesh.Sequence
) -> None:
    bars = completed.standard_error
    assert bars is not None
    source, target = tmp_path / "in.npz", tmp_path / "out.npz"
    dynmesh.write(source, partial)
    limit = np.sort(bars[np.isfinite(bars) & (bars > 0)])[300]
    for drop_above in (limit, np.nextafter(limit, np.float32(0))):
        expected = bars <= drop_above
        report = dynmesh.complete_file(source, target, drop_above=float(drop_above), overwrite=True)
        found = dynmesh.read(target)
        np.testing.assert_array_equal(found.known, expected)
        np.testing.assert_array_equal(found.vertices[expected], completed.vertices[expected])
        assert np.isnan(found.vertices[~expected]).all()
        assert report.dropped == np.count_nonzero(~expected)
        assert any(f"{report.dropped} vertices were left" in line for line in report.lines())
        assert found.standard_error is None
        assert (bars[~expected] > drop_above).all()
    assert (bars == limit).any()
    told = run("complete", source, tmp_path / "shell.npz", "--drop-above", str(drop_above)).stderr
    np.testing.assert_array_equal(dynmesh.read(tmp_path / "shell.npz").known, found.known)
    assert f"{report.dropped} vertices were left missing" in told


def test_evaluate_compares_them_with_the_truth(
    tmp_path: Path, truth: dynmesh.Sequence, completed: dynmesh.Sequence
) -> None:
    stats = pytest.importorskip("scipy.stats")
    dynmesh.write(tmp_path / "truth.npz", truth)
    dynmesh.write(tmp_path / "out.npz", completed)
    told = run("evaluate", tmp_path / "out.npz", tmp_path / "truth.npz", "--json")
    found = json.loads(told.stdout)["standard_error"]
    bars, generation = completed.standard_error, completed.generation
    assert bars is not None
    assert generation is not None
    error = np.linalg.norm(completed.vertices.astype(float) - truth.vertices, axis=2)
    filled = (generation > 0) & np.isfinite(bars)
    ratio = error[filled] / bars[filled]
    assert found["vertices"] == filled.sum()
    assert found["coverage_50"] == pytest.approx((ratio <= 1.538).mean())
    assert found["coverage_90"] == pytest.approx((ratio <= 2.5).mean())
    mean_squares = (error[filled] ** 2).mean() / (3 * (bars[filled].astype(float) ** 2).mean())
    assert found["rms_ratio"] == pytest.approx(np.sqrt(mean_squares), rel=1e-5)
    for name, values in {"rank": bars, "generation": generation}.items():
        of_frames = [
            stats.spearmanr(error[n][filled[n]], values[n][filled[n]]).statistic
            for n in range(1, N_FRAMES)
            if np.ptp(values[n][filled[n]]) > 0  # in frame 1, all have the age 1
        ]
        assert found[f"{name}_correlation"] == pytest.approx(np.mean(of_frames), abs=1e-6)
    dynmesh.write(tmp_path / "bare.npz", replace(completed, standard_error=None))
    told = run("evaluate", tmp_path / "bare.npz", tmp_path / "truth.npz", "--json")
    assert json.loads(told.stdout)["standard_error"] is None


def surface_errors(completed: dynmesh.Sequence) -> dynmesh.Sequence:
    """The same with standard errors as a tracker has them."""
    assert completed.standard_error is not None
    return replace(completed, standard_error_of="surface")


def test_a_completion_of_a_tracked_sequence_says_what_its_own_errors_are_of(
    tmp_path: Path, completed: dynmesh.Sequence
) -> None:
    tracked, target = tmp_path / "tracked.npy", tmp_path / "target.npy"
    dynmesh.write(tracked, surface_errors(completed))
    for options in (["--uncertainty", "--provenance"], ["--provenance"]):
        dynmesh.write(target, surface_errors(completed))
        run("complete", tracked, target, *options, "--overwrite")
        assert dynmesh.read(target).standard_error_of == "position"
    dynmesh.write(target, surface_errors(completed))
    dynmesh.write(target, replace(completed, standard_error=None))
    assert not target.with_name("target.standard_error_of.npy").exists()
