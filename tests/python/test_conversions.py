"""The documented conversions to and from other libraries keep every vertex."""

from typing import Any

import numpy as np
import pytest
from conftest import REPOSITORY
from test_documents import blocks

import dynmesh

for library in ("meshio", "pyvista", "trimesh"):
    pytest.importorskip(library)

GUIDE = (REPOSITORY / "docs" / "guides" / "research.md").read_text()


@pytest.fixture
def awkward(rng: np.random.Generator) -> dynmesh.Sequence:
    """Vertices at one place or in no face, and faces that are degenerate or given twice."""
    vertices = rng.normal(size=(8, 9, 3))
    vertices[:, 4] = vertices[:, 1]
    faces = np.array([[5, 6, 7], [7, 6, 1], [4, 2, 3], [4, 2, 3], [2, 2, 3], [0, 1, 4]])
    return dynmesh.Sequence(vertices, faces)


def test_conversions_keep_every_vertex(awkward: dynmesh.Sequence) -> None:
    (lines,) = (block for block in blocks("python", GUIDE) if "import meshio" in block)
    names: dict[str, Any] = {"sea": awkward, "faces": awkward.faces, "np": np, "dynmesh": dynmesh}
    imports, *conversions, sequence = lines.split("\n\n")
    exec(imports, names)
    assert len(conversions) == 3
    for conversion in conversions:
        exec(conversion, names)
        np.testing.assert_array_equal(names.pop("points"), awkward[7])
        np.testing.assert_array_equal(names.pop("triangles"), awkward.faces)
    exec(sequence, names)
    np.testing.assert_array_equal(names["whole"].vertices, awkward.vertices)
    np.testing.assert_array_equal(names["whole"].faces, awkward.faces)
