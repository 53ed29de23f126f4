"""Pages and pictures have one scale, and sequences show themselves in notebooks."""

from dataclasses import replace
from html import unescape
from typing import Any

import numpy as np
import pytest
from meshes import Array, sheet
from test_missing_extras import hide

import dynmesh
from dynmesh.draw import notebook
from dynmesh.draw.heatmap import Heatmap
from dynmesh.draw.scales import MOST_FRAMES, Scale

pytest.importorskip("pyvista", reason="pictures need pyvista: pip install 'dynmesh[view]'")


@pytest.fixture
def moving() -> dynmesh.Sequence:
    """A sheet that moves along x; of later frames, the vertices beyond x = 5.5 were filled in."""
    mesh = sheet(12)
    vertices = np.stack([mesh.vertices + np.array([i, 0, 0]) for i in range(5)])
    generation = np.zeros(vertices.shape[:2], np.int32)
    generation[1:, mesh.vertices[:, 0] > 5.5] = 2
    return dynmesh.Sequence(vertices, mesh.faces, fps=10.0, generation=generation, age=generation)


def html_of(shown: Any) -> str:
    """What a notebook shows of an object."""
    return str(shown._repr_html_())


def in_colour(picture: Array) -> Array:
    """Which pixels are not white."""
    return np.asarray((picture < 240).any(axis=2))


@pytest.mark.parametrize("colour", ["error", "generation"])
def test_pages_and_pictures_of_a_sequence_have_one_scale(
    monkeypatch: pytest.MonkeyPatch, colour: Any
) -> None:
    """Whichever frames they show, and however few vertices."""
    mesh, n_frames = sheet(4), 2 * MOST_FRAMES + 10
    truth = dynmesh.Sequence(np.stack([mesh.vertices] * n_frames), mesh.faces)
    off = np.arange(n_frames)[:, None, None] * mesh.vertices / 1000
    counts = np.minimum(np.arange(n_frames)[:, None], np.arange(16)).astype(np.int32)
    own = replace(truth, vertices=truth.vertices + off, generation=counts, age=counts)
    found: list[Any] = []
    usual = Heatmap.scale

    def noted(heatmap: Heatmap, name: Any) -> Scale | None:
        scale = usual(heatmap, name)
        if scale is not None and name == colour:
            found.append([(tick.position, tick.label) for tick in scale.ticks])
        return scale

    monkeypatch.setattr(Heatmap, "scale", noted)
    options: dict[str, Any] = {"colour": colour, "reference": truth if colour == "error" else None}
    dynmesh.view(own, **options)
    dynmesh.view(own, max_frames=3, max_vertices=8, **options)
    dynmesh.picture(own, frames=2, size=32, **options)
    dynmesh.picture(own, frames=[1, 3], size=32, **options)
    assert len(found) == 4
    assert all(ticks == found[0] for ticks in found)
    assert found[0][-1][1] == {"error": "50 % or more", "generation": "9 or more"}[colour]


def size_of(html: str) -> int:
    return len(html.encode())


def test_every_second_frame_is_played_at_half_the_rate(moving: dynmesh.Sequence) -> None:
    assert '"fps": 10.0' in unescape(html_of(moving))
    assert '"fps": 5.0' in unescape(html_of(moving[::2]))


def test_long_sequences_of_large_meshes_stay_small(rng: np.random.Generator) -> None:
    mesh = sheet(80)
    noise = rng.normal(0, 0.1, (40, *mesh.vertices.shape))
    html = html_of(dynmesh.Sequence(mesh.vertices + noise, mesh.faces))
    assert "<iframe" in html
    assert size_of(html) < notebook.LARGEST_PLAYER + 1000


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"vertices": np.empty((0, 4, 3))}, "has no frames"),
        ({"vertices": np.empty((2, 0, 3)), "faces": np.empty((0, 3), int)}, "no vertex is known"),
        ({"known": np.zeros((2, 4), bool)}, "no vertex is known"),
        ({"vertices": np.zeros((1, notebook.LARGEST_MESH + 1, 3))}, "takes long"),
    ],
)
def test_every_sequence_is_shown_as_a_table(change: dict[str, Any], reason: str) -> None:
    least: dict[str, Any] = {"vertices": np.zeros((2, 4, 3)), "faces": np.array([[0, 1, 2]])}
    html = html_of(dynmesh.Sequence(**least | change))
    assert "<iframe" not in html
    assert reason in html
    assert size_of(html) < 1000


def test_a_player_that_is_too_large_is_left_out(
    moving: dynmesh.Sequence, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(notebook, "LARGEST_PLAYER", 100_000)
    html = html_of(moving)
    assert "cannot be simplified enough" in html
    assert size_of(html) < 1000


def test_without_the_extra_a_sequence_is_a_table(
    moving: dynmesh.Sequence, monkeypatch: pytest.MonkeyPatch
) -> None:
    hide(monkeypatch, "k3d")
    html = html_of(moving)
    assert "this needs k3d: pip install &#x27;dynmesh[view]&#x27;" in html
    assert "144 vertices, 242 faces" in html
    assert size_of(html) < 1000
