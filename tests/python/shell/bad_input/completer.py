"""Cases of dynmesh.Completer."""

from collections.abc import Callable
from typing import Any

import numpy as np

import dynmesh

from .case import OTHER_FACES, Case, World
from .functions import of

_MASKED = "the mask of a MaskedArray"
_LARGEST = np.array([[0, 1, 2**64 - 1]], np.uint64)
_OTHER = dynmesh.Completer(np.array([[0, 1, 2]]), np.eye(3))


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


def _huge(values: list[Any], rows: int) -> Any:
    """Returns an array with any number of rows that takes no memory."""
    return np.broadcast_to(np.array(values), (rows, 3))


def _too_far(world: World) -> Any:
    return world.with_value(1e30).astype(np.float32)


def _by_motion(world: World) -> bytes:
    return world.make(method="motion").state()


def _call(call: str, argument: str) -> Callable[..., Case]:
    """Makes cases of one argument; what is given for it may depend on the world."""

    def case(given: str, value: Any, error: type[Exception], *names: str) -> Case:
        def run(w: World) -> Any:
            found = value(w) if callable(value) else value
            arguments = {name: make(w) for name, make in _GOOD[call].items()} | {argument: found}
            callee = dynmesh.Completer if call == "Completer" else getattr(w.completer, call)
            return callee(**arguments)

        return Case(call, f"`{argument}`: {given}", run, error, names)

    return case


_GOOD: dict[str, dict[str, Callable[[World], Any]]] = {
    "Completer": {"faces": lambda w: w.faces, "first_frame": lambda w: w.vertices},
    "push": {"points": lambda w: w.points, "known": lambda w: w.known},
    "push_sparse": {"indices": lambda _: [4, 7, 3], "points": lambda w: w.points[:3]},
    "skip": {},
    "reset": {},
    "restore": {},
}
"""Arguments that each call takes."""


def _setting(settings: dict[str, Any], error: type[Exception], *names: str) -> Case:
    name = list(settings)[-1]
    given = ", ".join(f"{key}={value!r}" for key, value in settings.items())
    run = lambda world: world.make(**settings)  # noqa: E731
    return Case("Completer", f"`{given}`", run, error, (f"{name}:", *names))


_faces = _call("Completer", "faces")
_frame = _call("Completer", "first_frame")

# Every array is converted and checked by the same functions, so a kind of array stands once.
construction = [
    _faces("None", None, TypeError, "faces:", "object"),
    _faces("float64", lambda w: w.faces.astype(float), TypeError, "faces:", "float64"),
    _faces("bool", lambda w: w.faces.astype(bool), TypeError, "faces:", "bool"),
    _faces(
        "a masked array", lambda w: np.ma.masked_equal(w.faces, 3), TypeError, "faces:", _MASKED
    ),
    _faces("a number", 3, ValueError, "faces:", "(m, 3)", "()"),
    _faces("an index of k", lambda w: _with_index(w, 49), ValueError, "face 5", "vertex 49"),
    _faces("an index of 2^40", lambda w: _with_index(w, 2**40), ValueError, "row 5", str(2**40)),
    _faces("an index of 2^64 - 1", _LARGEST, ValueError, "faces: row 0", str(2**64 - 1)),
    _faces("2^31 rows", lambda _: _huge([0, 1, 2], 2**31), ValueError, "faces:", str(2**31)),
    _frame("one row too few", lambda w: w.vertices[:48], ValueError, "face 71", "vertex 48"),
    _frame("four columns", np.zeros((49, 4)), ValueError, "first_frame:", "(k, 3)", "(49, 4)"),
    _frame("integers", lambda w: w.vertices.astype(int), TypeError, "first_frame:", "int64"),
    _frame("float128", lambda w: w.vertices.astype(np.longdouble), TypeError, "float128"),
    _frame("complex numbers", lambda w: w.vertices.astype(complex), TypeError, "complex128"),
    _frame("NaN in it", lambda w: w.with_value(np.nan), ValueError, "first_frame: vertex 4", "nan"),
    _frame("1e30 in float32", _too_far, ValueError, "vertex 4", "e+30", "below 1e18"),
    _frame("2^33 rows", lambda _: _huge([0.0, 0, 0], 2**33), ValueError, str(2**33)),
    _setting({"method": b"motion"}, TypeError, "b'motion'"),
    _setting({"method": "\ud800"}, ValueError, "ud800"),
    _setting({"method": "other"}, ValueError, "'other'"),
    _setting({"disconnected": "other"}, ValueError, "'other'"),
    _setting({"method": "motion", "extra_iterations": -1}, ValueError, "-1"),
    _setting({"threads": 0}, ValueError, "not 0"),
    _setting({"threads": 2**31}, ValueError, str(2**31)),
    _setting({"method": "detail", "noise": 10**400}, ValueError, "10000"),
    _setting({"revisit": None}, TypeError, "None"),
    _setting({"revisit": 1}, TypeError, "not 1"),
    _setting({"method": "motion", "extra_iterations": 1.0}, TypeError, "1.0"),
    _setting({"method": "detail", "noise": 0.0}, ValueError, "not 0"),
    _setting({"method": "detail", "noise": float("nan")}, ValueError, "nan"),
    _setting({"method": "detail", "noise": "0.1"}, TypeError, "'0.1'"),
    _setting({"method": "detail", "noise": True}, TypeError, "True"),
    _setting({"threads": True}, TypeError, "True"),
]


