"""Completers and trackers under random calls, valid and invalid, compared with a model and a twin.

The twin is a second one that works in another unit and with packed arrays, and that
receives only the calls that counted: none that was refused, and none that a restored state undid.
Since units differ by powers of two, it must agree bit for bit.
"""

from collections.abc import Callable
from dataclasses import asdict
from typing import Any, NamedTuple

import numpy as np
import pytest
from conftest import LONGER
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule
from meshes import EVENTS, Array, masks, meshes, sheet, turned
from reference import directed_edges, edges_to
from streams import COPIES

import dynmesh

Subject = dynmesh.Completer | dynmesh.Tracker


class Place(NamedTuple):
    """Where a scene is, and in which unit its lengths are."""

    unit: float = 1.0
    angle: float = 0.0
    shift: float = 0.0

    def points(self, points: Array) -> Array:
        with np.errstate(invalid="ignore", over="ignore"):  # what is not known may be infinite
            if self.angle or self.shift:
                points = turned(points.astype(np.float64), self.angle) + self.shift
            scaled: Array = points * points.dtype.type(self.unit)
        return scaled


HERE = Place()
Call = Callable[[Any, Place], Array | None]


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


def told_by(subject: Subject) -> str:
    """What it tells of its last frame, but for the times: text, in which NaN equals NaN."""
    report = {**asdict(subject.report), "n_frames": subject.n_frames}
    return repr({name: value for name, value in report.items() if not name.endswith("seconds")})


