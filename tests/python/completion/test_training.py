"""Method detail with training, from complete frames seen before or from those that it completes."""

from typing import Any

import meshes
import numpy as np
import pytest
import to_file
from bending_sheet import poses, swinging
from conftest import recorded
from meshes import Array
from streams import completed, errors_of
from training_reference import Learned, Trained

import dynmesh


@pytest.mark.parametrize(
    ("shape", "share", "noise"),
    [
        *(("sheet", 0.1, None), ("sheet", 0.5, 0.02)),
        *(("two parts", 0.1, 0.02), ("two parts", 0.5, None)),
        ("beyond the training", 0.5, None),
    ],
)
def test_frames_equal_the_transcription(
    shape: str, share: float, noise: float | None, rng: np.random.Generator
) -> None:
    mesh = {
        "sheet": meshes.sheet(17),  # whose products with the modes are sums of two chunks
        "two parts": meshes.join(meshes.sheet(8), meshes.sheet(6, 30.0)),
        "beyond the training": meshes.sheet(17),
    }[shape]
    training = poses(mesh.vertices, 20, rng)
    if shape == "beyond the training":
        training = mesh.vertices + 0.4 * (training[:4] - mesh.vertices)
    frames = poses(mesh.vertices, 8, rng)
    settings: Any = {"disconnected": "hold", "noise": noise, "training": training}
    completer = dynmesh.Completer(mesh.faces, mesh.vertices, method="detail", **settings)
    expected = Trained(mesh.faces, mesh.vertices, training, noise)
    weights = []
    for n, points in enumerate(frames):
        known = rng.random(len(points)) < {3: 0.0, 5: 1.0}.get(n, share)
        if shape == "two parts" and n % 3 == 1:
            known[64:] = False  # disconnected
        if shape == "beyond the training":
            known &= mesh.vertices[:, 0] < 10  # and vertices far from all anchors
        completed = completer.push(points, known)
        # The modes are stored in single precision, and their rounding errors grow from frame to
        # frame far from all anchors.
        tolerance = (1e-6 if n < 4 else 3e-5) * expected.h
        np.testing.assert_allclose(
            completed, expected.complete(points, known), rtol=0, atol=tolerance
        )
        report = completer.report
        if n not in (3, 5):  # which leave the pose alone
            assert report.prior_weight == pytest.approx(expected.prior_weight, abs=1e-5)
            assert report.prior_share == pytest.approx(expected.prior_share, abs=1e-5)
            assert report.blend == pytest.approx(expected.blend, abs=1e-4)
        weights.append(report.prior_weight)
    assert max(weights) > 0.5


def test_any_stream_of_frames_is_a_training_wherever_they_were(rng: np.random.Generator) -> None:
    sheet = meshes.sheet(12)
    frames, training = poses(sheet.vertices, 12, rng), poses(sheet.vertices, 10, rng)
    masks = rng.random((11, len(sheet.vertices))) < 0.5
    masks[:, sheet.vertices[:, 0] > 6] = False
    expected = completed(sheet, frames, masks, training=training)
    for stream in (list(training), iter(training), np.asfortranarray(training)):
        np.testing.assert_array_equal(completed(sheet, frames, masks, training=stream), expected)
    known = [np.ones(len(sheet.vertices), np.bool_), *masks]
    made = to_file.pushed(sheet.faces, frames, known, training=iter(training), method="detail")
    np.testing.assert_array_equal(list(made)[1:], expected)
    moved = training @ np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]]) + [10, 20, 30]
    there = completed(sheet, frames, masks, training=moved)
    np.testing.assert_allclose(np.stack(there), np.stack(expected), atol=1e-5)


def test_poses_beyond_the_training_do_no_harm_where_nothing_is_seen() -> None:
    """Steps are trained. A handstand follows, in which whole hands and feet are hidden."""
    sequence = dynmesh.synth.walker()
    training, frames = sequence.vertices[:87:2], sequence.vertices[87:137]
    masks = dynmesh.losses.patch_known(
        sequence.faces, len(frames), frames.shape[1], 0.3, lifetime=10, seed=0
    )
    errors = errors_of(sequence, frames, list(masks)[1:], {}, {"training": training})
    assert errors[1] <= errors[0]


