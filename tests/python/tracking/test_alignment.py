"""The rigid alignment of a template with a scan, from which registration and tracking begin."""

import numpy as np
import pytest
from meshes import Array, Mesh, sheet
from scans_of_meshes import TORUS, scan_of
from scipy.spatial.transform import Rotation

import dynmesh
from dynmesh.topology import mean_edge_of

SCAN, _ = scan_of(TORUS, TORUS.vertices, 6000, np.random.default_rng(0))
AWAY = np.array([30.0, -14, 52])
ANGLES = [[0.4, 0.2, -0.3], [1.9, 1.2, 0.6], [-2.6, 2.9, 1.1], [0, 3.1, 2.2]]
TURNS = [Rotation.from_euler("zxz", angles) for angles in ANGLES]


def found_in(scan: Array, mesh: Mesh = TORUS) -> dynmesh.alignment.Alignment:
    return dynmesh.alignment.find_alignment(mesh.faces, mesh.vertices, scan)


def moved(found: dynmesh.alignment.Alignment, vertices: Array = TORUS.vertices) -> Array:
    return np.asarray(vertices @ found.rotation.T + found.shift)


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("side", ["whole", "one side"])
def test_a_template_that_was_moved_rigidly_is_found_again(turn: Rotation, side: str) -> None:
    scan = SCAN if side == "whole" else SCAN[SCAN[:, 1] > np.median(SCAN[:, 1])]
    found = found_in(turn.apply(scan) + AWAY)
    assert found.matches
    assert not found.lies_in_scan
    assert found.before > 5
    assert found.after < 0.3
    assert found.mean_edge == pytest.approx(mean_edge_of(TORUS.vertices, TORUS.faces), rel=0.05)
    off = np.abs(moved(found) - turn.apply(TORUS.vertices) - AWAY).max()
    assert off < 0.3 * found.mean_edge
    assert side != "whole" or found.ratio == pytest.approx(1, rel=0.1)


def test_a_template_that_lies_in_the_scan_stays() -> None:
    """Also in a scan of a part of it, or with more else than of it and some points far away."""
    found = found_in(SCAN)
    assert found.lies_in_scan
    assert found.matches
    assert found.after == found.before < 0.3
    np.testing.assert_array_equal(moved(found), TORUS.vertices)
    assert found_in(SCAN[np.argsort(SCAN[:, 0])[: len(SCAN) // 4]]).lies_in_scan
    others = [TURNS[1].apply(SCAN) + np.array([0, 0, height]) for height in (3, 6)]
    far = np.array([[1e6, 1e7 * i, -1e6] for i in range(20)])
    found = found_in(np.concatenate([SCAN, *others, far]))
    assert found.lies_in_scan
    assert not found.other_unit


def test_another_size_another_unit_and_another_shape() -> None:
    twice = found_in(2 * SCAN + AWAY)
    assert twice.ratio == pytest.approx(2, rel=0.1)
    assert not twice.other_unit
    assert not twice.lies_in_scan
    thousandth = found_in(1000 * SCAN)
    assert thousandth.ratio == pytest.approx(1000, rel=0.1)
    assert thousandth.other_unit
    assert not thousandth.matches
    assert thousandth.after == thousandth.before
    np.testing.assert_array_equal(moved(thousandth), TORUS.vertices)
    flat = found_in(TURNS[0].apply(sheet(40).vertices) + AWAY)
    assert not flat.other_unit
    assert not flat.matches
    assert not found_in(np.array([[1.0, 2, 3]])).matches
    dot = found_in(SCAN, Mesh(np.array([[0, 1, 2]]), np.tile([1.0, 2, 3], (3, 1))))
    assert not dot.matches
    assert np.isfinite(dot.rotation).all()
