"""The methods of libigl, and comparisons without it."""

from typing import Any

import meshes
import numpy as np
import pytest

from benchmarks.methods import Arap, Harmonic


def baselines(mesh: meshes.Mesh) -> dict[str, Any]:
    pytest.importorskip("igl", reason="libigl is not installed")
    faces, first = mesh.faces, mesh.vertices
    return {
        "harmonic": Harmonic(faces, first, order=1),
        "biharmonic": Harmonic(faces, first, order=2),
        "arap": Arap(faces, first, rest="first"),
        "arap from previous": Arap(faces, first, rest="previous"),
    }


def test_known_vertices_stay_as_given_and_the_rest_is_not_read(rng: np.random.Generator) -> None:
    mesh = meshes.sheet(8)
    for name, baseline in baselines(mesh).items():
        close = 0.2 if "arap" in name else 1e-9  # libigl stops ARAP after ten iterations
        for n in (1, 2):
            known = rng.random(len(mesh.vertices)) < 0.4
            moved = mesh.vertices + np.array([n, 0, 0])
            points = np.where(known[:, None], moved, np.nan)
            completed = baseline.complete(points, known)
            np.testing.assert_array_equal(completed[known], points[known], err_msg=name)
            np.testing.assert_allclose(completed, moved, atol=close, err_msg=name)


def test_each_libigl_method_meets_its_definition(rng: np.random.Generator) -> None:
    mesh = meshes.sheet(9)
    known = rng.random(81) < 0.2
    turned = np.stack([meshes.turned(mesh.vertices, 0.1 * n) for n in range(4)])
    errors = {}
    for name, baseline in baselines(mesh).items():
        for frame in turned[1:]:
            completed = baseline.complete(frame, known)
        errors[name] = np.abs(completed - turned[-1]).max()
    assert max(errors["arap"], errors["arap from previous"]) < 0.1  # rotations are rigid
    assert min(errors["harmonic"], errors["biharmonic"]) > 0.3

    # Linear motion of a flat sheet is harmonic if the border is known; k = 1 and k = 2 differ.
    flat = meshes.Mesh(mesh.faces, mesh.vertices * [1, 1, 0])
    x, y = flat.vertices[:, 0], flat.vertices[:, 1]
    border = (x == x.min()) | (x == x.max()) | (y == y.min()) | (y == y.max())
    sheared = flat.vertices + np.stack([0.1 * y, 0 * x, 0.2 * x], axis=1)
    bowed = flat.vertices + np.stack([0 * x, 0 * x, (x - x.mean()) ** 2], axis=1)
    two_rings = border | (x == np.unique(x)[1]) | (x == np.unique(x)[-2])
    two_rings |= (y == np.unique(y)[1]) | (y == np.unique(y)[-2])
    harmonic, biharmonic, *_ = baselines(flat).values()
    np.testing.assert_allclose(harmonic.complete(sheared, border), sheared, atol=1e-9)
    np.testing.assert_allclose(biharmonic.complete(sheared, two_rings), sheared, atol=1e-9)
    harmonic, biharmonic, *_ = baselines(flat).values()
    assert np.abs(harmonic.complete(bowed, two_rings) - bowed).max() > 0.01
    np.testing.assert_allclose(biharmonic.complete(bowed, two_rings), bowed, atol=1e-9)