@pytest.mark.parametrize(
    ("name", "useless"),
    [
        *(("ocean", useless) for useless in ("noise", "order", "subject", "moves")),
        *(recorded("flag_sim_50x50", useless) for useless in ("noise", "order", "subject")),
        # It has modes that few anchors determine, and which must not count as evidence.
        recorded("ea_bone", "moves"),
    ],
)
def test_a_useless_training_does_no_harm(
    sequence_named: Any, name: str, useless: str, rng: np.random.Generator
) -> None:
    """It is noise, or of the same vertices in another order, another subject, or other moves."""
    sequence = sequence_named(name)
    frames, training = sequence.vertices[75:100], sequence.vertices[25:75]
    if useless == "moves":
        training = training[0] + (training - training[0])[:, rng.permutation(training.shape[1])]
    elif useless == "noise":
        training = frames[0] + 0.02 * rng.normal(size=training.shape).astype(np.float32)
    elif useless == "order":
        training = training[:, rng.permutation(training.shape[1])]
    else:
        training = sequence_named("walker").vertices[:50, : training.shape[1]]
    n, k, _ = frames.shape
    masks = dynmesh.losses.random_known(n, k, 0.3, seed=1)
    errors = errors_of(sequence, frames, list(masks)[1:], {}, {"training": training})
    assert errors[1] <= 1.02 * errors[0]


@pytest.mark.parametrize(
    ("shape", "n_frames", "noise"),
    [("sheet", 75, None), ("sheet", 24, 0.02), ("two parts", 24, None), ("two parts", 24, 0.02)],
)
def test_learning_frames_equal_the_transcription(
    shape: str, n_frames: int, noise: float | None, rng: np.random.Generator
) -> None:
    """From frame 58 of the longer clip on, a shape leaves the library for each that enters."""
    mesh = {
        "sheet": meshes.sheet(8),
        "two parts": meshes.join(meshes.sheet(7), meshes.sheet(6, 30.0)),
    }[shape]
    frames = swinging(mesh.vertices, n_frames + 1)[1:]
    completer = dynmesh.Completer(
        mesh.faces, mesh.vertices, method="detail", disconnected="hold", noise=noise, learn=True
    )
    expected = Learned(mesh.faces, mesh.vertices, noise)
    for n, points in enumerate(frames):
        known = rng.random(len(points)) < (0.0 if n == 11 else 0.3)
        if shape == "two parts" and n % 3 == 1:
            known[49:] = False  # disconnected
        completed = completer.push(points, known)
        np.testing.assert_allclose(
            completed, expected.complete(points, known), rtol=0, atol=1e-6 * expected.h
        )
        report = completer.report
        assert report.prior_weight == expected.prior_weight
        assert report.prior_share == pytest.approx(expected.prior_share, abs=1e-4)
        if known.any():
            assert report.blend == pytest.approx(expected.blend, abs=1e-4)
    assert report.prior_weight == 1


def test_what_recurs_is_completed_more_accurately(rng: np.random.Generator) -> None:
    """A corner comes and goes."""
    sheet = meshes.sheet(12)
    frames = swinging(sheet.vertices, 90)
    masks = rng.random((89, len(sheet.vertices))) < 0.4
    hidden = np.arange(89) % 30 >= 15
    masks &= ~(hidden[:, None] & (sheet.vertices[:, 0] > 6))
    learned, plain = (completed(sheet, frames, masks, learn=on)[30:] for on in (True, False))
    off = (np.linalg.norm(frames[31:] - np.stack(made), axis=-1) for made in (learned, plain))
    assert next(off).mean() < 0.9 * next(off).mean()


