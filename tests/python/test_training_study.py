"""What the study measures after training, on a sheet that sways."""

import meshes
import numpy as np
import pytest

import dynmesh
from benchmarks.training_study import halves, held_out, training_study, useless
from dynmesh.study.subjects import Subject


def swaying(n: int, shift: float = 0.0) -> Subject:
    """A sheet that bends up and down about one line, again and again."""
    mesh = meshes.sheet(12)
    across = mesh.vertices[:, 0] - mesh.vertices[:, 0].mean()
    phase = 2 * np.pi * np.arange(n) / 13 + shift
    frames = np.repeat(mesh.vertices[None], n, axis=0)
    frames[:, :, 2] += 0.06 * np.sin(phase)[:, None] * across**2
    return Subject("sheet", frames, mesh.faces, "z", 60.0)


def test_the_halves_do_not_overlap() -> None:
    parts = halves(swaying(9))
    assert parts is not None
    training, second = parts
    np.testing.assert_array_equal(np.concatenate([training, second.vertices]), swaying(9).vertices)
    long = swaying(300)
    parts = halves(long)
    assert parts is not None
    assert len(parts[0]) == parts[1].n_frames == 50
    np.testing.assert_array_equal(parts[0][[0, -1]], long.vertices[[0, 149]])
    np.testing.assert_array_equal(parts[1].vertices, long.vertices[150:200])
    assert halves(swaying(5)) is None


def test_trained_runs_are_those_of_the_library() -> None:
    parts = halves(swaying(40))
    assert parts is not None
    training, second = parts
    others = [swaying(40, 1.0)]
    runs = training_study(second, training, others=others, shares=(0.1,), scenarios=())["10 %"]
    masks = list(dynmesh.degrade.random_known(20, 144, 0.1, seed=0))
    noise, moves, other = (frames for _, frames in useless(training, second.faces, others, seed=0))
    errors = {}
    for key, frames in {
        "detail": None,
        "trained": training,
        "trained on noise": noise,
    }.items():
        completer = dynmesh.Completer(
            second.faces, second.vertices[0], method="detail", training=frames
        )
        pairs = zip(second.vertices[1:], masks[1:], strict=True)
        completed = np.stack([completer.push(points, known) for points, known in pairs])
        nmsve = dynmesh.metrics.nmsve(second.faces, second.vertices[1:], completed)
        errors[key] = nmsve.mean() / second.diagonal
        assert runs[key].nmsve.mean() == pytest.approx(errors[key])
        assert runs[key].prior_weight[-1] == completer.report.prior_weight
    assert errors["trained"] < 0.95 * errors["detail"]
    assert runs["trained"].prior_weight.mean() > runs["trained on noise"].prior_weight.mean()
    assert not np.array_equal(noise, training)
    assert np.abs(moves - training).max() > 0.1 * np.abs(training - training[0]).max()
    np.testing.assert_allclose(np.ptp(moves, axis=0).sum(), np.ptp(training, axis=0).sum())
    np.testing.assert_array_equal(other, swaying(40, 1.0).vertices[:20])


def test_what_is_held_out_is_known_and_lost_alike() -> None:
    subject = swaying(30)
    masks = list(dynmesh.degrade.random_known(30, 144, 0.5, seed=0))
    for loss, least, most in (("50 %", 0.04, 0.06), ("patches", 0.02, 0.12)):
        apart = np.stack(held_out(subject, loss, masks, 0))
        known = np.stack(masks)
        assert not (apart & ~known).any()
        assert least < apart[1:].sum() / known[1:].sum() < most
    nearly = [np.arange(144) < 40 for _ in masks]  # patches may miss these; vertices do not
    assert any(mask.any() for mask in held_out(subject, "patches", nearly, 0)[1:])
