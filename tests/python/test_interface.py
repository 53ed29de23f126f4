"""The Python interface: arguments, results and errors."""

import subprocess
import sys
import threading
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from meshes import Mesh, join, sheet, turned

import dynmesh


@pytest.fixture
def completer(mesh: Mesh) -> dynmesh.Completer:
    return dynmesh.Completer(mesh.faces, mesh.vertices)


def test_importing_loads_numpy_alone() -> None:
    code = (
        "import sys, numpy; before = set(sys.modules); import dynmesh;"
        "new = {m.partition('.')[0] for m in set(sys.modules) - before};"
        "print(sorted(new - set(sys.stdlib_module_names) - {'dynmesh', 'numpy'}))"
    )
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert loaded.stdout.strip() == "[]"


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_the_dtype_of_the_first_frame_stays(mesh: Mesh, dtype: Any) -> None:
    completer = dynmesh.Completer(mesh.faces, mesh.vertices.astype(dtype))
    for points in (mesh.vertices, mesh.vertices.astype(np.float32), mesh.vertices.tolist()):
        assert completer.push(points).dtype == dtype
    assert completer.dtype == dtype
    assert completer.n_vertices == len(mesh.vertices)


def test_any_layout_is_taken(mesh: Mesh, rng: np.random.Generator) -> None:
    k = len(mesh.vertices)
    points = turned(mesh.vertices, 0.3)
    known = rng.random(k) < 0.4
    expected = dynmesh.Completer(mesh.faces, mesh.vertices).push(points, known)

    packed = np.zeros(k, [("tag", "u1"), ("xyz", "<f8", 3), ("seen", "?")])  # misaligned
    packed["xyz"], packed["seen"] = points, known
    aligned = np.zeros(k, np.dtype([("seen", "?"), ("xyz", "<f8", 3)], align=True))
    aligned["xyz"], aligned["seen"] = points, known
    wide = np.zeros((2 * k, 6))
    wide[::-2, ::2] = points
    for given, mask in [
        (np.asfortranarray(points), known),
        (wide[::-2, ::2], known),
        (points.astype(">f8"), known),
        (packed["xyz"], packed["seen"]),
        (aligned["xyz"], aligned["seen"]),
        (points.tolist(), known.tolist()),
    ]:
        for faces in (mesh.faces, mesh.faces.astype(np.uint16), np.asfortranarray(mesh.faces)):
            completer = dynmesh.Completer(faces, mesh.vertices)
            np.testing.assert_array_equal(completer.push(given, mask), expected)

    completer = dynmesh.Completer(mesh.faces, mesh.vertices)
    assert completer.push(aligned["xyz"], aligned["seen"], out=aligned["xyz"]) is not None
    np.testing.assert_array_equal(aligned["xyz"], expected)


def test_broadcast_arrays_are_taken(mesh: Mesh) -> None:
    """Broadcasting gives equal masks with strides of 0, which the core refuses."""
    k = len(mesh.vertices)
    place = np.array([1.0, 2.0, 3.0])
    whole = dynmesh.Completer(mesh.faces, mesh.vertices)
    views = dynmesh.Completer(mesh.faces, mesh.vertices)
    spread = np.broadcast_to(place, (k, 3))
    everyone = np.broadcast_to(np.array(True), (k,))
    expected = whole.push(np.tile(place, (k, 1)), np.ones(k, bool))
    np.testing.assert_array_equal(views.push(spread, everyone), expected)
    same_axes = np.broadcast_to(np.arange(float(k))[:, None], (k, 3))
    expected = whole.push(same_axes.copy())
    np.testing.assert_array_equal(views.push(same_axes), expected)
    sparse = np.broadcast_to(place, (4, 3))
    expected = whole.push_sparse(np.arange(4), sparse.copy())
    np.testing.assert_array_equal(views.push_sparse(np.arange(4), sparse), expected)
    views.reset(spread)
    np.testing.assert_array_equal(views.skip(), spread)
    np.testing.assert_array_equal(dynmesh.Completer(mesh.faces, spread).skip(), spread)
    error = dynmesh.metrics.nmsve(mesh.faces, mesh.vertices, spread)
    assert error == dynmesh.metrics.nmsve(mesh.faces, mesh.vertices, spread.copy()) > 0


