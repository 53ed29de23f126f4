"""Cases of dynmesh.Tracker, dynmesh.alignment.find_alignment and dynmesh.register."""

from collections.abc import Callable
from typing import Any

import numpy as np
from meshes import sheet

import dynmesh
from dynmesh.scans import DepthScan

from .case import OTHER_FACES, Case, World
from .functions import of


def _with(value: float, *place: int, shape: tuple[int, ...] = (9, 3)) -> Any:
    array = np.ones(shape)
    array[place] = value
    return array


def _changed(matrix: Any, row: int, column: int, value: float) -> Any:
    changed = matrix.copy()
    changed[row, column] = value
    return changed


_COMPLETER = dynmesh.Completer(np.array([[0, 1, 2]]), np.eye(3))
_SINGLE = dynmesh.Tracker(np.array([[0, 1, 2]]), np.eye(3, dtype=np.float32))
_SHEET = sheet(7)
_SCAN = np.ones((9, 3))
_DEPTH = np.ones((4, 5))
_INTRINSICS = np.array([[4.0, 0, 2], [0, 4, 2], [0, 0, 1]])
_POSE = np.eye(4)
_IMAGE = {"depth": _DEPTH, "intrinsics": _INTRINSICS, "pose": _POSE}
_TWO = _IMAGE | {"depth": [_DEPTH, _DEPTH]}
_COUNTS = _IMAGE | {"depth": _DEPTH.astype(np.uint16)}


def _of(function: Any, frame: str, scan: str) -> Callable[..., Case]:
    """Makes cases of a function of a mesh and a scan; what is given may depend on the world."""

    def case(given: str, error: type[Exception], *names: str, **arguments: Any) -> Case:
        def run(w: World) -> Any:
            usual = {"faces": w.faces, frame: w.vertices, scan: w.points}
            made = {name: f(w) if callable(f) else f for name, f in arguments.items()}
            return function(**(usual | made))

        return Case(function.__name__, given, run, error, names)

    return case


_find = _of(dynmesh.alignment.find_alignment, "first_frame", "scan")
_register = _of(dynmesh.register, "template", "points")


def _marks(given: str, vertices: Any, positions: Any, *names: str) -> Case:
    marks = (np.array(vertices), np.array(positions, dtype=np.float64))
    return _register(f"`landmarks`: {given}", ValueError, "landmarks:", *names, landmarks=marks)


def _call(call: str, given: str, error: type[Exception], *names: str, **arguments: Any) -> Case:
    """A case of a method; the state of the tracker must not change."""

    def run(world: World) -> Any:
        tracker = _made(world)
        tracker.push(world.vertices, np.tile([0.0, 0, 1], (49, 1)))
        before = tracker.state()
        made = {name: f(tracker) if callable(f) else f for name, f in arguments.items()}
        try:
            return getattr(tracker, call)(**made)
        finally:
            assert tracker.state() == before

    return Case(f"Tracker.{call}", given, run, error, names)


def _push(given: str, error: type[Exception], *names: str, **arguments: Any) -> Case:
    return _call("push", given, error, *names, **{"points": _SCAN, **arguments})


def _depth(argument: str, given: str, value: Any, *names: str) -> Case:
    given, arguments = f"`{argument}`: {given}", _IMAGE | {argument: value}
    return _call("push_depth", given, ValueError, f"{argument}:", *names, **arguments)


_depth_of = of("register")
_tracker = of("Tracker")


def _made(w: World, **changed: Any) -> dynmesh.Tracker:
    return dynmesh.Tracker(**({"faces": w.faces, "first_frame": w.vertices} | changed))