@pytest.mark.parametrize("learns", [False, True])
def test_a_distant_anchor_does_not_affect_later_frames(learns: bool) -> None:
    mesh = meshes.sheet(9)
    training = poses(mesh.vertices, 6, np.random.default_rng(0))
    settings: Any = {"learn": True} if learns else {"training": training}
    completer = dynmesh.Completer(mesh.faces, mesh.vertices, **settings)

    def push(points: Array, seed: int) -> Array:
        known = np.random.default_rng(seed).random(81) < 0.5
        known[40] = True
        return completer.push(points, known)

    for distance in (1e9, 1e30, 1e100, 1e200):
        outlier = mesh.vertices.copy()
        outlier[40, 0] = distance
        for seed in (1, 2):
            assert np.abs(push(outlier, seed)).max() <= 1e200
        completer.restore(completer.state())
        completer.push(mesh.vertices)
        made = [push(mesh.vertices, seed) for seed in range(3, 9)]
        assert np.abs(made[-1] - mesh.vertices).max() < 1e-2


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("shift", [0, 2000])
def test_a_training_that_moves_as_a_whole_is_not_used_and_changes_nothing(
    shift: float, dtype: Any
) -> None:
    mesh = meshes.sheet(10)
    first = mesh.vertices.astype(dtype)
    away = shift * np.array([1, 1, 0])
    training = [(meshes.turned(mesh.vertices, 0.3 * n) + n * away).astype(dtype) for n in range(8)]
    plain = dynmesh.Completer(mesh.faces, first)
    trained = dynmesh.Completer(mesh.faces, first, training=training)
    bending = poses(mesh.vertices, 8, np.random.default_rng(0))
    for n in range(1, 16):
        frame = (mesh.vertices if n < 8 else bending[n - 8]) + 0.37 * n * np.array([1, 0, 0])
        known = np.random.default_rng(n).random(100) < 0.3
        expected = plain.push(frame.astype(dtype), known)
        np.testing.assert_array_equal(trained.push(frame.astype(dtype), known), expected)
        assert trained.report.prior_weight == 0


def test_after_a_rest_the_pose_does_not_depend_on_rounding_errors() -> None:
    mesh = meshes.join(*(meshes.sheet(3, 5.0 * n) for n in range(8)))
    mesh.vertices[:] += 0.1 * np.sin(7.0 * np.arange(mesh.vertices.size) ** 2).reshape(-1, 3)
    (one,) = poses(mesh.vertices, 1, np.random.default_rng(3))
    other = mesh.vertices + 1.7 * (one - mesh.vertices)

    def complete(shift: float) -> Array:
        first, shown, last = (meshes.turned(f, 0.7) + shift for f in (mesh.vertices, one, other))
        completer = dynmesh.Completer(mesh.faces, first, training=[shown] * 3)
        rng = np.random.default_rng(1)
        completer.push(first + np.array([0.1, 0.2, 0.3]), rng.random(len(first)) < 0.05)
        made = completer.push(last, rng.random(len(first)) < 0.8)
        assert completer.report.prior_weight > 0
        return made - shift

    expected = complete(0)
    for shift in (0.01, 0.3, 7.3, -100.0):
        np.testing.assert_allclose(complete(shift), expected, rtol=0, atol=1e-9)


def test_mirror_images_of_a_closed_mesh_have_no_effect_and_other_axes_have_none_either() -> None:
    walker, other = dynmesh.synth.walker(8), dynmesh.synth.walker(12, seed=1).vertices
    known: Any = dynmesh.degrade(walker, patches=0.3).known

    def complete(training: Any) -> tuple[Any, float]:
        completer = dynmesh.Completer(walker.faces, walker.vertices[0], training=training)
        for points, seen in zip(walker.vertices[1:], known[1:], strict=True):
            made = completer.push(points, seen)
        return made, completer.report.prior_weight

    turned, weight = complete(other[..., [1, 2, 0]])
    assert weight > 0.5
    np.testing.assert_allclose(turned, complete(other)[0], rtol=0, atol=1e-4)
    mirrored, weight = complete(other * np.array([-1, 1, 1], np.float32))
    assert weight == 0
    np.testing.assert_array_equal(mirrored, complete(None)[0])
