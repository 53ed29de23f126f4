"""Cases of dynmesh.Completer."""

from typing import Any

import numpy as np

import dynmesh

from .case import Case, World

_MASKED = "masked array"


def _flipped(state: bytes, place: int) -> bytes:
    return state[:place] + bytes([state[place] ^ 1]) + state[place + 1 :]


def _with_index(world: World, value: int) -> Any:
    faces = world.faces.copy()
    faces[5, 1] = value
    return faces


def _read_only(points: Any) -> Any:
    points = points.copy()
    points.flags.writeable = False
    return points


def _unaligned() -> Any:
    return np.zeros(49 * 24 + 1, np.uint8)[1:].view(np.float64).reshape(49, 3)


def _strided(points: Any, *strides: int) -> Any:
    return np.lib.stride_tricks.as_strided(points.copy(), (49, 3), strides)


def _huge(values: list[Any], rows: int) -> Any:
    """Returns an array with any number of rows that takes no memory."""
    return np.broadcast_to(np.array(values), (rows, 3))


def _faces(given: str, faces: Any, error: type[Exception], *names: str) -> Case:
    """A case of faces, which may be a function of the world."""

    def run(world: World) -> Any:
        return dynmesh.Completer(faces(world) if callable(faces) else faces, world.vertices)

    return Case("Completer", f"`faces`: {given}", run, error, ("faces:", *names))


def _frame(given: str, frame: Any, error: type[Exception], *names: str) -> Case:
    """A case of frame 0."""

    def run(world: World) -> Any:
        return dynmesh.Completer(world.faces, frame(world) if callable(frame) else frame)

    return Case("Completer", f"`first_frame`: {given}", run, error, ("first_frame:", *names))


def _setting(settings: dict[str, Any], error: type[Exception], *names: str) -> Case:
    name = list(settings)[-1]
    given = ", ".join(f"{key}={value!r}" for key, value in settings.items())
    run = lambda world: world.make(**settings)  # noqa: E731
    return Case("Completer", f"`{given}`", run, error, (f"{name}:", *names))