class AnyCalls(RuleBasedStateMachine):
    """What holds for completers and trackers alike."""

    def make(self, place: Place) -> Subject:
        raise NotImplementedError

    def bad_calls(self, data: st.DataObject) -> list[Callable[[], Any]]:
        raise NotImplementedError

    def begin(self, data: st.DataObject) -> None:
        """Draws a mesh somewhere, and its subject."""
        self.faces, first = data.draw(st.one_of(meshes(), meshes(200), st.builds(sheet, SIZES)))
        self.k = len(first)
        self.dtype = data.draw(st.sampled_from([np.float32, np.float64]))
        self.tame = data.draw(st.booleans())
        angle, shift = data.draw(ANGLES), data.draw(SHIFTS)
        units = st.integers(*UNITS[self.dtype]).map(lambda power: 2.0**power)
        self.unit = data.draw(units)
        self.first = Place(self.unit, angle, shift).points(first).astype(self.dtype)
        self.draw_settings(data)
        self.subject: Any = self.make(HERE)
        self.age = np.zeros(self.k, np.int32)
        self.accepted: list[Accepted] = []
        self.saved: list[tuple[bytes, Array, int, str]] = []
        self.twin_unit = data.draw(units) / self.unit

    def draw_settings(self, data: st.DataObject) -> None:
        self.uncertainty = data.draw(st.booleans())
        kind = data.draw(st.sampled_from([None, "bends", "turns", "rests"]))
        self.training = None if kind is None else self.moving(kind, 6)

    def moving(self, kind: str, n: int) -> Array:
        """Frames that bend, only turn, or only repeat frame 0."""
        frames = [self.first.astype(np.float64)] * n
        if kind != "rests":
            frames = [turned(frame, 0.1 * i) for i, frame in enumerate(frames)]
        if kind == "bends":
            frames = [f + 0.1 * i * self.unit * np.sin(f / self.unit) for i, f in enumerate(frames)]
        return np.stack(frames).astype(self.dtype)

    def given(self, place: Place) -> tuple[Array, Array | None]:
        """Frame 0 and the training frames in another place."""
        if self.training is None:
            return place.points(self.first), None
        return place.points(self.first), np.stack([place.points(f) for f in self.training])

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
        frame = call(self.subject, HERE)
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
        twin = Place(self.twin_unit)
        other = self.make(twin)
        for call, frame, lengths, numbers in self.accepted:
            again = call(other, twin)
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
        scaled = again.astype(np.float64) / self.twin_unit
        np.testing.assert_array_equal(
            np.where(np.abs(scaled) < 2.0**-60 * self.unit, 0.0, scaled),
            np.where(np.abs(values) < 2.0**-60 * self.unit, 0.0, values),
        )

    def accept_reset(self, points: Array) -> None:
        """Starts anew, as one does that is made with these points."""

        def reset(c: Any, place: Place) -> None:
            c.reset(place.points(points))

        reset(self.subject, HERE)
        first, self.first = self.first, points.astype(self.dtype)
        try:
            assert self.subject.state() == self.make(HERE).state()
        except ValueError as error:  # a reset does not ask for the size of the training
            if "training: its size" not in str(error):
                raise
        self.first = first
        self.accepted.append(Accepted(reset, None, None, ()))
        self.age[:] = 0

    @rule()
    def save(self) -> None:
        told = told_by(self.subject)
        self.saved.append((self.subject.state(), self.age.copy(), len(self.accepted), told))

    @precondition(lambda self: self.saved)
    @rule(data=st.data(), how=st.sampled_from(["here", "elsewhere", *COPIES]))
    def restore(self, data: st.DataObject, how: str | Callable[[Any], Any]) -> None:
        state, age, n, told = data.draw(st.sampled_from(self.saved))
        self.age = age.copy()
        self.accepted = self.accepted[:n]
        self.saved = [one for one in self.saved if one[2] <= n]
        if how == "elsewhere":
            self.subject = self.make(HERE)
        elif not isinstance(how, str):
            before, left = self.subject.state(), self.subject
            self.subject = how(left)
            assert self.subject.state() == before
            assert self.subject.settings == left.settings
            left.skip()  # which does not concern the copy
            assert self.subject.state() == before
        self.subject.restore(state)
        assert self.subject.state() == state
        assert told_by(self.subject) == told

    @rule(data=st.data())
    def misuse(self, data: st.DataObject) -> None:
        """Makes a bad call, which must be refused and change nothing."""
        state = bytearray(self.subject.state())
        state[data.draw(st.integers(0, len(state) - 1))] ^= 1
        bad_calls: list[Callable[[], Any]] = [
            lambda: self.subject.restore(state),
            lambda: self.subject.restore(state[:-1]),
            lambda: self.subject.restore(b""),
            lambda: self.subject.restore("state"),
            *self.bad_calls(data),
        ]
        before = self.subject.state()
        with pytest.raises((ValueError, TypeError)):
            data.draw(st.sampled_from(bad_calls))()
        assert self.subject.state() == before

    @invariant()
    def shows_copies(self) -> None:
        """Checks that returned arrays are not shared."""
        if hasattr(self, "accepted"):
            self.subject.age[:] = -5
            self.subject.generation[:] = -5
            np.testing.assert_array_equal(self.subject.age, self.age)


