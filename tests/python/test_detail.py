"""Method detail compared with its literal implementation, and its identities."""

from typing import Any, Literal

import meshes
import numpy as np
import pytest
import reference
from conftest import recorded
from hypothesis import given
from hypothesis import strategies as st
from meshes import EVENTS, Array, Mesh, sheet
from numpy.typing import DTypeLike, NDArray

import dynmesh


def bent(vertices: Array, amount: float) -> Array:
    """A sheet that is rolled up about y and moved."""
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


def error(
    faces: NDArray[Any],
    truth: Array,
    masks: list[NDArray[np.bool_]],
    method: Literal["motion", "detail"],
) -> float:
    """The mean NMSVE of the frames after the first."""
    completer = dynmesh.Completer(faces, truth[0], method=method)
    completed = truth.copy()
    for n in range(1, len(truth)):
        completer.push(truth[n], masks[n], out=completed[n])
    return float(dynmesh.metrics.nmsve(faces, truth, completed)[1:].mean())


@pytest.mark.parametrize(
    ("share", "noise"), [(0.05, None), (0.3, None), (0.7, None), (0.3, 0.02), (0.05, 0.5)]
)
@pytest.mark.parametrize("shape", ["sheet", "slanted", "two parts"])
def test_frames_equal_the_transcription(
    shape: str, share: float, noise: float | None, rng: np.random.Generator
) -> None:
    mesh = {
        "sheet": meshes.sheet(10),
        "slanted": slanted(10),
        "two parts": meshes.join(slanted(8), meshes.sheet(4, 30.0)),
    }[shape]
    k = len(mesh.vertices)
    completer = dynmesh.Completer(
        mesh.faces, mesh.vertices, method="detail", disconnected="hold", noise=noise
    )
    expected = reference.Detail(mesh.faces, mesh.vertices, noise)
    for n in range(1, 5):
        points = bent(mesh.vertices, 0.02 * n) + 0.02 * rng.normal(size=(k, 3))
        known = rng.random(k) < share
        if shape == "two parts" and n % 2 == 0:
            known[64:] = False  # disconnected
        completed = completer.push(points, known)
        np.testing.assert_allclose(
            completed, expected.complete(points, known), rtol=0, atol=1e-6 * expected.h
        )
        report = completer.report
        assert report.blend == pytest.approx(expected.blend, abs=1e-6)
        stages = [report.factor_seconds, report.rotation_seconds, report.solve_seconds]
        assert 0 < min(stages) <= sum(stages) < report.seconds


def fluttering(mesh: Mesh, n: int) -> Array:
    """A sheet with travelling folds along x, whose edges keep their lengths."""
    x, y, z = mesh.vertices.T
    along = np.linspace(x.min(), x.max(), 4001)
    angle = 1.3 * np.sin(0.9 * along + 0.9 * n)
    ahead, up = (np.cumsum(f(angle)) * (along[1] - along[0]) for f in (np.cos, np.sin))
    slope = np.interp(x, along, angle)
    return np.stack(
        [
            np.interp(x, along, ahead) - z * np.sin(slope),
            y,
            np.interp(x, along, up) + z * np.cos(slope),
        ],
        axis=1,
    )


@pytest.mark.parametrize("noise", [None, 0.05])
@pytest.mark.parametrize("n_parts", [1, 2])
def test_cloth_keeps_its_edges_as_the_transcription_does(
    n_parts: int, noise: float | None, rng: np.random.Generator
) -> None:
    cloth = meshes.sheet(16)
    cloth = Mesh(cloth.faces, fluttering(cloth, 0))
    mesh = meshes.join(cloth, meshes.sheet(12, 40.0)) if n_parts == 2 else cloth
    completer = dynmesh.Completer(mesh.faces, mesh.vertices, method="detail", noise=noise)
    expected = reference.Detail(mesh.faces, mesh.vertices, noise)
    shares = []
    for n in range(1, 13):
        rest = meshes.turned(mesh.vertices[256:], 0.1 * n)  # stiff, where there is such a part
        points = np.concatenate([fluttering(meshes.sheet(16), n), rest])
        points += (noise or 0.001) * rng.normal(size=points.shape)
        known = rng.random(len(points)) < 0.6
        completed = completer.push(points, known)
        np.testing.assert_allclose(
            completed, expected.complete(points, known), rtol=0, atol=1e-6 * expected.h
        )
        shares.append(completer.report.first_order_share)
        assert shares[-1] == pytest.approx(expected.first_order_share, abs=1e-12)
        assert completer.report.iterations == 3
        if n in (5, 8, 9):  # at least once in the middle between two tests
            state = completer.state()
            completer = dynmesh.Completer(mesh.faces, mesh.vertices, method="detail", noise=noise)
            completer.restore(state)
    assert np.median(shares) > 0.5
    assert (expected.first_order.share[1:] < 0.5).all()