construction = [
    _faces("None", None, TypeError, "object"),
    _faces("text", "abc", TypeError, "<U3"),
    _faces("none", np.empty((0, 3), int), ValueError, "is empty"),
    _faces("float64", lambda w: w.faces.astype(float), TypeError, "float64"),
    _faces("bool", lambda w: w.faces.astype(bool), TypeError, "bool"),
    _faces("objects", lambda w: w.faces.astype(object), TypeError, "object"),
    _faces("durations", lambda w: w.faces.astype("m8[s]"), TypeError, "timedelta64"),
    _faces("a masked array", lambda w: np.ma.masked_equal(w.faces, 3), TypeError, _MASKED),
    _faces(
        "rows of different lengths",
        [[0, 1, 2], [1, 2]],
        ValueError,
        "cannot be converted to an array",
    ),
    _faces("quads, (m, 4)", [[0, 1, 8, 7]], ValueError, "(m, 3)", "(1, 4)"),
    _faces("one axis", lambda w: w.faces.ravel(), ValueError, "(m, 3)", "(216,)"),
    _faces("a number", 3, ValueError, "(m, 3)", "()"),
    _faces("an index of k", lambda w: _with_index(w, 49), ValueError, "face 5", "vertex 49"),
    _faces("an index of -1", lambda w: _with_index(w, -1), ValueError, "face 5", "vertex -1"),
    _faces("an index of 2^40", lambda w: _with_index(w, 2**40), ValueError, "row 5", str(2**40)),
    _faces(
        "an index of 2^64 - 1",
        lambda _: np.array([[0, 1, 2**64 - 1]], np.uint64),
        ValueError,
        "row 0",
        str(2**64 - 1),
    ),
    _faces("2^31 rows", lambda _: _huge([0, 1, 2], 2**31), ValueError, str(2**31)),
    _frame("None", None, TypeError, "object"),
    _frame("no vertex", np.empty((0, 3)), ValueError, "no vertices"),
    Case(
        "Completer",
        "`first_frame`: one row too few",
        lambda w: dynmesh.Completer(w.faces, w.vertices[:48]),
        ValueError,
        ("faces:", "face 71", "vertex 48", "48 vertices"),
    ),
    _frame("four columns", np.zeros((49, 4)), ValueError, "(k, 3)", "(49, 4)"),
    _frame("a whole sequence", np.zeros((2, 49, 3)), ValueError, "(k, 3)", "(2, 49, 3)"),
    _frame(
        "rows of different lengths",
        [[0, 1, 2], [1, 2]],
        ValueError,
        "cannot be converted to an array",
    ),
    _frame("integers", lambda w: w.vertices.astype(int), TypeError, "int64"),
    _frame("float16", lambda w: w.vertices.astype(np.float16), TypeError, "float16"),
    _frame("float128", lambda w: w.vertices.astype(np.longdouble), TypeError, "float128"),
    _frame("complex numbers", lambda w: w.vertices.astype(complex), TypeError, "complex128"),
    _frame("text", lambda w: w.vertices.astype(str), TypeError, "<U32"),
    _frame("dates", np.zeros((49, 3), "M8[s]"), TypeError, "datetime64"),
    _frame("a masked array", lambda w: np.ma.masked_invalid(w.vertices), TypeError, _MASKED),
    _frame("NaN in it", lambda w: w.with_value(np.nan), ValueError, "vertex 4", "nan"),
    _frame("infinity in it", lambda w: w.with_value(-np.inf), ValueError, "vertex 4", "-inf"),
    _frame(
        "1e30 in float32",
        lambda w: w.with_value(1e30).astype(np.float32),
        ValueError,
        "vertex 4",
        "e+30",
        "below 1e18",
    ),
    _frame("1e300", lambda w: w.with_value(1e300), ValueError, "vertex 4", "1e+300", "1e200"),
    _frame("2^33 rows", lambda _: _huge([0.0, 0, 0], 2**33), ValueError, str(2**33)),
    _setting({"method": "lsm"}, ValueError, "'lsm'", "'detail'"),
    _setting({"method": b"motion"}, TypeError, "bytes"),
    _setting({"method": "\ud800"}, ValueError, "ud800"),
    _setting({"disconnected": "x"}, ValueError, "'x'", "'hold'"),
    _setting({"disconnected": 1}, TypeError, "int"),
    _setting({"revisit": None}, TypeError, "NoneType"),
    _setting({"revisit": 1}, TypeError, "int"),
    _setting({"revisit": False}, ValueError, "requires method='motion'"),
    _setting({"method": "motion", "extra_iterations": -1}, ValueError, "-1"),
    _setting({"method": "motion", "extra_iterations": 10**7}, ValueError, str(10**7)),
    _setting({"method": "motion", "extra_iterations": 2**70}, ValueError, str(2**70)),
    _setting({"method": "motion", "extra_iterations": 1.0}, TypeError, "float"),
    _setting({"extra_iterations": 1}, ValueError, "requires method='motion'"),
    _setting({"method": "motion", "noise": 0.1}, ValueError, "requires method='detail'"),
    _setting({"method": "detail", "noise": 0.0}, ValueError, "not 0"),
    _setting({"method": "detail", "noise": -1e-300}, ValueError, "-1e-300"),
    _setting({"method": "detail", "noise": float("nan")}, ValueError, "nan"),
    _setting({"method": "detail", "noise": float("inf")}, ValueError, "inf"),
    _setting({"method": "detail", "noise": "0.1"}, TypeError, "str"),
    _setting({"method": "detail", "noise": True}, TypeError, "bool"),
    _setting({"method": "motion", "reject_outliers": True}, ValueError, "requires method='detail'"),
    _setting({"method": "detail", "reject_outliers": "yes"}, TypeError, "str"),
    _setting({"method": "motion", "learn": True}, ValueError, "requires method='detail'"),
    _setting({"method": "detail", "learn": 1}, TypeError, "int"),
    _setting({"method": "motion", "uncertainty": True}, ValueError, "requires method='detail'"),
    _setting({"method": "detail", "uncertainty": 1}, TypeError, "int"),
    _setting({"threads": 0}, ValueError, "not 0"),
    _setting({"threads": -1}, ValueError, "-1"),
    _setting({"threads": 10**9}, ValueError, str(10**9)),
    _setting({"threads": 2.0}, TypeError, "float"),
    _setting({"threads": True}, TypeError, "bool"),
    Case(
        "Completer",
        "`speed=1`",
        lambda w: w.make(speed=1),
        TypeError,
        ("Completer():", "'speed'", "threads=1"),
    ),
]


def _push(given: str, points: Any, error: type[Exception], *names: str) -> Case:
    return Case(
        "push", f"`points`: {given}", lambda w: w.completer.push(points(w), w.known), error, names
    )


def _known(given: str, known: Any, error: type[Exception], *names: str) -> Case:
    run = lambda w: w.completer.push(w.points, known(w))  # noqa: E731
    return Case("push", f"`known`: {given}", run, error, ("known:", *names))


def _out(given: str, out: Any, error: type[Exception], *names: str) -> Case:
    run = lambda w: w.completer.push(w.points, w.known, out=out(w))  # noqa: E731
    return Case("push", f"`out`: {given}", run, error, ("out:", *names))


def _mask_inside_out(world: World) -> Any:
    points = world.points.copy()
    return world.completer.push(points, points.view(bool)[:, 0], out=points)


