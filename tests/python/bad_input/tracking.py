"""Cases of dynmesh.Tracker and dynmesh.find_alignment."""

from typing import Any

import numpy as np

import dynmesh

from .case import Case, World


def _tracker(world: World) -> dynmesh.Tracker:
    return dynmesh.Tracker(world.faces, world.vertices)


def _case(
    call: str, given: str, run: Any, error: type[Exception], *names: str, start: bool = True
) -> Case:
    """A case of a method; the state of the tracker must not change."""

    def checked(world: World) -> Any:
        if not start:
            return run(world)
        tracker = _tracker(world)
        tracker.push(world.vertices, np.tile([0.0, 0, 1], (49, 1)))
        before = tracker.state()
        try:
            return run(tracker)
        finally:
            assert tracker.state() == before

    return Case(f"Tracker.{call}" if start else call, given, checked, error, names)


def _with(shape: tuple[int, ...], place: tuple[int, ...], value: float) -> Any:
    array = np.ones(shape)
    array[place] = value
    return array


_DEPTH = np.ones((4, 5))
_INTRINSICS = np.array([[4.0, 0, 2], [0, 4, 2], [0, 0, 1]])
_POSE = np.eye(4)


def _depth(
    given: str,
    error: type[Exception],
    *names: str,
    depth: Any = _DEPTH,
    intrinsics: Any = _INTRINSICS,
    pose: Any = _POSE,
) -> Case:
    return _case(
        "push_depth",
        given,
        lambda tracker: tracker.push_depth(depth, intrinsics, pose),
        error,
        *names,
    )


def _changed(matrix: Any, row: int, column: int, value: float) -> Any:
    changed = matrix.copy()
    changed[row, column] = value
    return changed


def _find(given: str, run: Any, error: type[Exception], *names: str) -> Case:
    return _case("find_alignment", given, run, error, *names, start=False)


