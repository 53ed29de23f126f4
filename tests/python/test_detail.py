"""Method detail against its literal transcription, and its identities."""

import meshes
import numpy as np
import pytest
import reference
from meshes import Array, Mesh

import dynmesh


def bent(vertices: Array, amount: float) -> Array:
    """Rolled up about y, and moved."""
    angle = amount * vertices[:, 0]
    radius = 1 / amount + vertices[:, 2]
    x, z = radius * np.sin(angle), radius * np.cos(angle) - 1 / amount
    return np.stack([x + amount, vertices[:, 1], z], axis=1)


def slanted(n: int) -> Mesh:
    """A sheet whose triangles are far from Delaunay."""
    mesh = meshes.sheet(n)
    vertices = mesh.vertices.copy()
    vertices[:, 0] += 0.9 * vertices[:, 1]
    return Mesh(mesh.faces, vertices)


@pytest.mark.parametrize("share", [0.05, 0.3, 0.7])
@pytest.mark.parametrize("shape", ["sheet", "slanted", "two parts"])
def test_frames_equal_the_transcription(shape: str, share: float, rng: np.random.Generator) -> None:
    mesh = {
        "sheet": meshes.sheet(14),
        "slanted": slanted(14),
        "two parts": meshes.join(slanted(12), meshes.sheet(5, 30.0)),
    }[shape]
    k = len(mesh.vertices)
    completer = dynmesh.Completer(mesh.faces, mesh.vertices, method="detail", unseen="hold")
    expected = reference.Detail(mesh.faces, mesh.vertices)
    for n in range(1, 7):
        points = bent(mesh.vertices, 0.02 * n) + 0.02 * rng.normal(size=(k, 3))
        known = rng.random(k) < share
        if shape == "two parts" and n % 2 == 0:
            known[144:] = False  # unseen
        completed = completer.push(points, known)
        np.testing.assert_allclose(
            completed, expected.complete(points, known), rtol=0, atol=1e-6 * expected.h
        )
        assert completer.report.blend == pytest.approx(expected.blend, abs=1e-6)
