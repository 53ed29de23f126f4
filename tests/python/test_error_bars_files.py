"""Standard errors in files: what is written, dropped, said and measured."""

import json
import re
from dataclasses import replace
from pathlib import Path

import meshes
import numpy as np
import pytest
from commands import dynmesh_command as run
from meshes import Array

import dynmesh
from dynmesh.calibration import Distances, in_words

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


def within_90(standard_error: Array) -> float:
    """The length that 90 % of errors with these standard errors of coordinates do not exceed."""
    stats, optimize = pytest.importorskip("scipy.stats"), pytest.importorskip("scipy.optimize")
    finite = standard_error[np.isfinite(standard_error)].astype(float)
    bars = finite[finite > 0]

    def missing(length: float) -> float:
        within = len(finite) - len(bars) + stats.chi(3).cdf(length / bars).sum()
        return float(within / len(finite) - 0.9)

    return float(optimize.brentq(missing, 1e-6, 100 * bars.max()))


@pytest.mark.parametrize("metres", [None, 0.01])
def test_how_far_90_percent_are_is_a_quantile(
    completed: dynmesh.Sequence, metres: float | None
) -> None:
    assert completed.standard_error is not None
    assert completed.generation is not None
    expected = within_90(completed.standard_error[completed.generation > 0])
    distances = Distances()
    for bars, generation in zip(completed.standard_error, completed.generation, strict=True):
        distances.add(bars, generation > 0)
    found = distances.within(0.9)
    assert found == pytest.approx(expected, rel=0.02)
    told = in_words(found, metres)
    assert told is not None
    said = re.search(r"90 % of the filled-in vertices are expected to be within (\S+)", told)
    assert said is not None
    unit, factor = ("in the unit", 1.0) if metres is None else ("mm", 1000 * metres)
    assert float(said[1].rstrip(",")) == pytest.approx(factor * expected, rel=0.08)
    assert unit in told[said.end() :]


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


def test_evaluate_measures_errors_of_the_surface_from_it(tmp_path: Path) -> None:
    """Vertices of a plane that slid within it are on the surface, and one above it is not."""
    mesh = meshes.sheet(8)
    k = len(mesh.vertices)
    flat = mesh.vertices * [1.0, 1.0, 0.0]
    truth = dynmesh.Sequence(np.stack([flat] * 3), mesh.faces)
    rng = np.random.default_rng(2)
    bars = rng.uniform(0.5, 1.0, (3, k)).astype(np.float32)
    off = rng.normal(size=(3, k)) * bars
    slid = truth.vertices + np.stack([3.0 + 0 * off, 0.4 + 0 * off, off], axis=2)
    tracked = dynmesh.Sequence(
        slid,
        mesh.faces,
        generation=np.zeros((3, k), np.int32),
        age=np.zeros((3, k), np.int32),
        standard_error=bars,
        standard_error_of="surface",
    )
    dynmesh.write(tmp_path / "truth.npz", truth)
    dynmesh.write(tmp_path / "tracked.npz", tracked)
    words = ("evaluate", tmp_path / "tracked.npz", tmp_path / "truth.npz")
    found = json.loads(run(*words, "--json").stdout)["standard_error"]
    ratio = np.abs(off[1:]) / bars[1:]
    assert found["standard_error_of"] == "surface"
    assert found["vertices"] == 2 * k  # although all of them were seen
    assert found["coverage_50"] == pytest.approx((ratio <= 0.674).mean())
    assert found["coverage_90"] == pytest.approx((ratio <= 1.645).mean())
    squares = (off[1:] ** 2).mean() / (bars[1:].astype(float) ** 2).mean()
    assert found["rms_ratio"] == pytest.approx(np.sqrt(squares), rel=1e-5)
    assert "distances from the true surface" in run(*words).stdout