cases = [
    _find("`scan`: no point", ValueError, "scan:", "no points", scan=lambda w: w.empty),
    _find("`scan`: infinity", ValueError, "row 4", scan=lambda w: w.with_value(np.inf)),
    _find("`scan`: (49, 2)", ValueError, "(49, 2)", scan=lambda w: w.points[:, :2]),
    _find("too few vertices", ValueError, "vertex 48", first_frame=lambda w: w.vertices[:48]),
    _register("`points`: two", ValueError, "points: there are 2", "12", points=_SCAN[:2]),
    _register("`points`: all the same", ValueError, "points:", points=np.ones((49, 3))),
    _register("`points`: NaN", ValueError, "row 4", "nan", points=lambda w: w.with_value(np.nan)),
    _register(
        "in another unit", ValueError, "points:", "times as large", points=lambda w: 1e3 * w.points
    ),
    _register("`faces`: none", ValueError, "faces: is empty", faces=np.zeros((0, 3), np.int32)),
    _register(
        "`template`: NaN", ValueError, "template: vertex 4", template=lambda w: w.with_value(np.nan)
    ),
    _register("`normals`: one too few", ValueError, "normals:", "8", normals=_SCAN[1:]),
    _register("`align`: a word", TypeError, "align:", "'yes'", align="yes"),
    _register("`landmarks`: an array", TypeError, "landmarks:", "ndarray", landmarks=_SCAN),
    _marks("of vertex 49", [3, 49], _SCAN[:2], "landmark 1", "vertex 49"),
    _marks("of vertex -1", [-1], _SCAN[:1], "landmark 0", "vertex -1"),
    _marks("at NaN", [3, 4], [[1, 2, 3], [4, 5, np.nan]], "row 1", "nan"),
    _marks("a position too few", [3, 4], _SCAN[:1], "2 vertices", "1 positions"),
    _marks("a vertex twice", [3, 7, 3], np.eye(3), "0 and 2", "vertex 3"),
    _marks("outside the scan", [3, 4], [[0, 0, 0], [900, 0, 0]], "landmark 1", "(900, 0, 0)"),
    _marks("a position twice", [3, 7], np.ones((2, 3)), "vertices 3 and 7", "(1, 1, 1)"),
    _depth_of(
        "a negative depth",
        lambda w: dynmesh.register(
            w.faces, w.vertices, DepthScan([-_DEPTH.astype(np.float32)], [_INTRINSICS], [_POSE])
        ),
        ValueError,
        "of image 0",
        "-1",
    ),
    _tracker("`training`: a number", lambda w: _made(w, training=3), TypeError, "training:", "int"),
    _tracker("a word", lambda w: _made(w, uncertainty="yes"), TypeError, "uncertainty:", "'yes'"),
    _tracker(
        "NaN", lambda w: _made(w, first_frame=w.with_value(np.nan)), ValueError, "vertex 4", "nan"
    ),
    _tracker(
        "a template elsewhere",
        lambda w: _made(w).push(1e3 * w.vertices + 1e5),
        ValueError,
        "is far",
    ),
    _tracker("no errors", lambda w: _made(w).standard_error, ValueError, "requires uncertainty"),
    *(
        _tracker(f"`resolution`: {value!r}", lambda w, r=value: _made(w, resolution=r), error, told)
        for error, told, *values in (
            (ValueError, "resolution: must be 'best' or a number", 0, -1, "live", 2**31),
            (TypeError, "resolution: ", True, 2.5, None),
        )
        for value in values
    ),
    _push("`points`: NaN in it", ValueError, "points: row 5", "nan", points=_with(np.nan, 5, 1)),
    _push("`points`: 1e201", ValueError, "points: row 5", "1e+201", points=_with(1e201, 5, 1)),
    _push("`points`: (9, 2)", ValueError, "points:", "(9, 2)", points=_SCAN[:, :2]),
    _push("`normals`: one too few", ValueError, "normals:", "8", "9", normals=_SCAN[1:]),
    _push("`normals`: no rows", ValueError, "normals:", "0", "9", normals=_SCAN[:0]),
    _push("`normals`: infinite", ValueError, "normals: row 2", "inf", normals=_with(np.inf, 2, 0)),
    _push("`viewpoints`: NaN", ValueError, "viewpoints: row 0", viewpoints=_with(np.nan, 0, 2)),
    _push("`viewpoints`: (3,)", ValueError, "viewpoints:", "(3,)", viewpoints=np.ones(3)),
    _push("`out`: one row too few", ValueError, "out:", "48", "49", out=np.ones((48, 3))),
    _call("reset", "one row too few", ValueError, "frame:", "48", "49", frame=np.ones((48, 3))),
    _call(
        "restore", "of a completer", ValueError, "state: not a", state=lambda _: _COMPLETER.state()
    ),
    _call(
        "restore",
        "of another resolution",
        ValueError,
        "resolution",
        state=lambda _: dynmesh.Tracker(_SHEET.faces, _SHEET.vertices, resolution=20).state(),
    ),
    _call("restore", "of float32", ValueError, "32-bit positions", state=lambda _: _SINGLE.state()),
    *(
        _call(
            "restore",
            f"of faces, {given}",
            ValueError,
            "of a mesh with other faces",
            state=lambda _, faces=faces: dynmesh.Tracker(faces, _SHEET.vertices).state(),
        )
        for given, faces in OTHER_FACES.items()
    ),
    _depth("depth", "shape (4,)", np.ones(4), "(4,)"),
    _depth("depth", "negative", _changed(_DEPTH, 2, 3, -1), "of image 0 row 2, column 3", "-1"),
    _call("push_depth", "two images, one pose", ValueError, "are 1, but 2", **_TWO),
    _call("push_depth", "16-bit integers", TypeError, "depth:", "uint16", **_COUNTS),
    _depth("depth", "no pixels", np.ones((0, 5)), "of image 0"),
    _depth("intrinsics", "a focal length of 0", _changed(_INTRINSICS, 0, 0, 0), "are singular"),
    _depth(
        "intrinsics", "NaN in it", _changed(_INTRINSICS, 1, 2, np.nan), "row 1, column 2", "nan"
    ),
    _depth("intrinsics", "transposed", _INTRINSICS.T, "of image 0 must be"),
    _depth("intrinsics", "shape (4, 4)", _POSE, "(4, 4)"),
    _depth("pose", "twice as large", _POSE * [2, 2, 2, 1], "of image 0 is not rigid", "4"),
    _depth("pose", "mirrored", _POSE * [1, -1, 1, 1], "of image 0 is not rigid", "-1"),
    _depth("pose", "transposed", _changed(_POSE, 3, 0, 5), "of image 0 must be [[R, t"),
    _depth("pose", "infinite", _changed(_POSE, 0, 3, np.inf), "row 0, column 3", "inf"),
]
