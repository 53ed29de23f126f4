"""Simulated losses and noise."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import meshes
import numpy as np
import pytest
from commands import dynmesh_command as run
from meshes import Array, Mesh
from reference import directed_edges, mean_edge
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

import dynmesh
from dynmesh import losses
from dynmesh.scans import open_scans


def hidden_patches(**settings: Any) -> Array:
    """Patches on a sheet of 900 vertices, (n, 900), True where hidden."""
    faces = meshes.sheet(30).faces
    arguments = {"n_frames": 100, "share": 0.3, "seed": 2, **settings}
    return ~np.stack(list(losses.patch_known(faces, n_vertices=900, **arguments)))


def test_a_patch_is_connected_compact_and_of_its_share() -> None:
    offsets, neighbours = dynmesh.topology.cells(meshes.sheet(30).faces, 900)
    beside = csr_array((np.ones(len(neighbours)), neighbours, offsets), (900, 900))
    for share in (0.0001, 0.1, 0.5, 0.9):
        hidden = hidden_patches(patches=1, share=share)
        assert not hidden[0].any()
        assert (hidden[1:].sum(axis=1) == max(1, round(share * 900))).all()
        assert all(connected_components(beside[p][:, p])[0] == 1 for p in hidden[1:])
    rows, columns = np.divmod(np.flatnonzero(hidden_patches(patches=1, share=0.1)[1]), 30)
    assert np.ptp(rows) < 20  # 90 vertices: a disc has a diameter of 11
    assert np.ptp(columns) < 20


@pytest.mark.parametrize(("patches", "share"), [(2, 0.3), (4, 0.3), (4, 0.7), (10, 0.2)])
def test_patches_hide_their_share_together(patches: int, share: float) -> None:
    hidden = hidden_patches(patches=patches, share=share, lifetime=1, n_frames=400)
    assert hidden[1:].mean() == pytest.approx(share, abs=0.03)


def test_a_patch_stays_for_its_lifetime_and_jumps() -> None:
    hidden = hidden_patches(patches=1, lifetime=15)
    jumps = 1 + np.flatnonzero((hidden[2:] != hidden[1:-1]).any(axis=1)) + 1
    assert jumps.tolist() == [16, 31, 46, 61, 76, 91]


def test_a_patch_keeps_to_its_component() -> None:
    two = meshes.join(meshes.sheet(3), meshes.sheet(20)).faces
    masks = list(losses.patch_known(two, 200, 409, 0.5, patches=1, lifetime=1))
    hidden = ~np.stack(masks)[1:]
    assert set(hidden.sum(axis=1).tolist()) == {9, 204}
    assert (hidden[:, :9].any(axis=1) != hidden[:, 9:].any(axis=1)).all()


def test_frames_are_lost_whole_and_at_random() -> None:
    masks = np.stack(list(losses.dropout(2001, 5, 0.2)))
    assert masks[0].all()
    assert (masks.all(axis=1) | ~masks.any(axis=1)).all()
    lost = ~masks[1:, 0]
    assert lost.mean() == pytest.approx(0.2, abs=0.03)
    assert (lost[1:] & lost[:-1]).mean() == pytest.approx(0.04, abs=0.015)


def frames_of(mesh: Mesh, n: int, dtype: Any = np.float64) -> Array:
    return np.stack([mesh.vertices + i for i in range(n)]).astype(dtype)


def test_noise_is_gaussian_and_in_mean_edges() -> None:
    mesh = meshes.sheet(40)
    truth = frames_of(mesh, 6)
    noisy = np.stack(list(losses.add_noise(truth, mesh.faces, 0.25)))
    np.testing.assert_array_equal(noisy[0], truth[0])
    h = mean_edge(directed_edges(mesh.faces), mesh.vertices)
    z = (noisy[1:] - truth[1:]) / (0.25 * h)  # 24000 numbers
    np.testing.assert_allclose(z.mean(axis=(0, 1)), 0, atol=0.05)
    np.testing.assert_allclose(z.std(axis=(0, 1)), 1, atol=0.04)
    assert (z**4).mean() == pytest.approx(3, abs=0.2)
    correlation = np.corrcoef(z.transpose(0, 2, 1).reshape(15, -1))
    assert np.abs(correlation - np.eye(15)).max() < 0.12
    silent = list(losses.add_noise(truth, mesh.faces, 0))
    np.testing.assert_array_equal(silent, truth)


def test_outliers_are_few_and_at_their_distance_in_all_directions() -> None:
    mesh = meshes.sheet(40)
    truth = frames_of(mesh, 11)
    frames = np.stack(list(losses.add_outliers(truth, mesh.faces, 0.05, distance=7.0)))
    np.testing.assert_array_equal(frames[0], truth[0])
    moved = (frames != truth).any(axis=2)
    assert (moved[1:].sum(axis=1) == 80).all()
    assert (moved[1] != moved[2]).any()
    offsets = (frames - truth)[moved] / mean_edge(directed_edges(mesh.faces), mesh.vertices)
    np.testing.assert_allclose(np.linalg.norm(offsets, axis=1), 7.0)
    np.testing.assert_allclose(offsets.mean(axis=0), 0, atol=0.6)
    np.testing.assert_allclose((offsets**2).mean(axis=0), 49 / 3, rtol=0.15)


SHEET = meshes.sheet(6)
CAMERA = losses.Camera((4.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))

SCANNED: Any = {"noise": 0.1, "missing": 0.2, "holes": 0.2, "outliers": 0.1}

RANDOM: list[Callable[[int, int], Iterator[Array]]] = [
    lambda n, seed: losses.random_known(n, 36, 0.3, seed=seed),
    lambda n, seed: losses.patch_known(SHEET.faces, n, 36, 0.3, seed=seed),
    lambda n, seed: losses.dropout(n, 36, 0.5, seed=seed),
    lambda n, seed: losses.add_noise(frames_of(SHEET, n), SHEET.faces, 0.1, seed=seed),
    lambda n, seed: losses.add_outliers(frames_of(SHEET, n), SHEET.faces, 0.2, seed=seed),
    lambda n, seed: (
        np.hstack([scan.points, np.asarray(scan.normals)])
        for scan in losses.scan_points(
            [SHEET.vertices] * n, SHEET.faces, 2, points=60, seed=seed, **SCANNED
        )
    ),
    lambda n, seed: (
        np.stack(scan.depth)
        for scan in losses.depth_images(
            [SHEET.vertices] * n, SHEET.faces, 2, width=20, height=15, seed=seed, **SCANNED
        )
    ),
]


@pytest.mark.parametrize("make", RANDOM)
def test_equal_seeds_give_equal_frames_however_many(make: Any) -> None:
    given = (40, 5), (40, 5), (7, 5), (40, 6)
    whole, again, shorter, other = (list(make(*one)) for one in given)
    assert len(whole) == 40
    for one, same in zip(whole + whole[:7], again + shorter, strict=True):
        np.testing.assert_array_equal(one, same)
    assert not all(np.array_equal(whole[1], frame) for frame in whole[2:])
    assert not all(map(np.array_equal, whole, other))


def test_frames_are_taken_one_at_a_time() -> None:
    taken: list[int] = []
    frames = frames_of(SHEET, 5)
    for make in (
        lambda stream: losses.add_noise(stream, SHEET.faces, 0.1),
        lambda stream: losses.add_outliers(stream, SHEET.faces, 0.1),
        lambda stream: losses.camera_known(stream, SHEET.faces, [CAMERA]),
    ):
        taken.clear()
        for i, _ in enumerate(make(taken.append(i) or frames[i] for i in range(5))):  # type: ignore[func-returns-value]
            assert taken == list(range(i + 1))


def test_random_masks_keep_their_share() -> None:
    masks = np.stack(list(dynmesh.losses.random_known(20, 1000, 0.3, seed=5)))
    assert masks[0].all()
    assert (masks[1:].sum(axis=1) == 300).all()
    assert 0.05 < (masks[1] & masks[2]).mean() < 0.13  # chosen independently: 0.09 on average


def test_what_was_not_observed_is_neither_known_nor_scanned(tmp_path: Path) -> None:
    """By a mask or by positions that are not finite."""
    source, truth = tmp_path / "in.npz", dynmesh.synth.ocean(3, grid=12)
    known = np.tile(np.arange(144) >= 72, (3, 1))
    known[0] = True
    for unknown in (np.nan, 9e3):
        points = np.where(known[..., None], truth.vertices, np.float32(unknown))
        mask = known if unknown == 9e3 else None
        dynmesh.write(source, replace(truth, vertices=points, known=mask))
        words = ("degrade", source, tmp_path / "out.npz", "--known", "0.5", "--overwrite")
        assert "25.0% of the vertices" in run(*words).stderr
    run("degrade", source, tmp_path / "scans", "--scan", "--points", "200")
    assert all(np.abs(scan.cloud).max() < 9 for scan in open_scans(tmp_path / "scans") if scan)