class CompleterCalls(AnyCalls):
    """Sequences of calls of a completer."""

    @initialize(data=st.data())
    def begin(self, data: st.DataObject) -> None:
        super().begin(data)

    def draw_settings(self, data: st.DataObject) -> None:
        self.settings: dict[str, Any] = {
            "disconnected": data.draw(st.sampled_from(["follow", "hold"]))
        }
        self.uncertainty, self.training, self.noise = False, None, None
        if data.draw(st.booleans()):
            super().draw_settings(data)
            self.noise = data.draw(st.sampled_from([None, 0.01 * self.unit]))
            self.settings |= {"method": "detail", "uncertainty": self.uncertainty}
            self.settings["reject_outliers"] = data.draw(st.booleans())
            self.settings["learn"] = self.training is None and data.draw(st.booleans())
        else:
            extra = data.draw(st.sampled_from([0, 3]))
            self.settings |= {"method": "motion", "extra_iterations": extra}
            self.settings["revisit"] = data.draw(st.booleans())

    def make(self, place: Place) -> Subject:
        noise = None if self.noise is None else self.noise * place.unit
        first, training = self.given(place)
        return dynmesh.Completer(self.faces, first, noise=noise, training=training, **self.settings)

    def points(self, data: st.DataObject, n: int) -> Array:
        rng = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))
        kind = data.draw(st.sampled_from(["rests", "turns", "bends"]))
        noise = data.draw(st.sampled_from([0.0, 0.1])) * self.unit
        points = self.moving(kind, 4)[data.draw(st.integers(0, 3))].astype(np.float64)
        if not self.tame:
            event = data.draw(st.sampled_from([None, None, *EVENTS]))
            noise *= data.draw(st.sampled_from([1.0, 30.0, 1e9]))
            if event is not None:
                points = points @ EVENTS[event].T
            elif data.draw(st.booleans()):
                points = points[rng.integers(0, self.k, self.k)]
        points = points[:n] + noise * rng.normal(size=(n, 3))
        # No coordinate is so small that its square would be lost in single precision.
        points = np.round(points / self.unit, 6) * self.unit
        points = points.astype(data.draw(st.sampled_from([self.dtype, np.float32, np.float64])))
        layout = data.draw(st.sampled_from(["packed", "columns", "reversed", "wide"]))
        if layout == "reversed":
            backwards: Array = points[::-1].copy()[::-1]
            return backwards
        if layout == "wide":
            return np.hstack([points, points])[:, :3]
        return np.asfortranarray(points) if layout == "columns" else points

    def frame(self, known: Array, points: Array, call: Call) -> None:
        """Makes a valid call, in which `points` are observed where `known`."""
        result = self.accept(call)
        if self.settings.get("reject_outliers"):
            anchors = self.subject.generation == 0
            assert not (anchors & ~known).any()
            known = anchors
        if self.noise is None:
            assert result[known].tobytes() == points.astype(self.dtype)[known].tobytes()
        self.check_history(known)

    @rule(data=st.data(), in_place=st.booleans())
    def push(self, data: st.DataObject, in_place: bool) -> None:
        points, known = self.points(data, self.k), data.draw(masks(self.k))
        points[~known] = data.draw(st.sampled_from([np.nan, np.inf, 1e30, 0.0]))
        if in_place and points.dtype == self.dtype:
            self.frame(known, points, lambda c, p: _into(c.push, p.points(points).copy(), known))
        else:
            self.frame(known, points, lambda c, p: c.push(p.points(points), known))

    @rule(data=st.data())
    def push_rows(self, data: st.DataObject) -> None:
        points, known = self.points(data, self.k), data.draw(masks(self.k))
        points[~known, data.draw(st.integers(0, 2))] = np.nan
        self.frame(known, points, lambda c, p: c.push(p.points(points)))

    @rule(data=st.data())
    def push_sparse(self, data: st.DataObject) -> None:
        known = data.draw(masks(self.k))
        rng = np.random.default_rng(data.draw(st.integers(0, 99)))
        points = self.points(data, self.k)
        indices = rng.permutation(np.flatnonzero(known))

        def push(c: Any, place: Place) -> Array:  # the twins with a mask
            if c is self.subject:
                return np.asarray(c.push_sparse(indices, place.points(points[indices])))
            return np.asarray(c.push(place.points(points), known))

        self.frame(known, points, push)

    @rule()
    def skip(self) -> None:
        nothing = np.zeros(self.k, bool)
        self.frame(nothing, np.zeros((self.k, 3)), lambda c, _: c.skip())

    @rule(data=st.data())
    def reset(self, data: st.DataObject) -> None:
        points = self.points(data, self.k)
        edges = points[self.faces] - points[np.roll(self.faces, 1, axis=1)]
        if edges.any():  # without, there is no length that results could scale with
            self.accept_reset(points)

    def bad_calls(self, data: st.DataObject) -> list[Callable[[], Any]]:
        k, c = self.k, self.subject
        good = np.zeros((k, 3), self.dtype)
        bad = good.copy()
        bad[data.draw(st.integers(0, k - 1))] = data.draw(st.sampled_from([np.nan, -np.inf]))
        room = np.zeros((k + 1, 3), self.dtype)
        shifted = np.zeros(3 * k + 1, self.dtype)
        return [
            lambda: c.push(room),
            lambda: c.push(good.astype(int)),
            lambda: c.push(bad, np.ones(k, bool)),
            lambda: c.push(good, np.ones(k - 1, bool)),
            lambda: c.push(good, out=room),
            lambda: c.push(shifted[:-1].reshape(k, 3), out=shifted[1:].reshape(k, 3)),
            lambda: c.push_sparse(np.array([k]), good[:1]),
            lambda: c.push_sparse(np.array([0, 0]), np.zeros((2, 3))),
            lambda: c.skip(out=room),
            lambda: c.reset(bad),
        ]


