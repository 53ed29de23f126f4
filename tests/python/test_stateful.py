"""A completer under random calls, valid and invalid, compared with a simple model."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from conftest import LONGER
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule
from meshes import EVENTS, Array, masks, meshes

import dynmesh
from dynmesh import _core

Completer = dynmesh.Completer


def breadth_first(faces: Array, known: Array) -> Array:
    """Generations: edges to the nearest anchor, -1 where there is none."""
    offsets, neighbours = dynmesh.cells(faces, len(known))
    generation = np.where(known, 0, -1)
    front = np.flatnonzero(known)
    while len(front):
        around = {n for v in front for n in neighbours[offsets[v] : offsets[v + 1]]}
        reached = np.array([n for n in sorted(around) if generation[n] < 0], int)
        generation[reached] = generation[front[0]] + 1
        front = reached
    return generation


class AnyCalls(RuleBasedStateMachine):
    """Invariants of every sequence of calls."""

    @initialize(data=st.data())
    def begin(self, data: st.DataObject) -> None:
        self.faces, first = data.draw(meshes())
        self.k = len(first)
        self.dtype = data.draw(st.sampled_from([np.float32, np.float64]))
        self.settings: dict[str, Any] = {"unseen": data.draw(st.sampled_from(["follow", "hold"]))}
        if data.draw(st.booleans()):
            noise = data.draw(st.sampled_from([None, 0.01]))
            rejects = data.draw(st.booleans())
            learns = data.draw(st.booleans())
            self.settings |= {"method": "detail", "noise": noise, "reject_outliers": rejects}
            self.settings |= {"learn": learns}
            self.settings["uncertainty"] = data.draw(st.booleans())
        else:
            extra = data.draw(st.sampled_from([0, 3]))
            self.settings |= {"revisit": data.draw(st.booleans()), "extra_iterations": extra}
        self.first = first.astype(self.dtype)
        threads = data.draw(st.sampled_from([1, 2]))
        # Pieces are small and calls wait for the other thread, so that both share the work.
        usual = _core._set_sharing(chunk=4, short_chunk=4, fewest_pieces=2, patience=100_000)
        self.completer = Completer(self.faces, self.first, threads=threads, **self.settings)
        _core._set_sharing(*usual)
        # With at most four vertices, only the parts of what is learned are shared, in some frames.
        self.must_share = threads > 1 and self.k > 4
        self.may_share = threads > 1
        self.age = np.zeros(self.k, np.int32)
        self.calls: list[tuple[Callable[[Completer], Array | None], Array | None]] = []
        self.saved: list[tuple[bytes, Array, int]] = []

    def teardown(self) -> None:
        """Repeats only the accepted calls, which must give the same state."""
        if not hasattr(self, "calls"):
            return
        other = Completer(self.faces, self.first, **self.settings)
        for call, result in self.calls:
            again = call(other)
            assert (again is None) == (result is None)
            if again is not None and result is not None:
                assert again.tobytes() == result.tobytes()

    def points(self, data: st.DataObject, n: int) -> Array:
        rng = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))
        scale = data.draw(st.sampled_from([0.0, 0.1, 3.0, 1e12]))
        event = data.draw(st.sampled_from([None, *EVENTS]))
        if event is None or n < self.k:
            points = self.first[rng.integers(0, self.k, n)] + scale * rng.normal(size=(n, 3))
        else:
            points = self.first.astype(np.float64) @ EVENTS[event].T
        points = points.astype(data.draw(st.sampled_from([np.float32, np.float64])))
        layout = data.draw(st.sampled_from(["packed", "columns", "reversed", "wide"]))
        if layout == "reversed":
            return points[::-1].copy()[::-1]
        if layout == "wide":
            return np.hstack([points, points])[:, :3]
        return np.asfortranarray(points) if layout == "columns" else points

    def frame(self, known: Array, points: Array, call: Callable[[Completer], Array]) -> None:
        """Makes a valid call, in which `points` are observed where `known`."""
        pieces = _core._pieces_done_by_others()
        result = call(self.completer)
        is_shared = _core._pieces_done_by_others() > pieces
        assert self.must_share <= is_shared <= self.may_share
        self.calls.append((call, result.copy()))
        assert result.dtype == self.dtype
        assert result.shape == (self.k, 3)
        assert np.isfinite(result).all()
        state = self.completer.state()
        self.completer.restore(state)
        assert self.completer.state() == state
        generation, age = self.completer.generation, self.completer.age
        anchors = generation == 0
        if self.settings.get("reject_outliers"):
            assert not (anchors & ~known).any()
            known = anchors
        if self.settings.get("noise") is None:
            assert result[known].tobytes() == points.astype(self.dtype)[known].tobytes()
        self.age = np.where(known, 0, self.age + 1).astype(np.int32)
        np.testing.assert_array_equal(generation, breadth_first(self.faces, known))
        np.testing.assert_array_equal(age, self.age)
        report = self.completer.report
        counts = (report.known, report.filled, report.unseen)
        assert counts == tuple(np.bincount(np.minimum(generation + 1, 2), minlength=3)[[1, 2, 0]])

    @rule(data=st.data(), in_place=st.booleans())
    def push(self, data: st.DataObject, in_place: bool) -> None:
        points, known = self.points(data, self.k), data.draw(masks(self.k))
        points[~known] = data.draw(st.sampled_from([np.nan, np.inf, 1e30, 0.0]))
        given = points.copy()
        if in_place and points.dtype == self.dtype:
            self.frame(known, given, lambda c: _into(c.push, given.copy(), known))
        else:
            self.frame(known, given, lambda c: c.push(points, known))

    @rule(data=st.data())
    def push_rows(self, data: st.DataObject) -> None:
        points, known = self.points(data, self.k), data.draw(masks(self.k))
        points[~known, data.draw(st.integers(0, 2))] = np.nan
        self.frame(known, points, lambda c: c.push(points))

    @rule(data=st.data())
    def push_sparse(self, data: st.DataObject) -> None:
        known = data.draw(masks(self.k))
        rng = np.random.default_rng(data.draw(st.integers(0, 99)))
        indices = rng.permutation(np.flatnonzero(known))
        observed = self.points(data, len(indices))
        points = np.zeros((self.k, 3))
        points[indices] = observed
        self.frame(known, points, lambda c: c.push_sparse(indices, observed))

    @rule()
    def skip(self) -> None:
        nothing = np.zeros(self.k, bool)
        self.frame(nothing, np.zeros((self.k, 3)), lambda c: c.skip())

    @rule(data=st.data())
    def reset(self, data: st.DataObject) -> None:
        points = self.points(data, self.k)
        self.completer.reset(points)
        self.calls.append((lambda c: c.reset(points), None))
        self.age[:] = 0

    @rule()
    def save(self) -> None:
        self.saved.append((self.completer.state(), self.age.copy(), len(self.calls)))

    @precondition(lambda self: self.saved)
    @rule(data=st.data(), elsewhere=st.booleans())
    def restore(self, data: st.DataObject, elsewhere: bool) -> None:
        state, self.age, n_calls = data.draw(st.sampled_from(self.saved))
        self.age = self.age.copy()
        self.calls = self.calls[:n_calls]
        self.saved = [one for one in self.saved if one[2] <= n_calls]
        if elsewhere:
            self.completer = Completer(self.faces, self.first + 1, **self.settings)
            self.must_share = self.may_share = False
        self.completer.restore(state)
        assert self.completer.state() == state

    @rule(data=st.data())
    def misuse(self, data: st.DataObject) -> None:
        """Makes a bad call, which must be refused and change nothing."""
        k, c = self.k, self.completer
        good = np.zeros((k, 3), self.dtype)
        all_known = np.ones(k, bool)
        bad = good.copy()
        bad[data.draw(st.integers(0, k - 1))] = data.draw(st.sampled_from([np.nan, -np.inf]))
        room = np.zeros((k + 1, 3), self.dtype)
        shifted = np.zeros(3 * k + 1, self.dtype)
        frozen = good.copy()
        frozen.flags.writeable = False
        state = bytearray(c.state())
        state[data.draw(st.integers(0, len(state) - 1))] ^= 1
        other = np.float32 if self.dtype == np.float64 else np.float64
        calls: list[Callable[[], Any]] = [
            lambda: c.push(np.zeros((k + 1, 3)), None),
            lambda: c.push(np.zeros((k, 2)), None),
            lambda: c.push(np.zeros(3 * k), None),
            lambda: c.push(good.astype(int), None),
            lambda: c.push(good.astype(complex), None),
            lambda: c.push(None, None),  # type: ignore[arg-type]
            lambda: c.push(good, all_known.astype(np.uint8)),
            lambda: c.push(good, all_known[:-1]),
            lambda: c.push(good, all_known[None]),
            lambda: c.push(bad, all_known),
            lambda: c.push(shifted[:-1].reshape(k, 3), out=shifted[1:].reshape(k, 3)),
            lambda: c.push(good, out=good.astype(other)),
            lambda: c.push(good, out=frozen),
            lambda: c.push(good, out=room),
            lambda: c.push_sparse(np.array([k]), good[:1]),
            lambda: c.push_sparse(np.array([-1]), good[:1]),
            lambda: c.push_sparse(np.array([0, 0]), np.zeros((2, 3))),
            lambda: c.push_sparse(np.array([0.0]), good[:1]),
            lambda: c.push_sparse(np.array([0]), np.zeros((2, 3))),
            lambda: c.push_sparse(np.array([2**63], np.uint64), good[:1]),
            lambda: c.skip(out=np.zeros((k, 3), int)),
            lambda: c.reset(bad),
            lambda: c.reset(room),
            lambda: c.restore(state),
            lambda: c.restore(state[:-1]),
            lambda: c.restore(b""),
            lambda: c.restore("state"),  # type: ignore[arg-type]
        ]
        before = c.state()
        with pytest.raises((ValueError, TypeError)):
            data.draw(st.sampled_from(calls))()
        assert c.state() == before

    @invariant()
    def shows_copies(self) -> None:
        """Checks that returned arrays are not shared."""
        if hasattr(self, "completer"):
            self.completer.age[:] = -5
            self.completer.generation[:] = -5
            np.testing.assert_array_equal(self.completer.age, self.age)


def _into(push: Callable[..., Array], points: Array, known: Array) -> Array:
    result = push(points, known, out=points)
    assert result is points
    return result


TestAnyCalls = AnyCalls.TestCase
TestAnyCalls.settings = settings(max_examples=20 * LONGER, stateful_step_count=30, deadline=None)