pushes = [
    _push("one row too few", lambda w: w.points[:48], ValueError, "points:", "48 rows", "49"),
    _push("no row", lambda w: w.empty, ValueError, "points:", "0 rows", "49"),
    _push("two columns", lambda w: w.points[:, :2], ValueError, "points:", "(49, 2)"),
    _push("one axis", lambda w: w.points.ravel(), ValueError, "points:", "(147,)"),
    _push("a whole sequence", lambda w: w.points[None], ValueError, "points:", "(1, 49, 3)"),
    _push("None", lambda _: None, TypeError, "points:", "object"),
    _push("integers", lambda w: w.points.astype(int), TypeError, "points:", "int64"),
    _push("bool", lambda w: w.points.astype(bool), TypeError, "points:", "bool"),
    _push("complex numbers", lambda w: w.points.astype(complex), TypeError, "points:", "complex"),
    _push("text", lambda w: w.points.astype(str), TypeError, "points:", "<U32"),
    _push("objects", lambda w: w.points.astype(object), TypeError, "points:", "object"),
    _push("rows of different lengths", lambda _: [[1.0, 2], [3.0]], ValueError, "points:", "array"),
    _push(
        "a masked array", lambda w: np.ma.masked_invalid(w.points), TypeError, "points:", _MASKED
    ),
    _push("NaN, marked known", lambda w: w.with_value(np.nan), ValueError, "points: row 4", "nan"),
    _push("infinity, marked known", lambda w: w.with_value(np.inf), ValueError, "row 4", "inf"),
    _push("1e201", lambda w: w.with_value(1e201), ValueError, "row 4", "1e+201", "1e200"),
    Case(
        "push",
        "`points`: 1e300, to a completer of float32",
        lambda w: w.single.push(w.with_value(1e300), w.known),
        ValueError,
        ("points: row 4", "e+38", "below 1e18"),
    ),
    Case(
        "push",
        "`points`: 1e30, no `known`, to a completer of float32",
        lambda w: w.single.push(w.with_value(1e30).astype(np.float32)),
        ValueError,
        ("points: row 4", "e+30", "below 1e18"),
    ),
    _known("one too few", lambda w: w.known[:48], ValueError, "48 rows", "49"),
    _known("a column", lambda w: w.known[:, None], ValueError, "(k,)", "(49, 1)"),
    _known("one bool", lambda _: True, ValueError, "(k,)", "()"),
    _known("integers 0 and 1", lambda w: w.known.astype(int), TypeError, "int64", ".astype(bool)"),
    _known("float64", lambda w: w.known.astype(float), TypeError, "float64"),
    _known("a list of text", lambda _: ["yes"] * 49, TypeError, "<U3"),
    _known("a list of None", lambda _: [None] * 49, TypeError, "object"),
    _known("a masked array", lambda w: np.ma.masked_equal(w.known, True), TypeError, _MASKED),
    _out("a list", lambda w: w.points.tolist(), TypeError, "list"),
    _out("float32", lambda w: w.points.astype(np.float32), TypeError, "float64", "float32"),
    _out("of the other byte order", lambda w: w.points.astype(">f8"), TypeError, ">f8"),
    _out("one row too many", lambda _: np.empty((50, 3)), ValueError, "50 rows", "49"),
    _out("transposed", lambda w: w.points.T.copy(), ValueError, "(k, 3)", "(3, 49)"),
    _out("read-only", lambda w: _read_only(w.points), ValueError, "read-only"),
    _out("misaligned", lambda _: _unaligned(), ValueError, "aligned"),
    _out("a masked array", lambda w: np.ma.masked_invalid(w.points), TypeError, _MASKED),
    _out("`points` upside down", lambda w: w.points[::-1], ValueError, "overlaps points"),
    Case(
        "push",
        "`out`: shares memory with `known`",
        _mask_inside_out,
        ValueError,
        ("out:", "overlaps known"),
    ),
    _out("rows that overlap", lambda w: _strided(w.points, 8, 8), ValueError, "overlap"),
    _out("rows in one place", lambda w: _strided(w.points, 0, 8), ValueError, "row stride of 0"),
    _out("columns in one place", lambda w: _strided(w.points, 8, 0), ValueError, "column stride"),
]


def _sparse(given: str, indices: Any, error: type[Exception], *names: str) -> Case:
    """A case of `push_sparse` with three points at these indices."""
    run = lambda w: w.completer.push_sparse(indices, w.points[:3])  # noqa: E731
    return Case("push_sparse", f"`indices`: {given}", run, error, names)