cases = [
    _find(
        "`scan`: no point",
        lambda w: dynmesh.find_alignment(w.faces, w.vertices, w.empty),
        ValueError,
        "scan:",
        "no points",
    ),
    _find(
        "`scan`: infinity in it",
        lambda w: dynmesh.find_alignment(w.faces, w.vertices, w.with_value(np.inf)),
        ValueError,
        "scan: row 4",
        "inf",
    ),
    _find(
        "`scan`: shape (49, 2)",
        lambda w: dynmesh.find_alignment(w.faces, w.vertices, w.points[:, :2]),
        ValueError,
        "scan:",
        "(49, 2)",
    ),
    _find(
        "`first_frame`: one row too few",
        lambda w: dynmesh.find_alignment(w.faces, w.vertices[:48], w.points),
        ValueError,
        "faces: face 71",
        "vertex 48",
    ),
    _case(
        "Tracker",
        "`threads=0`",
        lambda w: dynmesh.Tracker(w.faces, w.vertices, threads=0),
        ValueError,
        "threads:",
        "0",
        start=False,
    ),
    _case(
        "Tracker",
        "`training`: two frames",
        lambda w: dynmesh.Tracker(w.faces, w.vertices, training=[w.vertices] * 2),
        ValueError,
        "training: has 2 frames",
        "3",
        start=False,
    ),
    _case(
        "Tracker",
        "`training`: a number",
        lambda w: dynmesh.Tracker(w.faces, w.vertices, training=3),  # type: ignore[arg-type]
        TypeError,
        "training:",
        "int",
        start=False,
    ),
    _case(
        "Tracker",
        "`training`: NaN in frame 1",
        lambda w: dynmesh.Tracker(w.faces, w.vertices, training=[w.vertices, w.with_value(np.nan)]),
        ValueError,
        "training: frame 1: vertex 4",
        "nan",
        start=False,
    ),
    _case(
        "Tracker",
        "`training`: a row too few in frame 1",
        lambda w: dynmesh.Tracker(w.faces, w.vertices, training=[w.vertices, w.vertices[:48]]),
        ValueError,
        "training: frame 1:",
        "48 rows",
        start=False,
    ),
    _case(
        "Tracker",
        "`training`: in another unit",
        lambda w: dynmesh.Tracker(w.faces, w.vertices, training=1000 * w.sequence.vertices),
        ValueError,
        "training: its size",
        "unit",
        start=False,
    ),
    _case(
        "Tracker",
        "`uncertainty`: a word",
        lambda w: dynmesh.Tracker(w.faces, w.vertices, uncertainty="yes"),  # type: ignore[arg-type]
        TypeError,
        "uncertainty:",
        "str",
        start=False,
    ),
    _case(
        "standard_error",
        "without `uncertainty`",
        lambda t: t.standard_error,
        ValueError,
        "standard_error: requires uncertainty",
    ),
    _case(
        "Tracker",
        "`first_frame`: NaN in it",
        lambda w: dynmesh.Tracker(w.faces, w.with_value(np.nan)),
        ValueError,
        "first_frame: vertex 4",
        "nan",
        start=False,
    ),
    _case(
        "Tracker.push",
        "`points`: far from the template, as the first scan",
        lambda w: _tracker(w).push(1000 * w.vertices + 1e5, w.vertices),
        ValueError,
        "points: the template is far from the first scan",
        "mean edges",
        start=False,
    ),
    _case(
        "push",
        "`points`: NaN in it",
        lambda t: t.push(_with((9, 3), (5, 1), np.nan)),
        ValueError,
        "points: row 5",
        "nan",
    ),
    _case(
        "push",
        "`points`: 1e201",
        lambda t: t.push(_with((9, 3), (5, 1), 1e201)),
        ValueError,
        "points: row 5",
        "1e+201",
    ),
    _case(
        "push",
        "`points`: shape (9, 2)",
        lambda t: t.push(np.ones((9, 2))),
        ValueError,
        "points:",
        "(9, 2)",
    ),
    _case(
        "push",
        "`points`: integers",
        lambda t: t.push(np.ones((9, 3), int)),
        TypeError,
        "points:",
        "int64",
    ),
    _case(
        "push",
        "`normals`: one row too few",
        lambda t: t.push(np.ones((9, 3)), np.ones((8, 3))),
        ValueError,
        "normals:",
        "8",
        "9",
    ),
    _case(
        "push",
        "`normals`: no rows",
        lambda t: t.push(np.ones((9, 3)), np.ones((0, 3))),
        ValueError,
        "normals:",
        "0",
        "9",
    ),
    _case(
        "push",
        "`normals`: infinite",
        lambda t: t.push(np.ones((9, 3)), _with((9, 3), (2, 0), np.inf)),
        ValueError,
        "normals: row 2",
        "inf",
    ),
    _case(
        "push",
        "`viewpoints`: NaN in it",
        lambda t: t.push(np.ones((9, 3)), viewpoints=_with((1, 3), (0, 2), np.nan)),
        ValueError,
        "viewpoints: row 0",
        "nan",
    ),
    _case(
        "push",
        "`viewpoints`: shape (3,)",
        lambda t: t.push(np.ones((9, 3)), viewpoints=np.ones(3)),
        ValueError,
        "viewpoints:",
        "(3,)",
    ),
    _case(
        "push",
        "`out`: one row too few",
        lambda t: t.push(np.ones((9, 3)), out=np.ones((48, 3))),
        ValueError,
        "out:",
        "48",
        "49",
    ),
    _case(
        "reset",
        "`frame`: one row too few",
        lambda t: t.reset(np.ones((48, 3))),
        ValueError,
        "frame:",
        "48",
        "49",
    ),
    _case(
        "restore",
        "`state`: damaged",
        lambda t: t.restore(t.state()[:-1] + bytes([t.state()[-1] ^ 1])),
        ValueError,
        "state: damaged",
    ),
    _case(
        "restore",
        "`state`: truncated",
        lambda t: t.restore(t.state()[:-9]),
        ValueError,
        "state: truncated",
    ),
    _case("restore", "`state`: a list", lambda t: t.restore([1]), TypeError, "state:", "list"),
    _depth("`depth`: shape (4,)", ValueError, "depth:", "(4,)", depth=np.ones(4)),
    _depth(
        "`depth`: 16-bit integers", TypeError, "depth:", "uint16", depth=np.ones((4, 5), np.uint16)
    ),
    _depth(
        "`depth`: negative",
        ValueError,
        "depth: of image 0 row 2, column 3",
        "-1",
        depth=_changed(_DEPTH, 2, 3, -1),
    ),
    _depth("`depth`: no pixels", ValueError, "depth: of image 0", depth=np.ones((0, 5))),
    _depth("`depth`: a word", TypeError, "depth:", "str", depth="image.png"),
    _depth(
        "`depth`: two images, one pose",
        ValueError,
        "there are 1, but 2 depth images",
        depth=[_DEPTH, _DEPTH],
    ),
    _depth(
        "`intrinsics`: a focal length of 0",
        ValueError,
        "intrinsics: of image 0 are singular",
        intrinsics=_changed(_INTRINSICS, 0, 0, 0),
    ),
    _depth(
        "`intrinsics`: NaN in it",
        ValueError,
        "intrinsics: of image 0 row 1, column 2",
        "nan",
        intrinsics=_changed(_INTRINSICS, 1, 2, np.nan),
    ),
    _depth(
        "`intrinsics`: transposed",
        ValueError,
        "intrinsics: of image 0 must be",
        intrinsics=_INTRINSICS.T,
    ),
    _depth("`intrinsics`: shape (4, 4)", ValueError, "intrinsics:", "(4, 4)", intrinsics=_POSE),
    _depth(
        "`pose`: twice as large",
        ValueError,
        "pose: of image 0 is not rigid",
        "4",
        pose=_POSE * [2, 2, 2, 1],
    ),
    _depth(
        "`pose`: mirrored",
        ValueError,
        "pose: of image 0 is not rigid",
        "-1",
        pose=_POSE * [1, -1, 1, 1],
    ),
    _depth(
        "`pose`: transposed",
        ValueError,
        "pose: of image 0 must end in the row",
        pose=_changed(_POSE, 3, 0, 5),
    ),
    _depth(
        "`pose`: infinite",
        ValueError,
        "pose: of image 0 row 0, column 3",
        "inf",
        pose=_changed(_POSE, 0, 3, np.inf),
    ),
]
