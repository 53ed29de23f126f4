"""The method compared with its literal implementation, and its identities."""

from pathlib import Path

import meshes
import numpy as np
import pytest
import reference
from hypothesis import given, settings
from hypothesis import strategies as st
from meshes import Array, Mesh

import dynmesh

SEQUENCES = [
    "crane",
    "ea_bone",
    "flag_sim_50x50",
    "horse_gallop",
    "ict_face_arkit",
    "ocean_sim_50x50",
]


@pytest.mark.parametrize("share", [0.1, 0.3, 0.5, 0.7])
@pytest.mark.parametrize("name", SEQUENCES)
def test_recorded_sequences_equal_the_transcription(data: Path, name: str, share: float) -> None:
    sequence = dynmesh.read(data / f"{name}.npz")
    truth = sequence.vertices[:40].astype(np.float64)
    edges = reference.directed_edges(sequence.faces.astype(np.int64))
    h = reference.mean_edge(edges, truth[0])
    completer = dynmesh.Completer(sequence.faces, truth[0], method="motion")
    completed, expected = truth.copy(), truth.copy()
    masks = dynmesh.degrade.random_known(len(truth), truth.shape[1], share, seed=7)
    for n, known in enumerate(masks):
        if n > 0:
            completer.push(truth[n], known, out=completed[n])
            expected[n], _ = reference.complete_frame(edges, expected[n - 1], truth[n], known, h)
    np.testing.assert_allclose(completed[:4], expected[:4], rtol=0, atol=1e-6 * h)
    error = dynmesh.metrics.nmsve(sequence.faces, truth, completed)[1:].mean()
    expected_error = dynmesh.metrics.nmsve(sequence.faces, truth, expected)[1:].mean()
    assert error == pytest.approx(expected_error, rel=0.01)


@given(
    meshes.meshes(),
    st.data(),
    st.booleans(),
    st.integers(0, 4),
    st.sampled_from(["follow", "hold"]),
)
def test_random_meshes_equal_the_transcription(
    mesh: Mesh, data: st.DataObject, revisit: bool, extra: int, disconnected: str
) -> None:
    edges = reference.directed_edges(mesh.faces)
    h = reference.mean_edge(edges, mesh.vertices)
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))
    completer = dynmesh.Completer(
        mesh.faces,
        mesh.vertices,
        revisit=revisit,
        extra_iterations=extra,
        disconnected=disconnected,  # type: ignore[arg-type]
        method="motion",
    )
    frame = mesh.vertices
    for _ in range(2):
        known = data.draw(meshes.masks(len(frame)))
        points = mesh.vertices + 0.3 * rng.normal(size=mesh.vertices.shape)
        expected, generation = reference.complete_frame(
            edges, frame, points, known, h, revisit=revisit, extra_iterations=extra
        )
        if disconnected == "follow":
            expected = reference.follow(edges, mesh.vertices, frame, expected, generation)
        completed = completer.push(points, known)
        np.testing.assert_array_equal(completer.generation, generation)
        np.testing.assert_allclose(completed, expected, rtol=1e-7, atol=1e-7)
        assert completer.report.known == known.sum()
        assert completer.report.filled == (generation > 0).sum()
        assert completer.report.disconnected == (generation < 0).sum()
        assert completer.report.iterations == max(generation.max(), 0) + extra
        frame = completed


@given(meshes.meshes(), st.data())
def test_a_translation_is_completed_exactly(mesh: Mesh, data: st.DataObject) -> None:
    label = reference.components(reference.directed_edges(mesh.faces), len(mesh.vertices))
    known = np.zeros(len(label), bool)
    for part in np.unique(label):
        known[data.draw(st.sampled_from(np.flatnonzero(label == part).tolist()))] = True
    direction = data.draw(st.tuples(*[st.floats(-10, 10)] * 3))
    completer = dynmesh.Completer(mesh.faces, mesh.vertices, method="motion")
    frame = mesh.vertices
    for _ in range(3):
        frame = frame + np.array(direction)
        completed = completer.push(frame, known)
        np.testing.assert_allclose(completed, frame, rtol=0, atol=1e-12 * (1 + np.abs(frame).max()))


@given(meshes.meshes(), st.data())
def test_names_and_order_do_not_matter(mesh: Mesh, data: st.DataObject) -> None:
    k = len(mesh.vertices)
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))
    known = data.draw(meshes.masks(k))
    points = mesh.vertices + 0.3 * rng.normal(size=(k, 3))
    renamed = rng.permutation(k)  # vertex v becomes renamed[v]
    old = np.argsort(renamed)
    faces = rng.permutation(renamed[mesh.faces])
    faces = np.stack([np.roll(face, rng.integers(3)) for face in faces])

    completed = dynmesh.Completer(
        mesh.faces, mesh.vertices, disconnected="hold", method="motion"
    ).push(points, known)
    other = dynmesh.Completer(faces, mesh.vertices[old], disconnected="hold", method="motion").push(
        points[old], known[old]
    )
    np.testing.assert_allclose(other[renamed], completed, rtol=1e-9, atol=1e-9)


@given(meshes.meshes(), st.sampled_from([np.float32, np.float64]))
def test_what_is_known_comes_back_bit_for_bit(mesh: Mesh, dtype: type[np.floating]) -> None:
    first = mesh.vertices.astype(dtype)
    points = np.exp(10 * first)
    completer = dynmesh.Completer(mesh.faces, first, method="motion")
    assert completer.push(points).tobytes() == points.tobytes()
    assert completer.report.known == len(first)


@given(meshes.meshes(), st.data(), st.floats(1e-4, 1e6))
def test_scaling_commutes(mesh: Mesh, data: st.DataObject, scale: float) -> None:
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))
    known = data.draw(meshes.masks(len(mesh.vertices)))
    points = mesh.vertices + 0.3 * rng.normal(size=mesh.vertices.shape)

    def complete(factor: float) -> Array:
        completer = dynmesh.Completer(
            mesh.faces, factor * mesh.vertices, disconnected="hold", method="motion"
        )
        completed: Array = completer.push(factor * points, known)
        return completed / factor

    np.testing.assert_allclose(complete(scale), complete(1.0), rtol=1e-9, atol=1e-9)


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_single_precision_stays_close_to_double(seed: int) -> None:
    mesh = meshes.sheet(12)
    rng = np.random.default_rng(seed)
    single = dynmesh.Completer(mesh.faces, mesh.vertices.astype(np.float32), method="motion")
    double = dynmesh.Completer(
        mesh.faces, mesh.vertices.astype(np.float32).astype(np.float64), method="motion"
    )
    for angle in (0.1, 0.2, 0.3):
        points = meshes.turned(mesh.vertices, angle).astype(np.float32)
        known = rng.random(len(points)) < 0.2
        np.testing.assert_allclose(
            single.push(points, known), double.push(points, known), atol=1e-4
        )
    assert single.dtype == np.float32


@pytest.mark.parametrize("revisit", [True, False])
def test_a_recursion_that_diverges_stays_finite(revisit: bool) -> None:
    mesh = meshes.sheet(12)
    rng = np.random.default_rng(0)
    completer = dynmesh.Completer(
        mesh.faces, mesh.vertices.astype(np.float32), revisit=revisit, method="motion"
    )
    largest = 0.0
    for _ in range(4000):
        points = mesh.vertices + 0.3 * rng.normal(size=mesh.vertices.shape)
        completed = completer.push(points.astype(np.float32), rng.random(144) < 0.02)
        assert np.isfinite(completed).all()
        largest = max(largest, float(np.abs(completed).max()))
    assert largest > 1e6  # it does diverge
