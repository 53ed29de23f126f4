"""Standard errors of method detail, and what is made of them."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import error_bars_reference
import meshes
import numpy as np
import pytest
import to_file
from bending_sheet import travelling
from commands import dynmesh_command as run

import dynmesh
from dynmesh.verbs.evaluate import Calibrating


@pytest.mark.parametrize("noise", [None, 0.05])
@pytest.mark.parametrize("in_bursts", [False, True])
def test_they_equal_the_transcription(
    noise: float | None, in_bursts: bool, rng: np.random.Generator
) -> None:
    mesh = meshes.join(meshes.sheet(8), meshes.sheet(4, 30.0))
    k = len(mesh.vertices)
    frames = np.stack([1.02**n * meshes.turned(travelling(mesh, n), 0.05 * n) for n in range(12)])
    if in_bursts:  # then the largest scale is that of recent frames
        size = np.where(np.arange(12) // 2 == 3, 1.0, 0.01)[:, None, None]
        frames = mesh.vertices + size * (frames - mesh.vertices)
    completer = dynmesh.Completer(
        mesh.faces, mesh.vertices, method="detail", uncertainty=True, noise=noise
    )
    without = dynmesh.Completer(mesh.faces, mesh.vertices, noise=noise)
    expected = error_bars_reference.WithBars(mesh.faces, mesh.vertices, noise)
    for n, points in enumerate(frames[1:], 1):
        known = rng.random(k) < 0.4
        if n % 3:
            known[20:60] = True  # so that some cells are known in two frames
        if n > 6:
            known[64:] = False  # disconnected
        if n == 4:
            known[:] = True
        if n == 5:
            known[:] = False
        completed = completer.push(points, known)
        np.testing.assert_array_equal(completed, without.push(points, known))
        expected.complete(points, known)
        seen = np.isfinite(expected.standard_error)
        np.testing.assert_array_equal(np.isfinite(completer.standard_error), seen)
        np.testing.assert_allclose(
            completer.standard_error[seen], expected.standard_error[seen], rtol=1e-4, atol=1e-9
        )


def test_a_walk_at_random_is_covered_as_promised(rng: np.random.Generator) -> None:
    mesh = meshes.sheet(20)
    k = len(mesh.vertices)
    steps = rng.normal(size=(40, 20, 20, 3))
    for axis in (1, 2) * 8:  # smooth over the sheet
        steps = (np.roll(steps, 1, axis) + 2 * steps + np.roll(steps, -1, axis)) / 4
    frames = mesh.vertices + 0.1 * steps.reshape(40, k, 3).cumsum(axis=0)
    completer = dynmesh.Completer(mesh.faces, frames[0], method="detail", uncertainty=True)
    calibrating = Calibrating()
    for points in frames[1:]:
        completed = completer.push(points, rng.random(k) < 0.3)
        calibrating.add(
            np.linalg.norm(completed - points, axis=1),
            completer.standard_error,
            filled=completer.generation > 0,
        )
    found: Any = calibrating.result()
    assert 0.35 < found.coverage_50 < 0.8  # long tails
    assert 0.8 < found.coverage_90 < 0.98
    assert 0.7 < found.rms_ratio < 1.4


N_FRAMES = 6
MESH = meshes.join(meshes.sheet(12), meshes.sheet(3, 40.0))
TIME = 0.5 * np.arange(N_FRAMES)[:, None]
X, Y, _ = MESH.vertices.T
WAVE = np.sin(0.6 * X + TIME) * np.cos(0.3 * Y)
TRUTH = dynmesh.Sequence(
    (MESH.vertices + WAVE[..., None] * [0, 0, 1]).astype(np.float32), MESH.faces, fps=25.0
)
"""A waving sheet, and a small one far away, which is lost after frame 0."""
KNOWN = np.random.default_rng(3).random(TRUTH.vertices.shape[:2]) < 0.35
KNOWN[:, 144:] = False
KNOWN[0] = True
HOLES = np.where(KNOWN[..., None], TRUTH.vertices, np.float32(np.nan))
PARTIAL = replace(TRUTH, vertices=HOLES, known=KNOWN)
COMPLETED = dynmesh.read(dynmesh.complete(PARTIAL, uncertainty=True))
BARS: Any = COMPLETED.standard_error
GENERATION: Any = COMPLETED.generation


def test_uncertain_vertices_are_left_missing(tmp_path: Path) -> None:
    source, target = tmp_path / "in.npz", tmp_path / "out.npz"
    dynmesh.write(source, PARTIAL)
    limit = np.sort(BARS[np.isfinite(BARS) & (BARS > 0)])[300]
    for drop_above in (limit, np.nextafter(limit, np.float32(0))):
        expected = drop_above >= BARS
        report = to_file.complete(source, target, drop_above=float(drop_above), overwrite=True)
        found = dynmesh.read(target)
        np.testing.assert_array_equal(found.known, expected)
        np.testing.assert_array_equal(found.vertices[expected], COMPLETED.vertices[expected])
        assert np.isnan(found.vertices[~expected]).all()
        assert report.dropped == np.count_nonzero(~expected)
        assert any(f"{report.dropped} vertices left" in line for line in report.lines())
        assert found.standard_error is None
        assert (BARS[~expected] > drop_above).all()
    assert (limit == BARS).any()
    told = run("complete", source, tmp_path / "shell.npz", "--drop-above", str(drop_above)).stderr
    np.testing.assert_array_equal(dynmesh.read(tmp_path / "shell.npz").known, found.known)
    assert f"{report.dropped} vertices left missing" in told


@pytest.mark.parametrize("bidirectional", [False, True])
def test_a_vertex_of_a_frame_counts_once(bidirectional: bool, tmp_path: Path) -> None:
    source, target = tmp_path / "in.npz", tmp_path / "out.npz"
    dynmesh.write(source, PARTIAL)
    report = to_file.complete(source, target, drop_above=1e-9, bidirectional=bidirectional)
    missing = np.count_nonzero(~KNOWN)
    assert (report.completed, report.known) == (len(KNOWN) - 1, KNOWN[1:].sum())
    assert report.filled + report.disconnected == report.dropped == missing


def test_evaluate_compares_them_with_the_truth(tmp_path: Path) -> None:
    dynmesh.write(tmp_path / "truth.npz", TRUTH)
    dynmesh.write(tmp_path / "out.npz", COMPLETED)
    told = run("evaluate", tmp_path / "out.npz", tmp_path / "truth.npz", "--json")
    found = json.loads(told.stdout)["calibration"]
    error = np.linalg.norm(COMPLETED.vertices.astype(float) - TRUTH.vertices, axis=2)
    filled = (GENERATION > 0) & np.isfinite(BARS)
    ratio = error[filled] / BARS[filled]
    assert found["vertices"] == filled.sum()
    assert found["coverage_50"] == pytest.approx((ratio <= 1.538).mean())
    assert found["coverage_90"] == pytest.approx((ratio <= 2.5).mean())
    mean_squares = (error[filled] ** 2).mean() / (3 * (BARS[filled].astype(float) ** 2).mean())
    assert found["rms_ratio"] == pytest.approx(np.sqrt(mean_squares), rel=1e-5)
    dynmesh.write(tmp_path / "bare.npz", replace(COMPLETED, standard_error=None))
    told = run("evaluate", tmp_path / "bare.npz", tmp_path / "truth.npz", "--json")
    assert json.loads(told.stdout)["calibration"] is None


def test_a_completion_of_a_tracked_sequence_says_what_its_own_errors_are_of(tmp_path: Path) -> None:
    tracked, target = tmp_path / "tracked.npy", tmp_path / "target.npy"
    as_tracked = replace(COMPLETED, standard_error_of="surface")
    dynmesh.write(tracked, as_tracked)
    for options in (["--uncertainty"], ["--provenance"]):
        dynmesh.write(target, as_tracked)
        run("complete", tracked, target, *options, "--overwrite")
        assert dynmesh.read(target).standard_error_of == "position"
    dynmesh.write(target, as_tracked)
    dynmesh.write(target, replace(COMPLETED, standard_error=None))
    assert not target.with_name("target.standard_error_of.npy").exists()
