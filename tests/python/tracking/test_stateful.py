"""Trackers under random calls, compared with a model and a twin.

The twin is a second one that works in another unit, and that receives only the calls that a
restored state did not undo. Since units differ by powers of two, it must agree bit for bit.
Completers under random calls are in tests/fuzz/completer.cpp.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from conftest import LONGER
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule
from meshes import Array, meshes, sheet, turned
from reference import directed_edges, edges_to
from streams import COPIES

import dynmesh

Call = Callable[[Any, float], Array | None]
"""A call of a tracker whose lengths are multiplied by a number."""


UNITS = {np.float32: (-60, 20), np.float64: (-60, 40)}
"""The powers of two, with which all drawn positions are within what the types allow. Squares of the
smallest are out of the range of float32."""
ANGLES = st.sampled_from([0.0, 0.3, 2.0])
SHIFTS = st.sampled_from([0.0, 7.3, -100.0])
SIZES = st.integers(2, 14)
NUMBERS = (
    *("known", "filled", "disconnected", "rejected", "iterations"),
    *("blend", "prior_weight", "prior_share", "first_order_share"),
    *("quality", "reason"),
)


class Accepted(NamedTuple):
    """A call that was not refused, and what could be seen after it."""

    call: Call
    frame: Array | None
    lengths: Array | None
    numbers: tuple[float, ...]


def times(points: Array, scale: float) -> Array:
    with np.errstate(invalid="ignore", over="ignore"):  # what is not known may be infinite
        scaled: Array = points * points.dtype.type(scale)
    return scaled


class TrackerCalls(RuleBasedStateMachine):
    """Sequences of calls of a tracker."""

    @initialize(data=st.data())
    def begin(self, data: st.DataObject) -> None:
        """Draws a mesh somewhere, and its subject."""
        self.faces, first = data.draw(st.one_of(meshes(), meshes(200), st.builds(sheet, SIZES)))
        self.k = len(first)
        self.dtype = data.draw(st.sampled_from([np.float32, np.float64]))
        self.tame = data.draw(st.booleans())
        units = st.integers(*UNITS[self.dtype]).map(lambda power: 2.0**power)
        self.unit = data.draw(units)
        moved = turned(first, data.draw(ANGLES)) + data.draw(SHIFTS)
        self.first = (self.unit * moved).astype(self.dtype)
        self.uncertainty = data.draw(st.booleans())
        self.resolution = data.draw(st.sampled_from(["best", 20]))
        kind = data.draw(st.sampled_from([None, "bends", "turns", "rests"]))
        self.training = None if kind is None else self.moving(kind, 6)
        self.subject = self.make(1)
        self.age = np.zeros(self.k, np.int32)
        self.accepted: list[Accepted] = []
        self.saved: list[tuple[bytes, Array, int]] = []
        self.twin_scale = data.draw(units) / self.unit

    def moving(self, kind: str, n: int) -> Array:
        """Frames that bend, only turn, or only repeat frame 0."""
        frames = [self.first.astype(np.float64)] * n
        if kind != "rests":
            frames = [turned(frame, 0.1 * i) for i, frame in enumerate(frames)]
        if kind == "bends":
            frames = [f + 0.1 * i * self.unit * np.sin(f / self.unit) for i, f in enumerate(frames)]
        return np.stack(frames).astype(self.dtype)

    def make(self, scale: float) -> Any:
        options: Any = {"uncertainty": self.uncertainty, "resolution": self.resolution}
        if self.training is not None:
            options["training"] = times(self.training, scale)
        return dynmesh.Tracker(self.faces, times(self.first, scale), **options)

    def check_history(self, observed: Array) -> None:
        """Checks what is known of the vertices after a frame in which some were observed."""
        self.age = np.where(observed, 0, self.age + 1).astype(np.int32)
        away = edges_to(observed, directed_edges(self.faces))
        expected = np.where(np.isfinite(away), away, -1).astype(int)
        np.testing.assert_array_equal(self.subject.generation, expected)
        np.testing.assert_array_equal(self.subject.age, self.age)
        report = self.subject.report
        counts = (report.disconnected, report.known, report.filled)
        assert counts == tuple(np.bincount(np.minimum(expected + 1, 2), minlength=3))

    def accept(self, call: Call) -> Array:
        """Makes a valid call that completes a frame."""
        frame = call(self.subject, 1)
        assert frame is not None
        assert frame.dtype == self.dtype
        assert frame.shape == (self.k, 3)
        assert np.isfinite(frame).all()
        state = self.subject.state()
        seen = Accepted(call, frame.copy(), *self.seen(self.subject))
        self.subject.restore(state)
        assert self.subject.state() == state
        assert self.seen(self.subject)[1] == seen.numbers
        self.accepted.append(seen)
        return frame

    def seen(self, subject: Any) -> tuple[Array | None, tuple[float, ...]]:
        numbers = tuple(getattr(subject.report, name) for name in NUMBERS)
        return subject.standard_error.copy() if self.uncertainty else None, numbers

    def teardown(self) -> None:
        """Repeats what counted, in another unit."""
        if not hasattr(self, "accepted"):
            return
        other = self.make(self.twin_scale)
        for call, frame, lengths, numbers in self.accepted:
            again = call(other, self.twin_scale)
            assert (again is None) == (frame is None)
            if again is None or frame is None:
                continue
            self.check_scaled(again, frame)
            lengths_again, numbers_again = self.seen(other)
            np.testing.assert_array_equal(numbers_again, numbers)
            if lengths is not None and lengths_again is not None:
                self.check_scaled(lengths_again, lengths)

    def check_scaled(self, again: Array, values: Array) -> None:
        """Checks that lengths agree bit for bit, but for those too small to be a normal float32."""
        scaled = again.astype(np.float64) / self.twin_scale
        np.testing.assert_array_equal(
            np.where(np.abs(scaled) < 2.0**-60 * self.unit, 0.0, scaled),
            np.where(np.abs(values) < 2.0**-60 * self.unit, 0.0, values),
        )

    def accept_reset(self, points: Array) -> None:
        """Starts anew, as one does that is made with these points."""

        def reset(c: Any, scale: float) -> None:
            c.reset(times(points, scale))

        reset(self.subject, 1)
        first, self.first = self.first, points.astype(self.dtype)
        try:
            assert self.subject.state() == self.make(1).state()
        except ValueError as error:  # a reset does not ask for the size of the training
            if "training: its size" not in str(error):
                raise
        self.first = first
        self.accepted.append(Accepted(reset, None, None, ()))
        self.age[:] = 0

    @rule()
    def save(self) -> None:
        self.saved.append((self.subject.state(), self.age.copy(), len(self.accepted)))

    @precondition(lambda self: self.saved)
    @rule(data=st.data(), how=st.sampled_from(["here", "elsewhere", *COPIES]))
    def restore(self, data: st.DataObject, how: str | Callable[[Any], Any]) -> None:
        state, age, n = data.draw(st.sampled_from(self.saved))
        self.age = age.copy()
        self.accepted = self.accepted[:n]
        self.saved = [one for one in self.saved if one[2] <= n]
        if how == "elsewhere":
            self.subject = self.make(1)
        elif not isinstance(how, str):
            before, left = self.subject.state(), self.subject
            self.subject = how(left)
            assert self.subject.state() == before
            assert self.subject.settings == left.settings
            left.skip()  # which does not concern the copy
            assert self.subject.state() == before
        self.subject.restore(state)
        assert self.subject.state() == state

    @invariant()
    def shows_copies(self) -> None:
        """Checks that returned arrays are not shared."""
        if hasattr(self, "accepted"):
            self.subject.age[:] = -5
            self.subject.generation[:] = -5
            np.testing.assert_array_equal(self.subject.age, self.age)

    def scan(self, data: st.DataObject) -> tuple[Array, Array]:
        """Points of the moved surface, or of anything, and directions."""
        rng = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))
        n = data.draw(st.sampled_from([0, 1, 3, 50, 400]))
        pose = self.moving(data.draw(st.sampled_from(["rests", "turns", "bends"])), 3)
        corners = pose[data.draw(st.integers(0, 2))].astype(np.float64)[self.faces]
        corners = corners[rng.integers(len(self.faces), size=n)]
        points = np.einsum("ni,nij->nj", rng.dirichlet([1, 1, 1], size=n), corners)
        if not self.tame:
            spread = data.draw(st.sampled_from([0.0, 0.1, 10.0, 1e6])) * self.unit
            points += spread * rng.normal(size=points.shape)
        corners = corners / self.unit
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        return points.astype(data.draw(st.sampled_from([np.float32, np.float64]))), normals

    def frame(self, call: Call) -> None:
        before = self.subject.state()
        try:
            self.accept(call)
        except ValueError as error:
            if "is far from the first scan" not in str(error):
                raise
            assert self.subject.state() == before
            return
        self.check_history(self.subject.observed)

    @rule(data=st.data())
    def push(self, data: st.DataObject) -> None:
        points, normals = self.scan(data)
        length = data.draw(st.sampled_from([0.0, 1.0, 2.0**-90]))
        with_normals, with_viewpoints = data.draw(st.booleans()), data.draw(st.booleans())
        sensors = self.first.mean(axis=0) + 5 * self.unit * np.array([[0.0, 0, 1], [1, 1, -1]])

        def push(c: Any, scale: float) -> Array:
            given = length * normals if with_normals else None
            viewpoints = times(sensors, scale) if with_viewpoints else None
            return np.asarray(c.push(times(points, scale), given, viewpoints=viewpoints))

        self.frame(push)

    @rule(data=st.data())
    def push_depth(self, data: st.DataObject) -> None:
        """Images of the points, from two sides."""
        points, _ = self.scan(data)
        height, width = data.draw(st.sampled_from([(1, 1), (12, 16), (24, 32)]))
        focal = 0.8 * width
        intrinsics = np.array([[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]])
        centre = self.first.astype(np.float64).mean(axis=0)
        away = 2 * np.linalg.norm(self.first - centre, axis=1).max() + self.unit
        images, poses = [], []
        for back in (np.eye(3), np.diag([-1.0, 1, -1])):
            pose = np.eye(4)
            pose[:3, :3] = back @ np.diag([1.0, -1, -1])
            pose[:3, 3] = centre + away * back[:, 2]
            local = (points - pose[:3, 3]) @ pose[:3, :3]
            local = local[local[:, 2] > 0.01 * away]
            column, row, _ = np.floor(local @ intrinsics.T / local[:, 2:]).T.astype(int)
            inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
            depth = np.full((height, width), np.inf)
            np.minimum.at(depth, (row[inside], column[inside]), local[inside, 2])
            depth[np.isinf(depth)] = data.draw(st.sampled_from([0.0, np.nan]))
            images.append(depth.astype(np.float32))
            poses.append(pose)

        def push(c: Any, scale: float) -> Array:
            there = [pose.copy() for pose in poses]
            for pose in there:
                pose[:3, 3] *= scale
            scaled = [times(image, scale) for image in images]
            return np.asarray(c.push_depth(scaled, [intrinsics] * 2, there))

        self.frame(push)

    @rule()
    def skip(self) -> None:
        self.frame(lambda c, _: c.skip())

    @rule(n=st.integers(0, 2))
    def reset(self, n: int) -> None:
        self.accept_reset(self.moving("bends", 3)[n])


TestTracker = TrackerCalls.TestCase
TestTracker.settings = settings(max_examples=30 * LONGER, stateful_step_count=15)
