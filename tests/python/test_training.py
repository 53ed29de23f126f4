"""Method detail with training: complete frames of the subject, seen before."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import meshes
import numpy as np
import pytest
from meshes import Array, Mesh
from training_reference import Trained

import dynmesh
from dynmesh import _core


def poses(vertices: Array, n: int, rng: np.random.Generator) -> Array:
    """Frames of a sheet that bends in two ways, by random amounts."""
    x, y, z = vertices.T
    frames = []
    for bend, twist in rng.normal(size=(n, 2)):
        height = 0.05 * bend * (x - x.mean()) ** 2 + 0.08 * twist * x * np.sin(0.7 * y)
        frames.append(np.stack([x, y, z + height], axis=1))
    return np.stack(frames)


def error(truth: Array, completed: Array) -> float:
    return float(np.linalg.norm(truth - completed, axis=-1).mean())


@pytest.mark.parametrize("noise", [None, 0.02])
@pytest.mark.parametrize("share", [0.1, 0.5])
@pytest.mark.parametrize("shape", ["sheet", "two parts"])
def test_frames_equal_the_transcription(
    shape: str, share: float, noise: float | None, rng: np.random.Generator
) -> None:
    mesh = {
        "sheet": meshes.sheet(10),
        "two parts": meshes.join(meshes.sheet(8), meshes.sheet(6, 30.0)),
    }[shape]
    training = poses(mesh.vertices, 20, rng)
    frames = poses(mesh.vertices, 8, rng)
    completer = dynmesh.Completer(
        mesh.faces,
        mesh.vertices,
        method="detail",
        disconnected="hold",
        noise=noise,
        training=training,
    )
    expected = Trained(mesh.faces, mesh.vertices, training, noise)
    weights = []
    for n, points in enumerate(frames):
        known = rng.random(len(points)) < share
        if shape == "two parts" and n % 3 == 1:
            known[64:] = False  # disconnected
        completed = completer.push(points, known)
        # The modes are stored in single precision, and their rounding errors add up.
        tolerance = (1e-6 if n < 4 else 1e-5) * expected.h
        np.testing.assert_allclose(
            completed, expected.complete(points, known), rtol=0, atol=tolerance
        )
        report = completer.report
        assert report.prior_weight == pytest.approx(expected.prior_weight, abs=1e-5)
        assert report.prior_share == pytest.approx(expected.prior_share, abs=1e-5)
        assert report.blend == pytest.approx(expected.blend, abs=1e-4)
        weights.append(report.prior_weight)
    assert max(weights) > 0.5


def completed(mesh: Mesh, frames: Array, masks: Any, **settings: Any) -> list[Array]:
    completer = dynmesh.Completer(mesh.faces, frames[0], method="detail", **settings)
    return [completer.push(*frame) for frame in zip(frames[1:], masks, strict=True)]


@pytest.fixture
def sheet() -> Mesh:
    return meshes.sheet(12)


@pytest.fixture
def clip(sheet: Mesh, rng: np.random.Generator) -> tuple[Array, Array]:
    """Frames, and masks of those after the first in which a corner is hidden."""
    frames = poses(sheet.vertices, 12, rng)
    masks = rng.random((11, len(sheet.vertices))) < 0.5
    masks[:, sheet.vertices[:, 0] > 6] = False
    return frames, masks


def test_hidden_parts_are_more_accurate(
    sheet: Mesh, clip: tuple[Array, Array], rng: np.random.Generator
) -> None:
    frames, masks = clip
    plain = completed(sheet, frames, masks)
    trained = completed(sheet, frames, masks, training=poses(sheet.vertices, 30, rng))
    assert error(frames[1:], np.stack(trained)) < 0.8 * error(frames[1:], np.stack(plain))


def test_without_trust_the_result_is_that_of_detail(
    sheet: Mesh, clip: tuple[Array, Array], rng: np.random.Generator
) -> None:
    """Bit for bit, whatever the training sequence."""
    frames, masks = clip
    frames = np.tile(sheet.vertices, (12, 1, 1))  # nothing that poses could explain
    frames[1:] += 0.001 * rng.normal(size=frames[1:].shape)
    training = sheet.vertices + 0.3 * rng.normal(size=(9, *sheet.vertices.shape))
    for noise in (None, 0.01):
        settings: Any = {"method": "detail", "noise": noise}
        plain = dynmesh.Completer(sheet.faces, frames[0], **settings)
        other = dynmesh.Completer(sheet.faces, frames[0], training=training, **settings)
        for points, known in zip(frames[1:], masks, strict=True):
            expected, frame = plain.push(points, known), other.push(points, known)
            if other.report.prior_weight > 0:
                break
            np.testing.assert_array_equal(frame, expected)
            assert other.report.blend == plain.report.blend
        assert other.report.prior_weight == 0


@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_a_take_in_which_nothing_moves_changes_nothing(
    sheet: Mesh, clip: tuple[Array, Array], kind: Any
) -> None:
    frames, masks = clip
    frames = frames.astype(kind)
    still = np.tile(frames[0], (5, 1, 1))
    np.testing.assert_array_equal(
        completed(sheet, frames, masks, training=still), completed(sheet, frames, masks)
    )


def test_where_the_take_was_does_not_matter(
    sheet: Mesh, clip: tuple[Array, Array], rng: np.random.Generator
) -> None:
    frames, masks = clip
    training = poses(sheet.vertices, 10, rng)
    turn = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])
    here = completed(sheet, frames, masks, training=training)
    there = completed(sheet, frames, masks, training=training @ turn + [10, 20, 30])
    np.testing.assert_allclose(np.stack(there), np.stack(here), atol=1e-5)


def test_any_stream_of_frames_is_a_training(
    sheet: Mesh, clip: tuple[Array, Array], rng: np.random.Generator
) -> None:
    frames, masks = clip
    training = poses(sheet.vertices, 10, rng)
    expected = completed(sheet, frames, masks, training=training)
    for stream in (
        list(training),
        iter(training),
        (frame[::1] for frame in training),
        training[:, :, ::1],
    ):
        np.testing.assert_array_equal(completed(sheet, frames, masks, training=stream), expected)


@pytest.mark.parametrize("settings", [{}, {"noise": 0.02}, {"reject_outliers": True}])
def test_a_state_continues(
    sheet: Mesh, clip: tuple[Array, Array], rng: np.random.Generator, settings: Any
) -> None:
    frames, masks = clip
    training = poses(sheet.vertices, 10, rng)

    def make(**more: Any) -> dynmesh.Completer:
        return dynmesh.Completer(
            sheet.faces, frames[0], method="detail", **{"training": training, **settings, **more}
        )

    one = make()
    for points, known in zip(frames[1:6], masks, strict=False):
        one.push(points, known)
    other = make(threads=2)
    other.restore(one.state())
    assert other.report.prior_weight == one.report.prior_weight > 0
    assert other.report.prior_share == one.report.prior_share
    assert other.state() == one.state()
    for points, known in zip(frames[6:], masks[5:], strict=True):
        np.testing.assert_array_equal(other.push(points, known), one.push(points, known))
    changed = training.copy()
    changed[4, 3, 2] += 1e-9
    for frames_of_other, reason in (
        (changed, "another training sequence"),
        (training[:-1], "another training sequence"),
        (None, "of a completer with training"),
    ):
        with pytest.raises(ValueError, match=reason):
            make(training=frames_of_other).restore(one.state())
    with pytest.raises(ValueError, match="without training"):
        make().restore(make(training=None).state())


def test_a_reset_learns_again(
    sheet: Mesh, clip: tuple[Array, Array], rng: np.random.Generator
) -> None:
    frames, masks = clip
    training = poses(sheet.vertices, 10, rng)
    new = dynmesh.Completer(sheet.faces, frames[4], method="detail", training=training)
    old = dynmesh.Completer(sheet.faces, frames[0], method="detail", training=training)
    old.push(frames[1], masks[0])
    old.reset(frames[4])
    for points, known in zip(frames[5:], masks[4:], strict=True):
        np.testing.assert_array_equal(old.push(points, known), new.push(points, known))
    assert old.state() == new.state()


def pose_of(completer: dynmesh.Completer) -> bytes:
    """The end of a state, before its checksum: sigma^2, N_v, D_v, and 16 coefficients a part."""
    return completer.state()[-8 * (1 + 3 + 16 * 13) : -8]


def test_frames_that_say_nothing_leave_the_pose_alone(
    sheet: Mesh, clip: tuple[Array, Array], rng: np.random.Generator
) -> None:
    frames, masks = clip
    training = poses(sheet.vertices, 10, rng)
    completer = dynmesh.Completer(sheet.faces, frames[0], method="detail", training=training)
    untouched = pose_of(completer)
    completer.push(frames[1], masks[0])
    found = pose_of(completer)
    assert found != untouched
    completer.skip()
    assert pose_of(completer) == found
    everything = np.ones(len(sheet.vertices), np.bool_)
    np.testing.assert_array_equal(completer.push(frames[2], everything), frames[2])
    assert pose_of(completer) == found
    everything[7] = False
    completer.push(frames[3], everything)
    assert pose_of(completer) != found


def test_one_anchor_is_enough(
    sheet: Mesh, clip: tuple[Array, Array], rng: np.random.Generator
) -> None:
    frames, _ = clip
    training = poses(sheet.vertices, 10, rng)
    completer = dynmesh.Completer(sheet.faces, frames[0], method="detail", training=training)
    one = np.arange(len(sheet.vertices)) == 5
    for points in frames[1:4]:
        completed = completer.push(points, one)
        assert np.isfinite(completed).all()
        np.testing.assert_array_equal(completed[5], points[5])


def test_parts_do_not_reach_across_components(rng: np.random.Generator) -> None:
    """A component in which nothing is trained is completed as without training."""
    one, two = meshes.sheet(8), meshes.sheet(6, 30.0)
    mesh = meshes.join(one, two)
    frames = poses(mesh.vertices, 8, rng)
    frames[:, 64:] = mesh.vertices[64:]
    training = poses(mesh.vertices, 10, rng)
    training[:, 64:] = mesh.vertices[64:]
    masks = rng.random((7, len(mesh.vertices))) < 0.4
    masks[:, 64:] = False  # has no anchors
    made = completed(mesh, frames, masks, training=training, disconnected="hold")
    np.testing.assert_array_equal(np.stack(made)[:, 64:], frames[1:, 64:])


SEQUENCES = ["crane", "horse_gallop", "ict_face_arkit", "ea_bone", "flag_sim_50x50"]
MOST = {
    ("crane", "10 %"): 0.65,
    ("horse_gallop", "10 %"): 0.26,
    ("horse_gallop", "camera"): 0.47,
    ("ict_face_arkit", "10 %"): 0.65,
    ("ict_face_arkit", "30 %"): 0.55,
    ("ea_bone", "10 %"): 0.45,
    ("flag_sim_50x50", "10 %"): 0.90,
    ("flag_sim_50x50", "30 %"): 0.90,
}


def masks_of(loss: str, frames: Array, faces: Any) -> Iterator[Any]:
    n, k, _ = frames.shape
    if loss == "camera":
        return dynmesh.degrade.camera_known(frames, faces, dynmesh.degrade.orbit(frames[0], 1))
    return dynmesh.degrade.random_known(n, k, float(loss.split()[0]) / 100, seed=1)


@pytest.mark.parametrize(("name", "loss"), MOST)
def test_recorded_subjects_are_more_accurate_in_their_second_half(
    data: Path, name: str, loss: str
) -> None:
    sequence = dynmesh.read(data / f"{name}.npz")
    half = len(sequence.vertices) // 2
    evenly = np.unique(np.linspace(0, half - 1, 50).astype(int))
    training, frames = sequence.vertices[evenly], sequence.vertices[half : half + 25]
    masks = list(masks_of(loss, frames, sequence.faces))[1:]
    mesh = Mesh(faces=sequence.faces.astype(np.int64), vertices=sequence.vertices[0])
    errors = [
        dynmesh.metrics.nmsve(sequence.faces, frames[1:], np.stack(made)).mean()
        for made in (
            completed(mesh, frames, masks),
            completed(mesh, frames, masks, training=training),
        )
    ]
    assert errors[1] <= MOST[name, loss] * errors[0]


@pytest.mark.parametrize("useless", ["noise", "another order", "another subject", "other moves"])
def test_a_useless_training_does_no_harm(
    data: Path, useless: str, rng: np.random.Generator
) -> None:
    # The bone has modes that few anchors determine, and which must not count as evidence.
    name = "ea_bone" if useless == "other moves" else "flag_sim_50x50"
    sequence = dynmesh.read(data / f"{name}.npz")
    frames = sequence.vertices[75:100]
    training = sequence.vertices[25:75]
    if useless == "other moves":
        training = training[0] + (training - training[0])[:, rng.permutation(training.shape[1])]
    elif useless == "noise":
        training = frames[0] + 0.02 * rng.normal(size=training.shape).astype(np.float32)
    elif useless == "another order":
        training = training[:, rng.permutation(training.shape[1])]
    else:
        training = dynmesh.read(data / "ocean_sim_50x50.npz").vertices[:50]
    masks = list(masks_of("30 %", frames, sequence.faces))[1:]
    mesh = Mesh(faces=sequence.faces.astype(np.int64), vertices=frames[0])
    errors = [
        dynmesh.metrics.nmsve(sequence.faces, frames[1:], np.stack(made)).mean()
        for made in (
            completed(mesh, frames, masks),
            completed(mesh, frames, masks, training=training),
        )
    ]
    assert errors[1] <= 1.02 * errors[0]


def test_a_take_in_another_unit_is_refused(sheet: Mesh, rng: np.random.Generator) -> None:
    training = poses(sheet.vertices, 5, rng)
    for factor in (1000.0, 100.0, 0.01):
        with pytest.raises(ValueError, match=r"training: its size, .* is .*first_frame is 4\.8"):
            dynmesh.Completer(
                sheet.faces, sheet.vertices, method="detail", training=factor * training
            )
    dynmesh.Completer(sheet.faces, sheet.vertices, method="detail", training=2 * training)


def test_a_stream_is_completed_with_a_training(
    sheet: Mesh, clip: tuple[Array, Array], rng: np.random.Generator
) -> None:
    frames, masks = clip
    training = poses(sheet.vertices, 10, rng)
    known = [np.ones(len(sheet.vertices), np.bool_), *masks]
    stream = dynmesh.complete(sheet.faces, frames, known, training=iter(training), method="detail")
    expected = completed(sheet, frames, masks, training=training)
    np.testing.assert_array_equal(list(stream)[1:], expected)


def test_a_summary_measures_poses_and_modes(sheet: Mesh, rng: np.random.Generator) -> None:
    """Of frames that are turned and moved, and of which one has another shape."""
    first, n = sheet.vertices, 40
    turn = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])
    lifted = first.copy()
    lifted[:, 2] += 0.02 * first[:, 0] * first[:, 1]
    training = np.stack([first, first @ turn + [5, 6, 7], first, lifted @ turn])
    summary = _core.training_summary(sheet.faces, first, training)
    moved = lifted - lifted.mean(axis=0)
    u, _, vt = np.linalg.svd(moved.T @ (first - first.mean(axis=0)))
    rotation = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt
    left = moved @ rotation - (first - first.mean(axis=0))
    distance = np.sqrt((left**2).sum(axis=1).mean())
    assert summary.frames == 4
    assert summary.largest_distance == pytest.approx(distance)
    assert summary.rms_distance == pytest.approx(distance / 2)
    assert summary.variance_held == pytest.approx(1)  # of one shape
    many = first + 0.05 * rng.normal(size=(n, *first.shape))
    held = _core.training_summary(sheet.faces, first, many.astype(np.float32)).variance_held
    assert 16 / n < held < 0.7  # of independent shapes, which 16 modes hold in part
    still = _core.training_summary(sheet.faces, first, [first] * 3)
    assert still.largest_distance == pytest.approx(0, abs=1e-9)