@pytest.mark.parametrize("noise", [None, 0.02])
def test_a_change_under_way_goes_on(noise: float | None, rng: np.random.Generator) -> None:
    mesh = meshes.sheet(12)
    completer = dynmesh.Completer(mesh.faces, mesh.vertices, method="detail", noise=noise)
    expected = reference.Detail(mesh.faces, mesh.vertices, noise)
    for n in range(1, 11):
        x, y, _ = mesh.vertices.T  # travelling waves, so that the shape of frame 0 does not help
        height = np.sin(0.8 * x + 0.1 * n) * np.cos(0.6 * y - 0.07 * n)
        points = mesh.vertices + 0.3 * height[:, None] * [0, 0, 1]
        known = rng.random(len(points)) < 0.5
        completed = completer.push(points, known)
        np.testing.assert_allclose(
            completed, expected.complete(points, known), rtol=0, atol=1e-6 * expected.h
        )
    assert expected.continued > 0.5


@pytest.mark.parametrize(
    ("name", "n_frames", "share", "most"),
    [
        ("walker", 30, 0.1, 0.05),
        ("ocean", 40, 0.5, 0.65),
        recorded("crane", 60, 0.1, 0.20),
        recorded("horse_gallop", 24, 0.3, 0.24),
        recorded("flag_sim_50x50", 60, 0.3, 0.85),
        recorded("ict_face_arkit", 30, 0.3, 0.37),
        recorded("ea_bone", 80, 0.3, 0.20),
        recorded("ocean_sim_50x50", 40, 0.5, 0.55),
    ],
)
def test_sequences_keep_their_shape(
    sequence_named: Any, name: str, n_frames: int, share: float, most: float
) -> None:
    sequence = sequence_named(name)
    truth = sequence.vertices[:n_frames].astype(np.float64)
    masks = list(dynmesh.degrade.random_known(n_frames, truth.shape[1], share, seed=3))
    assert error(sequence.faces, truth, masks, "detail") < most * error(
        sequence.faces, truth, masks, "motion"
    )


@given(meshes.meshes(), st.data())
def test_names_and_order_do_not_matter(mesh: Mesh, data: st.DataObject) -> None:
    k = len(mesh.vertices)
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))
    known = data.draw(meshes.masks(k))
    points = mesh.vertices + 0.02 * rng.normal(size=(k, 3))
    renamed = rng.permutation(k)  # vertex v becomes renamed[v]
    old = np.argsort(renamed)
    other = dynmesh.Completer(
        renamed[mesh.faces], mesh.vertices[old], method="detail", disconnected="hold"
    )
    completer = dynmesh.Completer(mesh.faces, mesh.vertices, method="detail", disconnected="hold")
    np.testing.assert_allclose(
        other.push(points[old], known[old])[renamed],
        completer.push(points, known),
        rtol=0,
        atol=1e-4,
    )


def errors(completer: dynmesh.Completer, frames: Array) -> Array:
    """Errors of five frames with a third of the vertices known, after one complete frame."""
    rng = np.random.default_rng(1)
    completer.push(frames[1])
    found = []
    for frame in frames[2:]:
        known = rng.random(len(frame)) < 0.3
        known[0] = True
        completed = completer.push(frame, known)
        found.append(np.linalg.norm(completed - frame, axis=1).mean())
    completer.restore(completer.state())
    return np.array(found)


@pytest.mark.parametrize("shape", ["flat", "bumpy", "triangle"])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("noise", [None, 0.01], ids=["exact", "noise"])
def test_one_complete_frame_restores_accuracy(
    shape: str, dtype: DTypeLike, noise: float | None
) -> None:
    """Of a mesh that turns and waves, after each of the events."""
    mesh = sheet(12) if shape != "triangle" else Mesh(np.array([[0, 1, 2]]), 2 * np.eye(3))
    first = mesh.vertices * ([1, 1, 0] if shape == "flat" else 1)
    wave = 0.05 * np.sin(0.3 * first[:, :1]) * [0, 0, 1] + 0.1
    frames = np.stack([meshes.turned(first, 0.05 * n) + n * wave for n in range(7)]).astype(dtype)
    edges = first[mesh.faces[:, 0]] - first[mesh.faces[:, 1]]
    h = float(np.linalg.norm(edges, axis=1).mean())
    sigma = None if noise is None else noise * h
    completer = dynmesh.Completer(mesh.faces, frames[0], method="detail", noise=sigma)
    expected = errors(completer, frames)
    for name, event in EVENTS.items():
        centre = frames[0].mean(axis=0)
        completer.reset(frames[0])
        completer.push(((frames[0] - centre) @ event.T + centre).astype(dtype))
        completer.restore(completer.state())
        found = errors(completer, frames)
        assert (found <= 3 * np.maximum(expected, 1e-5 * h)).all(), (name, found, expected)