sparse_pushes = [
    _sparse("one twice", [4, 7, 4], ValueError, "indices: vertex 4", "positions 0 and 2"),
    _sparse("one of k", [4, 7, 49], ValueError, "indices: position 2", "49"),
    _sparse("a negative one", [4, -1, 7], ValueError, "indices: position 1", "-1"),
    _sparse("one of 2^40", [4, 7, 2**40], ValueError, "indices: row 2", str(2**40)),
    _sparse("one of 2^63 + 5", np.array([2**63 + 5] * 3, np.uint64), ValueError, str(2**63 + 5)),
    _sparse("one too many", [1, 2, 3, 4], ValueError, "3 rows", "4 indices"),
    _sparse("a column", [[1], [2], [3]], ValueError, "indices:", "(n,)", "(3, 1)"),
    _sparse("float64", [1.0, 2, 3], TypeError, "indices:", "float64"),
    _sparse("a mask", np.ones(3, bool), TypeError, "indices:", "bool"),
    _sparse("None", None, TypeError, "indices:", "object"),
    Case(
        "push_sparse",
        "`points`: NaN",
        lambda w: w.completer.push_sparse([3, 5, 4], w.with_value(np.nan)[3:6]),  # type: ignore[arg-type]
        ValueError,
        ("points: row 1", "nan"),
    ),
    Case(
        "push_sparse",
        "`out`: one row too few",
        lambda w: w.completer.push_sparse(np.arange(3), w.points[:3], out=np.empty((48, 3))),
        ValueError,
        ("out:", "48 rows", "49"),
    ),
    Case(
        "skip",
        "`out`: one row too few",
        lambda w: w.completer.skip(out=np.empty((48, 3))),
        ValueError,
        ("out:", "48 rows", "49"),
    ),
    Case(
        "skip",
        "`out`: float32",
        lambda w: w.completer.skip(out=np.empty((49, 3), np.float32)),
        TypeError,
        ("out:", "float32"),
    ),
]


def _reset(given: str, frame: Any, error: type[Exception], *names: str) -> Case:
    run = lambda w: w.completer.reset(frame(w))  # noqa: E731
    return Case("reset", f"`frame`: {given}", run, error, ("frame:", *names))


def _restore(given: str, state: Any, error: type[Exception], *names: str) -> Case:
    run = lambda w: w.completer.restore(state(w))  # noqa: E731
    return Case("restore", f"`state`: {given}", run, error, ("state:", *names))


def _state(world: World) -> bytes:
    return world.completer.state()


resets_and_restores = [
    _reset("one row too few", lambda w: w.points[:48], ValueError, "48 rows", "49"),
    _reset("NaN in it", lambda w: w.with_value(np.nan), ValueError, "vertex 4", "nan"),
    _reset("1e300", lambda w: w.with_value(1e300), ValueError, "vertex 4", "1e+300"),
    _reset("integers", lambda w: w.points.astype(int), TypeError, "int64"),
    _reset("None", lambda _: None, TypeError, "object"),
    _restore("empty", lambda _: b"", ValueError, "truncated", "0 bytes"),
    _restore("another file's bytes", lambda _: b"PK" * 500, ValueError, "not a completer state"),
    _restore("without its last byte", lambda w: _state(w)[:-1], ValueError, "truncated", "5504"),
    _restore("with one byte more", lambda w: _state(w) + b"x", ValueError, "1 byte"),
    _restore("a flipped bit", lambda w: _flipped(_state(w), 200), ValueError, "damaged"),
    _restore("a flipped bit in its head", lambda w: _flipped(_state(w), 9), ValueError, "2112-bit"),
    _restore("of float32", lambda w: w.single.state(), ValueError, "32-bit", "64-bit"),
    _restore(
        "of a mesh of 3 vertices",
        lambda _: dynmesh.Completer([[0, 1, 2]], np.eye(3)).state(),  # type: ignore[arg-type]
        ValueError,
        "3 vertices",
        "49",
    ),
    _restore(
        "of a mesh with other faces",
        lambda w: dynmesh.Completer(w.faces[1:], w.vertices).state(),
        ValueError,
        "other faces",
    ),
    _restore(
        "of `disconnected='hold'`",
        lambda w: w.make(disconnected="hold").state(),
        ValueError,
        "disconnected is hold, not follow",
    ),
    _restore(
        "of `method='motion'`",
        lambda w: w.make(method="motion").state(),
        ValueError,
        "method is motion, not detail",
    ),
    _restore("None", lambda _: None, TypeError, "bytes", "NoneType"),
    _restore("text", lambda _: "state", TypeError, "bytes", "str"),
    _restore("every other byte", lambda w: memoryview(_state(w))[::2], TypeError, "contiguous"),
    _restore("an array of float64", lambda _: np.zeros(9), TypeError, "bytes"),
]

cases = [*construction, *pushes, *sparse_pushes, *resets_and_restores]
