"""Frames that are put together from all frames of a sequence."""

from typing import Any

import numpy as np
import pytest
import whole_frame_reference as reference
from meshes import join, sheet, turned
from scans_of_meshes import bent

import dynmesh
from dynmesh.whole_frames import WholeFrame, whole_frame
from dynmesh.whole_frames.trips import known_parts
from dynmesh.whole_frames.window import Mesh, Window


class Recording:
    """Frames of a bending sheet, of which each knows a part."""

    def __init__(self, n: int = 12, share: float = 0.5) -> None:
        self.faces, vertices = sheet(8)
        self.frames = np.array([bent(vertices, 0.1 * t) for t in range(n)])
        self.known = np.random.default_rng(5).random(self.frames.shape[:2]) < share
        self.known[n // 3, ::3] = True  # the best frame

    def error(self, whole: WholeFrame, which: Any = slice(None)) -> float:
        """The mean distance from the true frame."""
        distance = np.linalg.norm(whole.positions - self.frames[whole.frame], axis=1)
        return float(distance[which].mean())


RECORDING = Recording()


@pytest.mark.parametrize(("base", "n_unseen"), [(0, 0), (5, 0), (5, 20), (11, 0)])
def test_it_is_what_the_method_says(base: int, n_unseen: int) -> None:
    """Also of vertices that no frame knows."""
    faces, frames, known = RECORDING.faces, RECORDING.frames, RECORDING.known.copy()
    known[:, :n_unseen] = False
    whole = whole_frame(faces, frames, known, frame=base)
    positions, errors = reference.whole_frame(faces, frames, known, base, 15)
    assert whole.frame == base
    np.testing.assert_array_equal(whole.seen, known.any(axis=0))
    np.testing.assert_allclose(whole.positions, positions, atol=1e-5)
    np.testing.assert_allclose(whole.standard_error, errors, rtol=1e-3, atol=1e-6)


def test_a_frame_that_is_torn_where_no_frame_knows_it_is_not_returned_as_sound() -> None:
    known = RECORDING.known.copy()
    known[:, :20] = False
    whole = whole_frame(RECORDING.faces, RECORDING.frames, known, frame=0)
    assert whole.doubtful
    assert np.abs(whole.positions).max() < 2 * np.abs(RECORDING.frames).max()


def test_a_guess_between_vertices_that_are_close_together_is_not_doubtful() -> None:
    """No frame shows how long its edges are, but they are short, so little can be wrong."""
    mesh = sheet(20)
    heart = mesh.vertices - mesh.vertices.mean(axis=0)
    away = np.linalg.norm(heart, axis=1)
    close = heart * np.where(away < 5, 0.1, 1)[:, None]
    frames = np.stack([turned(close, 0.05 * n) for n in range(8)])
    known = np.ones(frames.shape[:2], np.bool_)
    known[:, np.argsort(away)[:12]] = False
    whole = whole_frame(mesh.faces, frames, known, frame=3)
    assert not whole.doubtful
    np.testing.assert_allclose(whole.positions, frames[3], atol=0.1)


def test_edges_that_no_frame_knows_may_be_as_different_as_others() -> None:
    """The mesh has edges that are thirty times as long as others."""
    mesh = sheet(12)
    x, y, _ = mesh.vertices.T
    bent = np.stack([np.expm1(0.4 * x), np.expm1(0.4 * y), np.sin(x)], axis=1)
    frames = np.stack([turned(bent, 0.05 * n) for n in range(8)])
    rng = np.random.default_rng(0)
    known = rng.random(frames.shape[:2]) < 0.7
    known[:, rng.permutation(len(bent))[:40]] = False
    whole = whole_frame(mesh.faces, frames, known, frame=3)
    assert not whole.doubtful
    np.testing.assert_allclose(whole.positions[whole.seen], frames[3][whole.seen], atol=0.1)


def test_the_frame_that_knows_one_vertex_more_is_completed() -> None:
    known = np.ones_like(RECORDING.known)
    known[:, :2] = False
    known[1, 0] = True
    assert whole_frame(RECORDING.faces, RECORDING.frames, known).frame == 1


def test_outliers_are_those_of_the_method_and_do_no_harm() -> None:
    recording = Recording(share=0.8)
    clean = whole_frame(recording.faces, recording.frames, recording.known)
    rng = np.random.default_rng(0)
    spikes = (rng.random(recording.known.shape) < 0.02) & recording.known
    frames = recording.frames + np.where(spikes, 9.0, 0.0)[..., None]
    kept = reference.without_outliers(recording.faces, frames, recording.known)
    assert not (kept & spikes).any()
    without = whole_frame(recording.faces, frames, kept, frame=clean.frame)
    whole = whole_frame(recording.faces, frames, recording.known, frame=clean.frame, outliers=True)
    np.testing.assert_array_equal(whole.positions, without.positions)
    np.testing.assert_array_equal(whole.known, kept[whole.frame])
    assert recording.error(whole) < 3 * recording.error(clean) + 0.01
    spoilt = whole_frame(recording.faces, frames, recording.known, frame=clean.frame)
    assert recording.error(spoilt) > 5 * recording.error(whole)


def test_noise_is_smoothed() -> None:
    recording = Recording(n=20, share=0.8)
    rng = np.random.default_rng(0)
    frames = recording.frames + rng.normal(0, 0.05, recording.frames.shape)
    exact = whole_frame(recording.faces, frames, recording.known)
    smooth = whole_frame(recording.faces, frames, recording.known, noise=0.05)
    assert recording.error(smooth) < 0.9 * recording.error(exact)
    assert (smooth.standard_error > 0).all()


def test_one_frame_is_filled_smoothly() -> None:
    frames, known = RECORDING.frames[:1], RECORDING.known[:1]
    whole = whole_frame(RECORDING.faces, frames, known)
    expected = reference.smooth_fill(frames[0], known[0], reference.edges_of(RECORDING.faces))
    np.testing.assert_allclose(whole.positions, expected, atol=1e-8)
    np.testing.assert_array_equal(whole.seen, known[0])
    assert (whole.standard_error[~known[0]] > 0.4).all()
    np.testing.assert_array_equal(whole.standard_error[known[0]], 0)


def test_a_whole_frame_comes_back_as_it_is() -> None:
    whole = whole_frame(RECORDING.faces, RECORDING.frames)
    np.testing.assert_array_equal(whole.positions, RECORDING.frames[whole.frame])
    np.testing.assert_array_equal(whole.standard_error, 0)
    assert whole.seen.all()


def test_a_part_that_only_another_frame_knows_is_taken_from_it() -> None:
    """A smaller sheet, apart from another one, with which it turns."""
    mesh, part = join(sheet(7), sheet(4, 12.0)), slice(49, None)
    frames = np.array([turned(mesh.vertices, 0.05 * t) for t in range(10)])
    known = np.random.default_rng(2).random(frames.shape[:2]) < 0.5
    known[:, part] = np.arange(10)[:, None] == 7
    whole = whole_frame(mesh.faces, frames, known, frame=2)
    assert whole.seen.all()
    np.testing.assert_allclose(whole.positions[part], frames[2][part], atol=0.05)
    assert np.isinf(whole.standard_error[part]).all()


def test_where_the_others_do_not_help_the_frame_is_filled_smoothly() -> None:
    known = RECORDING.known.copy()
    known[3] = True
    known[3, 20:40] = False
    frames = RECORDING.frames.copy()
    frames[4:] *= 1 + 3 * np.random.default_rng(1).random((8, 1, 3))
    frames[:3] *= 1 + 3 * np.random.default_rng(2).random((3, 1, 3))
    whole = whole_frame(RECORDING.faces, frames, known, frame=3)
    expected = reference.smooth_fill(frames[3], known[3], reference.edges_of(RECORDING.faces))
    assert whole.doubtful
    np.testing.assert_allclose(whole.positions, expected, atol=1e-8)
    assert (whole.standard_error[20:40] > 0.3).all()


class Watched(dynmesh.Sequence):
    """A whole sequence that notes which frames are read."""

    def frames_at(self, numbers: Any) -> Any:
        for number, frame in zip(numbers, super().frames_at(numbers), strict=True):
            READ.append(number)
            yield frame


READ: list[int] = []


def test_frames_are_read_in_order_twice_and_only_those_that_are_used() -> None:
    mesh, n = sheet(3), 2000
    whole = whole_frame(mesh.faces, Watched(np.tile(mesh.vertices, (n, 1, 1)), mesh.faces))
    assert whole.frame == n // 2 - 1  # the one nearest to the middle
    first, second = READ[:n], READ[n:]
    assert first == [*range(n)]
    assert second == sorted(set(second))
    assert len(second) < 300
    assert {*range(whole.frame - 30, whole.frame + 31)} <= {*second}
    assert second[0] < 50
    assert second[-1] > n - 50


@pytest.mark.parametrize(("n_known", "n_fixed"), [(3, 25), (4, 20)])
def test_a_part_begins_as_in_another_frame_if_fewer_than_four_vertices_are_known(
    n_known: int, n_fixed: int
) -> None:
    joined = join(sheet(4), sheet(3, 9.0))
    known = np.ones((2, 25), np.bool_)
    known[0, 16 + n_known :] = False
    frames = np.stack([joined.vertices, turned(joined.vertices, 0.5)])
    window = Window([0, 1], 0, frames, known)
    positions, fixed = known_parts(Mesh(joined.faces.astype(np.int32), 25), window)
    assert np.count_nonzero(fixed) == n_fixed
    np.testing.assert_allclose(positions[fixed], joined.vertices[fixed], atol=1e-10)