class TrackerCalls(AnyCalls):
    """Sequences of calls of a tracker."""

    @initialize(data=st.data())
    def begin(self, data: st.DataObject) -> None:
        super().begin(data)

    def draw_settings(self, data: st.DataObject) -> None:
        super().draw_settings(data)
        self.resolution = data.draw(st.sampled_from(["best", 20]))

    def make(self, place: Place) -> Subject:
        first, training = self.given(place)
        options: Any = {"training": training, "uncertainty": self.uncertainty}
        options["resolution"] = self.resolution
        return dynmesh.Tracker(self.faces, first, **options)

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

        def push(c: Any, place: Place) -> Array:
            given: Array | None = turned(length * normals, place.angle)
            viewpoints = place.points(sensors) if with_viewpoints else None
            tracked: Array = c.push(
                place.points(points), given if with_normals else None, viewpoints=viewpoints
            )
            return tracked

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

        def push(c: Any, place: Place) -> Array:
            there = [pose.copy() for pose in poses]
            for pose in there:
                pose[:3, :3] = turned(pose[:3, :3].T, place.angle).T
                pose[:3, 3] = place.points(pose[None, :3, 3])[0]
            scaled = [image * np.float32(place.unit) for image in images]
            tracked: Array = c.push_depth(scaled, [intrinsics] * 2, there)
            return tracked

        self.frame(push)

    @rule()
    def skip(self) -> None:
        self.frame(lambda c, _: c.skip())

    @rule(n=st.integers(0, 2))
    def reset(self, n: int) -> None:
        self.accept_reset(self.moving("bends", 3)[n])

    def bad_calls(self, data: st.DataObject) -> list[Callable[[], Any]]:
        c, good = self.subject, np.zeros((4, 3))
        bad = good.copy()
        bad[data.draw(st.integers(0, 3))] = data.draw(st.sampled_from([np.nan, -np.inf, 1e201]))
        depth, intrinsics, pose = np.ones((2, 3)), np.eye(3), np.eye(4)
        return [
            lambda: c.push(bad),
            lambda: c.push(good, bad),
            lambda: c.push(good, viewpoints=bad),
            lambda: c.push(good, out=np.zeros((self.k + 1, 3), self.dtype)),
            lambda: c.push_depth(-depth, intrinsics, pose),
            lambda: c.push_depth(depth, intrinsics, 2 * pose),
            lambda: c.skip(out=np.zeros((self.k, 3), int)),
            lambda: c.reset(np.full((self.k, 3), np.nan)),
        ]


def _into(push: Callable[..., Array], points: Array, known: Array) -> Array:
    result = push(points, known, out=points)
    assert result is points
    return result


TestCompleter, TestTracker = CompleterCalls.TestCase, TrackerCalls.TestCase
TestCompleter.settings = settings(max_examples=60 * LONGER, stateful_step_count=30)
TestTracker.settings = settings(max_examples=30 * LONGER, stateful_step_count=15)
