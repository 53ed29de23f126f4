"""The built-in sequences and masks."""

import numpy as np
import pytest
from reference import directed_edges

import dynmesh


def test_the_walker_is_a_closed_figure_in_every_frame() -> None:
    seed, n_frames = 1, 25
    walker = dynmesh.synth.walker(n_frames, seed=seed)
    assert walker.vertices.shape == (n_frames, 10002, 3)
    assert walker.vertices.dtype == np.float32
    assert walker.faces.shape == (20000, 3)
    i, _ = directed_edges(walker.faces.astype(np.int64))
    assert 10002 - len(i) // 2 + 20000 == 2  # genus 0
    topology = dynmesh.Completer(walker.faces, walker.vertices[0]).topology
    assert (topology.components, topology.boundary_edges) == (1, 0)
    assert topology.refused_faces == []

    a, b, c = (
        walker.vertices[:, walker.faces[:, corner]].astype(np.float64) for corner in range(3)
    )
    volume = np.einsum("nfc,nfc->n", a, np.cross(b, c)) / 6
    assert volume.min() > 0.9 * volume[0] > 0  # oriented outward, and nothing collapses
    edge = np.linalg.norm(b - a, axis=2)
    assert edge.min() > 0.1 * edge[0].mean()
    assert edge.max() < 6 * edge[0].mean()
    motion = np.linalg.norm(np.diff(walker.vertices, axis=0), axis=2).mean()
    assert 0.5 < motion / edge[0].mean() * n_frames / 175 < 3  # the motion is spread over them
    assert walker.vertices[..., 2].min() > -0.05  # on the floor
    head = walker.vertices[0, :, 2].argmax()
    assert walker.vertices[:, head, 2].min() < 0.6  # upside down in some frame


@pytest.mark.parametrize("seed", [0, 1])
def test_the_ocean_is_a_sheet_that_never_folds(seed: int) -> None:
    ocean = dynmesh.synth.ocean(300, seed=seed)
    assert ocean.vertices.shape == (300, 2500, 3)
    assert ocean.faces.shape == (4802, 3)
    assert dynmesh.Completer(ocean.faces, ocean.vertices[0]).topology.boundary_edges == 4 * 49
    a, b, c = (ocean.vertices[:, ocean.faces[:, corner], :2] for corner in range(3))
    area = (b - a)[..., 0] * (c - a)[..., 1] - (b - a)[..., 1] * (c - a)[..., 0]
    assert area.min() > 0
    assert np.abs(np.diff(ocean.vertices, axis=0)).max() > 0


def test_equal_seeds_give_equal_sequences() -> None:
    for make in (dynmesh.synth.ocean, dynmesh.synth.walker):
        first, again, other = make(2, seed=3), make(2, seed=3), make(1, seed=4)
        assert first.vertices.tobytes() == again.vertices.tobytes()
        assert len(other.vertices) == 1
        assert first.vertices[0].tobytes() != other.vertices[0].tobytes()
        np.testing.assert_array_equal(first.faces, other.faces)


def test_random_masks_keep_their_share() -> None:
    masks = np.stack(list(dynmesh.degrade.random_known(20, 1000, 0.3, seed=5)))
    assert masks[0].all()
    assert (masks[1:].sum(axis=1) == 300).all()
    assert 0.05 < (masks[1] & masks[2]).mean() < 0.13  # chosen independently: 0.09 on average