def test_float64_beyond_the_range_of_float32_is_too_large_and_not_missing(mesh: Mesh) -> None:
    completer = dynmesh.Completer(mesh.faces, mesh.vertices.astype(np.float32))
    points = mesh.vertices.copy()
    points[5, 1] = -1e300
    before = completer.state()
    with pytest.raises(ValueError, match=r"points: row 5 is at \(.*, -3\.40282347e\+38, .*1e18"):
        completer.push(points)
    assert completer.state() == before
    known = np.ones(len(points), bool)
    known[5] = False
    assert np.isfinite(completer.push(points, known)).all()
    points[5, 1] = -np.inf
    completer.push(points)
    assert completer.report.known == len(points) - 1


def test_missing_rows_are_the_ones_that_are_not_finite(
    mesh: Mesh, rng: np.random.Generator
) -> None:
    points = turned(mesh.vertices, 0.3)
    known = rng.random(len(points)) < 0.4
    holed = points.copy()
    holed[np.flatnonzero(~known), rng.integers(0, 3, (~known).sum())] = np.nan
    holed[np.argmin(known)] = -np.inf
    first, second = (dynmesh.Completer(mesh.faces, mesh.vertices) for _ in range(2))
    np.testing.assert_array_equal(first.push(holed), second.push(points, known))


def test_sparse_input_equals_masked_input(mesh: Mesh, rng: np.random.Generator) -> None:
    points = turned(mesh.vertices, 0.3)
    indices = rng.permutation(len(points))[:11]
    known = np.isin(np.arange(len(points)), indices)
    masked = dynmesh.Completer(mesh.faces, mesh.vertices).push(points, known)
    for dtype in (np.int64, np.int32, np.uint8):
        completer = dynmesh.Completer(mesh.faces, mesh.vertices)
        sparse = completer.push_sparse(indices.astype(dtype), points[indices])
        np.testing.assert_array_equal(sparse, masked)
    completer = dynmesh.Completer(mesh.faces, mesh.vertices)
    nothing = completer.push_sparse([], np.empty((0, 3)))  # type: ignore[arg-type]
    np.testing.assert_array_equal(nothing, mesh.vertices)


def test_without_out_every_array_is_new(completer: dynmesh.Completer, mesh: Mesh) -> None:
    first = completer.push(mesh.vertices)
    second = completer.skip()
    assert not np.shares_memory(first, second)
    first[:] = 0
    np.testing.assert_array_equal(completer.skip(), mesh.vertices)
    assert not np.shares_memory(completer.age, completer.age)


def test_out_is_written_and_returned(completer: dynmesh.Completer, mesh: Mesh) -> None:
    out = np.empty_like(mesh.vertices)
    assert completer.push(mesh.vertices, out=out) is out
    assert completer.skip(out=out) is out
    assert completer.push_sparse(np.array([3]), mesh.vertices[:1], out=out) is out
    columns = np.asfortranarray(np.empty_like(mesh.vertices))
    completer.push(mesh.vertices, out=columns)
    np.testing.assert_array_equal(columns, mesh.vertices)
    points = turned(mesh.vertices, 0.1)
    points[3] = np.nan
    assert completer.push(points, out=points) is points
    assert np.isfinite(points).all()


def test_age_and_generation(completer: dynmesh.Completer, mesh: Mesh) -> None:
    known = np.zeros(len(mesh.vertices), bool)
    known[0] = True
    completer.push(mesh.vertices, known)
    completer.push(mesh.vertices, known)
    assert completer.generation.dtype == completer.age.dtype == np.int32
    assert completer.generation[0] == 0
    assert completer.generation[1] == 1
    assert completer.generation.max() == completer.report.iterations > 3
    assert completer.age[0] == 0
    assert completer.age[-1] == 2
    assert "known=1" in repr(completer.report)
    completer.reset(mesh.vertices)
    assert not completer.age.any()
    assert not completer.generation.any()