def _into(world: World, known: Any = None, first: int = 0) -> Any:
    points = np.concatenate([world.points, world.points[:1]])
    mask = None if known is None else points.reshape(-1).view(bool)[known : known + 49]
    return world.completer.push(points[:49], mask, out=points[first:][:49])


_push = of("push")
_points = _call("push", "points")
_known = _call("push", "known")
_out = _call("push", "out")

pushes = [
    _points("one row too few", lambda w: w.points[:48], ValueError, "points:", "48 rows", "49"),
    _points("NaN, marked known", lambda w: w.with_value(np.nan), ValueError, "row 4", "nan"),
    _points("1e201", lambda w: w.with_value(1e201), ValueError, "row 4", "1e+201", "1e200"),
    _push("1e300", lambda w: w.single.push(w.with_value(1e300), w.known), ValueError, "e+38"),
    _push("1e30", lambda w: w.single.push(_too_far(w)), ValueError, "points: row 4", "below 1e18"),
    _known("one too few", lambda w: w.known[:48], ValueError, "known:", "48 rows", "49"),
    _known("a column", lambda w: w.known[:, None], ValueError, "known:", "(k,)", "(49, 1)"),
    _known("one bool", True, ValueError, "known:", "(k,)", "()"),
    _known("integers up to 2", lambda w: w.known + 1, ValueError, "known:", "0 or 1", "has 2"),
    _known("floats", lambda w: w.known.astype(float), TypeError, "known:", "float64"),
    _out("a list", lambda w: w.points.tolist(), TypeError, "out:", "list"),
    _out("float32", lambda w: w.points.astype(np.float32), TypeError, "out:", "float64", "float32"),
    _out("of the other byte order", lambda w: w.points.astype(">f8"), TypeError, "out:", ">f8"),
    _out("one row too many", np.empty((50, 3)), ValueError, "out:", "50 rows", "49"),
    _out("transposed", lambda w: w.points.T.copy(), ValueError, "out:", "(k, 3)", "(3, 49)"),
    _out("read-only", lambda w: _read_only(w.points), ValueError, "out:", "read-only"),
    _out(
        "rows that share memory",
        lambda w: np.lib.stride_tricks.as_strided(w.points.copy(), strides=(8, 8)),
        ValueError,
        "out:",
        "share memory",
    ),
    _out("a masked array", lambda w: np.ma.masked_invalid(w.points), TypeError, "out:", _MASKED),
    _push("`out`: rows of `points`", lambda w: _into(w, first=1), ValueError, "overlaps points"),
    _push("`out`: the mask", lambda w: _into(w, known=0), ValueError, "overlaps known"),
]

_indices = _call("push_sparse", "indices")
_some_points = _call("push_sparse", "points")
_no_points = _call("skip", "out")

sparse_pushes = [
    _indices("one twice", [4, 7, 4], ValueError, "indices: vertex 4", "positions 0 and 2"),
    _indices("one of k", [4, 7, 49], ValueError, "indices: position 2", "49"),
    _indices("a negative one", [4, -1, 7], ValueError, "indices: position 1", "-1"),
    _indices("2^63 + 5", np.array([2**63 + 5] * 3, np.uint64), ValueError, str(2**63 + 5)),
    _indices("one too many", [1, 2, 3, 4], ValueError, "3 rows", "4 indices"),
    _indices("a column", [[1], [2], [3]], ValueError, "indices:", "(n,)", "(3, 1)"),
    _indices("float64", [1.0, 2, 3], TypeError, "indices:", "float64"),
    _some_points("NaN", lambda w: w.with_value(np.nan)[3:6], ValueError, "points: row 1", "nan"),
    _no_points("one row too few", np.empty((48, 3)), ValueError, "out:", "48 rows", "49"),
]

_reset = _call("reset", "frame")
_restore = _call("restore", "state")


def _state(world: World) -> bytes:
    return world.completer.state()


resets_and_restores = [
    _reset("one row too few", lambda w: w.points[:48], ValueError, "frame:", "48 rows", "49"),
    _reset("NaN in it", lambda w: w.with_value(np.nan), ValueError, "frame: vertex 4", "nan"),
    _restore("empty", b"", ValueError, "state: truncated", "0 bytes"),
    _restore("another file's bytes", b"PK" * 500, ValueError, "state: not a completer state"),
    _restore("without its last byte", lambda w: _state(w)[:-1], ValueError, "truncated", "8619"),
    _restore("with one byte more", lambda w: _state(w) + b"x", ValueError, "1 byte"),
    _restore("a flipped bit", lambda w: _flipped(_state(w), 200), ValueError, "state: damaged"),
    _restore("a flipped bit in its head", lambda w: _flipped(_state(w), 9), ValueError, "2112-bit"),
    _restore("of float32", lambda w: w.single.state(), ValueError, "32-bit", "64-bit"),
    _restore("of another mesh", lambda _: _OTHER.state(), ValueError, "3 vertices", "49"),
    *(
        _restore(
            f"of faces, {given}",
            lambda w, faces=faces: dynmesh.Completer(faces, w.vertices).state(),
            ValueError,
            "of a mesh with other faces",
        )
        for given, faces in OTHER_FACES.items()
    ),
    _restore("of `method='motion'`", _by_motion, ValueError, "method is motion, not detail"),
    _restore("None", None, TypeError, "state:", "bytes", "NoneType"),
]

cases = [*construction, *pushes, *sparse_pushes, *resets_and_restores]