def test_state_continues_with_the_same_result(mesh: Mesh, rng: np.random.Generator) -> None:
    first = dynmesh.Completer(mesh.faces, mesh.vertices)
    frames = [turned(mesh.vertices, 0.1 * i) for i in range(6)]
    masks = rng.random((6, len(mesh.vertices))) < 0.3
    for points, known in zip(frames[:3], masks[:3], strict=True):
        first.push(points, known)
    second = dynmesh.Completer(mesh.faces, mesh.vertices)
    second.restore(first.state())
    assert first.report.seconds > 0
    assert second.report.seconds == 0
    assert second.state() == first.state()
    for points, known in zip(frames[3:], masks[3:], strict=True):
        np.testing.assert_array_equal(first.push(points, known), second.push(points, known))
    np.testing.assert_array_equal(first.age, second.age)
    with pytest.raises(ValueError, match="state: truncated"):
        second.restore(first.state()[:50])
    second.restore(bytearray(first.state()))
    damaged = bytearray(first.state())
    damaged[len(damaged) // 3] ^= 1
    with pytest.raises(ValueError, match="state: damaged"):
        second.restore(damaged)
    with pytest.raises(TypeError, match="state: must be bytes, not str"):
        second.restore("state")  # type: ignore[arg-type]


def test_complete_is_a_generator_in_constant_memory(mesh: Mesh, rng: np.random.Generator) -> None:
    given = 0

    def frames() -> Any:
        nonlocal given
        for i in range(1000):
            given += 1
            yield turned(mesh.vertices, 0.01 * i)

    masks = (rng.random(len(mesh.vertices)) < 0.5 if i else np.ones(49, bool) for i in range(1000))
    stream = dynmesh.complete(mesh.faces, frames(), masks)
    np.testing.assert_array_equal(next(stream), mesh.vertices)
    next(stream)
    assert given == 2
    assert len(list(stream)) == 998

    again = dynmesh.Completer(mesh.faces, mesh.vertices, extra_iterations=3)
    points = turned(mesh.vertices, 0.2)
    points[5:20] = np.nan
    completed = list(dynmesh.complete(mesh.faces, [mesh.vertices, points], extra_iterations=3))
    np.testing.assert_array_equal(completed[1], again.push(points))


@pytest.mark.parametrize(
    ("frames", "known", "message"),
    [
        ([], None, "frames: is empty"),
        ([np.full((49, 3), np.nan)], None, "first_frame: vertex 0 is at"),
        ([np.zeros((49, 3))] * 2, [np.ones(49, bool)], "known: ends before frame 1"),
        ([np.zeros((49, 3))], [np.ones(49, bool)] * 2, "frames: ends before frame 1"),
        (
            [np.zeros((49, 3))],
            [np.arange(49) != 7],
            "known: vertex 7 is missing, but frame 0 must be complete",
        ),
        ([np.zeros((49, 3)), np.zeros((48, 3))], None, "frame 1: points: has 48 rows"),
    ],
)
def test_complete_says_which_frame_is_bad(
    mesh: Mesh, frames: Any, known: Any, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        list(dynmesh.complete(mesh.faces, frames, known))


Call = Callable[[dynmesh.Completer, Any, Any], Any]


@pytest.mark.parametrize(
    ("error", "message", "call"),
    [
        (
            ValueError,
            r"points: has 48 rows, but the mesh has 49",
            lambda c, p, m: c.push(p[:48], m),
        ),
        (
            ValueError,
            r"points: must have shape \(k, 3\), not \(49, 2\)",
            lambda c, p, m: c.push(p[:, :2], m),
        ),
        (
            ValueError,
            r"points: must have shape \(k, 3\), not \(147,\)",
            lambda c, p, m: c.push(p.ravel(), m),
        ),
        (
            TypeError,
            r"points: must be float32 or float64, not int64",
            lambda c, p, m: c.push(p.astype(int), m),
        ),
        (
            TypeError,
            r"points: must be float32 or float64, not complex128",
            lambda c, p, m: c.push(p.astype(complex), m),
        ),
        (
            TypeError,
            r"points: must be float32 or float64, not object",
            lambda c, _p, m: c.push(None, m),
        ),
        (ValueError, r"points: row 5 is at \(.*nan", lambda c, p, m: c.push(holed(p, np.nan), m)),
        (ValueError, r"points: row 5 is at \(.*inf", lambda c, p, m: c.push(holed(p, np.inf), m)),
        (ValueError, r"known: has 48 rows", lambda c, p, m: c.push(p, m[:48])),
        (
            ValueError,
            r"known: must have shape \(k,\), not \(49, 1\)",
            lambda c, p, m: c.push(p, m[:, None]),
        ),
        (TypeError, r"known: must be bool, not int64", lambda c, p, m: c.push(p, m.astype(int))),
        (
            TypeError,
            r"known: must be bool, not float64",
            lambda c, p, m: c.push(p, m.astype(float)),
        ),
        (
            TypeError,
            r"out: must be a numpy array, not list",
            lambda c, p, m: c.push(p, m, out=p.tolist()),
        ),
        (
            TypeError,
            r"out: must be float64, the dtype of first_frame, not float32",
            lambda c, p, m: c.push(p, m, out=p.astype(np.float32)),
        ),
        (
            ValueError,
            r"out: must have shape \(k, 3\)",
            lambda c, p, m: c.push(p, m, out=p.T.copy()),
        ),
        (ValueError, r"out: has 50 rows", lambda c, p, m: c.push(p, m, out=np.empty((50, 3)))),
        (ValueError, r"out: is read-only", lambda c, p, m: c.push(p, m, out=read_only(p))),
        (
            ValueError,
            r"out: the completed frame overlaps points",
            lambda c, p, m: c.push(p, m, out=p[::-1]),
        ),
        (
            ValueError,
            r"out: the completed frame overlaps known",
            lambda c, p, _m: c.push(p, p.view(bool)[:, 0], out=p),
        ),
        (
            ValueError,
            r"out: the rows of the completed frame overlap",
            lambda c, p, m: c.push(
                p, m, out=np.lib.stride_tricks.as_strided(p.copy(), strides=(8, 8))
            ),
        ),
        (
            ValueError,
            r"indices: vertex 4 is listed twice, at positions 0 and 2",
            lambda c, p, _: c.push_sparse(np.array([4, 7, 4]), p[:3]),
        ),
        (
            ValueError,
            r"indices: position 1 holds 49, but the mesh has 49 vertices",
            lambda c, p, _: c.push_sparse(np.array([4, 49]), p[:2]),
        ),
        (
            ValueError,
            r"indices: position 0 holds -1",
            lambda c, p, _: c.push_sparse(np.array([-1]), p[:1]),
        ),
        (
            ValueError,
            r"indices: row 0 holds 4294967300",
            lambda c, p, _: c.push_sparse(np.array([2**32 + 4]), p[:1]),
        ),
        (
            TypeError,
            r"indices: must be integers, not float64",
            lambda c, p, _: c.push_sparse(np.array([4.0]), p[:1]),
        ),
        (TypeError, r"indices: must be integers, not bool", lambda c, p, m: c.push_sparse(m, p)),
        (
            ValueError,
            r"indices: must have shape \(n,\)",
            lambda c, p, _: c.push_sparse(np.array([[4]]), p[:1]),
        ),
        (
            ValueError,
            r"points: has 2 rows for 1 indices",
            lambda c, p, _: c.push_sparse(np.array([4]), p[:2]),
        ),
        (
            ValueError,
            r"points: row 1 is at",
            lambda c, p, _: c.push_sparse(np.arange(2), holed(p, np.nan)[4:6]),
        ),
        (ValueError, r"frame: vertex 5 is at", lambda c, p, _: c.reset(holed(p, np.nan))),
        (ValueError, r"frame: has 48 rows", lambda c, p, _: c.reset(p[:48])),
    ],
)
def test_bad_input_is_named_and_changes_nothing(
    completer: dynmesh.Completer, mesh: Mesh, error: type[Exception], message: str, call: Call
) -> None:
    known = np.arange(49) % 3 != 0
    completer.push(turned(mesh.vertices, 0.1), known)
    before = completer.state()
    with pytest.raises(error, match=message):
        call(completer, turned(mesh.vertices, 0.2), known)
    assert completer.state() == before
    completer.push(turned(mesh.vertices, 0.2), known)


def holed(points: Any, value: float) -> Any:
    points = points.copy()
    points[5, 1] = value
    return points


def read_only(points: Any) -> Any:
    points = points.copy()
    points.flags.writeable = False
    return points


@pytest.mark.parametrize(
    ("error", "message", "faces", "frame", "settings"),
    [
        (
            ValueError,
            r"faces: face 1 refers to vertex 3, but the mesh has 3 vertices",
            [[0, 1, 2], [1, 2, 3]],
            np.zeros((3, 3)),
            {},
        ),
        (ValueError, r"faces: face 0 refers to vertex -1", [[0, 1, -1]], np.zeros((3, 3)), {}),
        (ValueError, r"faces: row 0 holds 4294967296", [[0, 1, 2**32]], np.zeros((3, 3)), {}),
        (TypeError, r"faces: must be integers, not float64", [[0.0, 1, 2]], np.zeros((3, 3)), {}),
        (
            ValueError,
            r"faces: must have shape \(m, 3\), not \(1, 4\)",
            [[0, 1, 2, 3]],
            np.zeros((4, 3)),
            {},
        ),
        (ValueError, r"faces: is empty", np.empty((0, 3), int), np.zeros((3, 3)), {}),
        (ValueError, r"first_frame: has no vertices", np.empty((0, 3), int), np.zeros((0, 3)), {}),
        (ValueError, r"first_frame: must have shape \(k, 3\)", [[0, 1, 2]], np.zeros((3, 4)), {}),
        (
            TypeError,
            r"first_frame: must be float32 or float64, not int64",
            [[0, 1, 2]],
            np.zeros((3, 3), int),
            {},
        ),
        (
            TypeError,
            r"first_frame: must be float32 or float64, not float16",
            [[0, 1, 2]],
            np.zeros((3, 3), np.float16),
            {},
        ),
        (
            ValueError,
            r"first_frame: vertex 1 is at \(.*nan",
            [[0, 1, 2]],
            [[0, 0, 0], [0, np.nan, 0], [1, 1, 1]],
            {},
        ),
        (
            ValueError,
            r"noise: must be positive and finite, not 0",
            [[0, 1, 2]],
            np.eye(3),
            {"method": "detail", "noise": 0.0},
        ),
        (
            ValueError,
            r"method: must be 'motion' or 'detail', not 'lsm'",
            [[0, 1, 2]],
            np.eye(3),
            {"method": "lsm"},
        ),
        (
            ValueError,
            r"unseen: must be 'hold' or 'follow', not 'x'",
            [[0, 1, 2]],
            np.eye(3),
            {"unseen": "x"},
        ),
        (
            ValueError,
            r"extra_iterations: must be from 0 to 1000000, not -1",
            [[0, 1, 2]],
            np.eye(3),
            {"extra_iterations": -1},
        ),
        (
            ValueError,
            r"noise: requires method='detail'",
            [[0, 1, 2]],
            np.eye(3),
            {"noise": 0.1},
        ),
        (
            ValueError,
            r"reject_outliers: requires method='detail'",
            [[0, 1, 2]],
            np.eye(3),
            {"reject_outliers": True},
        ),
        (
            ValueError,
            r"threads: must be from 1 to 256, not 0",
            [[0, 1, 2]],
            np.eye(3),
            {"threads": 0},
        ),
        (
            TypeError,
            r"extra_iterations: must be an integer, not float",
            [[0, 1, 2]],
            np.eye(3),
            {"extra_iterations": 1.5},
        ),
        (
            ValueError,
            r"extra_iterations: is out of range, 1099511627776",
            [[0, 1, 2]],
            np.eye(3),
            {"extra_iterations": 2**40},
        ),
        (
            TypeError,
            r"revisit: must be True or False, not NoneType",
            [[0, 1, 2]],
            np.eye(3),
            {"revisit": None},
        ),
        (TypeError, r"unseen: must be a string, not int", [[0, 1, 2]], np.eye(3), {"unseen": 1}),
        (
            TypeError,
            r"first_frame: is a masked array",
            [[0, 1, 2]],
            np.ma.masked_invalid(np.eye(3)),
            {},
        ),
        (
            TypeError,
            r"Completer\(\): got an unexpected keyword argument 'speed'; it takes \(faces",
            [[0, 1, 2]],
            np.eye(3),
            {"speed": 1},
        ),
    ],
)
def test_construction_from_bad_input_is_refused(
    error: type[Exception], message: str, faces: Any, frame: Any, settings: Any
) -> None:
    with pytest.raises(error, match=message):
        dynmesh.Completer(faces, frame, **settings)


def test_the_topology_report_lists_problems() -> None:
    mesh = join(sheet(3), sheet(2, 5.0))
    faces = np.concatenate([mesh.faces, [[0, 0, 1], mesh.faces[0]]])
    vertices = np.concatenate([mesh.vertices, [[9, 9, 9]]])
    report = dynmesh.Completer(faces, vertices).topology
    assert (report.components, report.isolated_vertices, report.boundary_edges) == (3, 1, 12)
    assert [face.index for face in report.refused_faces] == [10, 11]
    assert [face.kind for face in report.refused_faces] == ["degenerate", "duplicate"]
    assert report.refused_faces[1].reason == "duplicate of face 0"
    expected = "RefusedFace(index=11, kind='duplicate', reason='duplicate of face 0')"
    assert repr(report.refused_faces[1]) == expected


def test_one_completer_in_two_threads_is_refused_or_served() -> None:
    mesh = sheet(60)
    completer = dynmesh.Completer(mesh.faces, mesh.vertices)
    known = np.random.default_rng(0).random(len(mesh.vertices)) < 0.1
    outcomes: list[str] = []

    def hammer() -> None:
        for _ in range(100):
            try:
                completer.push(mesh.vertices, known)
                outcomes.append("served")
            except RuntimeError as error:
                outcomes.append(str(error))

    threads = [threading.Thread(target=hammer) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(outcomes) == 300
    refused = {outcome for outcome in outcomes if outcome != "served"}
    assert all("in use by another thread" in outcome for outcome in refused)
    np.testing.assert_allclose(completer.push(mesh.vertices, known), mesh.vertices, atol=1e-12)


def test_completers_in_many_threads_are_independent() -> None:
    mesh = sheet(30)
    masks = np.random.default_rng(1).random((40, len(mesh.vertices))) < 0.2
    frames = [turned(mesh.vertices, 0.02 * i) for i in range(40)]

    def run(results: list[Any]) -> None:
        completer = dynmesh.Completer(mesh.faces, mesh.vertices)
        for points, known in zip(frames, masks, strict=True):
            completed = completer.push(points, known)
        results.append(completed)

    results: list[Any] = []
    threads = [threading.Thread(target=run, args=(results,)) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(results) == 4
    for result in results[1:]:
        np.testing.assert_array_equal(result, results[0])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_threads_change_nothing(dtype: Any, shared_pieces: Callable[[], int]) -> None:
    mesh = sheet(30)
    rng = np.random.default_rng(3)
    frame = mesh.vertices.astype(dtype)
    completers = [dynmesh.Completer(mesh.faces, frame, threads=n) for n in (1, 2, 4)]
    for i in range(5):
        points = (mesh.vertices + rng.normal(size=mesh.vertices.shape) * 0.1 + i).astype(dtype)
        known = rng.random(len(points)) < 0.2
        first = completers[0].push(points, known)
        for completer in completers[1:]:
            before = shared_pieces()
            np.testing.assert_array_equal(completer.push(points, known), first)
            assert shared_pieces() > before
    assert len({completer.state() for completer in completers}) == 1
