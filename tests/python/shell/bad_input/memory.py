"""Cases of completers, trackers and the functions of the package, which take arrays."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
from meshes import join, sheet

import dynmesh
from dynmesh import baselines, losses, metrics, synth
from dynmesh.draw import figures
from dynmesh.scans import DepthScan

from .case import Case, World, of

_MASKED = "the mask of a MaskedArray"
_LARGEST = np.array([[0, 1, 2**64 - 1]], np.uint64)
_SHEET = sheet(7)
_WHOLE = np.ones(49, bool)


def _changed(array: Any, *place: Any, value: Any) -> Any:
    changed = array.copy()
    changed[place] = value
    return changed


def _read_only(points: Any) -> Any:
    points = points.copy()
    points.flags.writeable = False
    return points


def _too_far(world: World) -> Any:
    return world.with_value(1e30).astype(np.float32)


_GOOD: dict[str, dict[str, Callable[[World], Any]]] = {
    "Completer": {"faces": lambda w: w.faces, "first_frame": lambda w: w.vertices},
    "push": {"points": lambda w: w.points, "known": lambda w: w.known},
    "push_sparse": {"indices": lambda _: [4, 7, 3], "points": lambda w: w.points[:3]},
    "reset": {},
    "restore": {},
}
"""Arguments that each call of a completer takes."""


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


def _setting(settings: dict[str, Any], error: type[Exception], *names: str) -> Case:
    name = list(settings)[-1]
    given = ", ".join(f"{key}={value!r}" for key, value in settings.items())
    run = lambda world: world.make(**settings)  # noqa: E731
    return Case("Completer", f"`{given}`", run, error, (f"{name}:", *names))


_faces = _call("Completer", "faces")
_frame = _call("Completer", "first_frame")
_training = _call("Completer", "training")

# Every array is converted and checked by the same functions, so a kind of array stands once.
_construction = [
    _faces("a mesh, beside positions", lambda w: SimpleNamespace(faces=w.faces, vertices=w.vertices), ValueError, "first_frame: is that of the mesh"),
    _faces("None", None, TypeError, "faces:", "object"),
    _faces("a masked array", lambda w: np.ma.masked_equal(w.faces, 3), TypeError, "faces:", _MASKED),
    _faces("a number", 3, ValueError, "faces:", "(m, 3)", "()"),
    _faces("an index of k", lambda w: _changed(w.faces, 5, 1, value=49), ValueError, "face 5", "vertex 49"),
    _faces("an index of 2^64 - 1", _LARGEST, ValueError, "faces: row 0", str(2**64 - 1)),
    _faces("2^31 rows", lambda _: np.broadcast_to([0, 1, 2], (2**31, 3)), ValueError, "faces:", str(2**31)),
    _frame("float16", lambda w: w.vertices.astype(np.float16), TypeError, "first_frame:", "float16"),
    _frame("NaN in it", lambda w: w.with_value(np.nan), ValueError, "first_frame: vertex 4", "nan"),
    _frame("1e30 in float32", _too_far, ValueError, "vertex 4", "e+30", "below 1e18"),
    _training("two frames", lambda w: [w.vertices] * 2, ValueError, "training: has 2 frames", "3"),
    _training("NaN in frame 1", lambda w: [w.vertices, w.with_value(np.nan)], ValueError, "training: frame 1: vertex 4", "nan"),
    _training("in another unit", lambda w: 1000 * w.sequence.vertices, ValueError, "training: its size", "unit"),
    _setting({"method": b"motion"}, TypeError, "b'motion'"),
    _setting({"method": "\ud800"}, ValueError, "ud800"),
    _setting({"method": "other"}, ValueError, "'other'"),
    _setting({"method": "motion", "extra_iterations": -1}, ValueError, "-1"),
    _setting({"method": "motion", "training": _SHEET.vertices[None]}, ValueError, "method detail"),
    _setting({"threads": 0}, ValueError, "not 0"),
    _setting({"revisit": 1}, TypeError, "not 1"),
    _setting({"noise": 10**400}, ValueError, "10000"),
    _setting({"noise": float("nan")}, ValueError, "nan"),
    _setting({"noise": True}, TypeError, "True"),
]  # fmt: skip


def _into(world: World, known: Any = None, first: int = 0) -> Any:
    points = np.concatenate([world.points, world.points[:1]])
    mask = None if known is None else points.reshape(-1).view(bool)[known : known + 49]
    return world.completer.push(points[:49], mask, out=points[first:][:49])


_push = of("push")
_points = _call("push", "points")
_known = _call("push", "known")
_out = _call("push", "out")
_indices = _call("push_sparse", "indices")

_pushes = [
    _points("one row too few", lambda w: w.points[:48], ValueError, "points:", "48 rows", "49"),
    _points("NaN, marked known", lambda w: w.with_value(np.nan), ValueError, "row 4", "nan"),
    _push("1e30", lambda w: w.single.push(_too_far(w)), ValueError, "points: row 4", "below 1e18"),
    _known("one too few", lambda w: w.known[:48], ValueError, "known:", "48 rows", "49"),
    _known("a column", lambda w: w.known[:, None], ValueError, "known:", "(k,)", "(49, 1)"),
    _known("integers up to 2", lambda w: w.known + 1, ValueError, "known:", "0 or 1", "has 2"),
    _out("a list", lambda w: w.points.tolist(), TypeError, "out:", "list"),
    _out("of the other byte order", lambda w: w.points.astype(">f8"), TypeError, "out:", ">f8"),
    _out("read-only", lambda w: _read_only(w.points), ValueError, "out:", "read-only"),
    _out("a masked array", lambda w: np.ma.masked_invalid(w.points), TypeError, "out:", _MASKED),
    _out("rows that share memory", lambda w: np.lib.stride_tricks.as_strided(w.points.copy(), strides=(8, 8)), ValueError, "out:", "share memory"),
    _push("`out`: rows of `points`", lambda w: _into(w, first=1), ValueError, "overlaps points"),
    _push("`out`: the mask", lambda w: _into(w, known=0), ValueError, "overlaps known"),
    _indices("one twice", [4, 7, 4], ValueError, "indices: vertex 4", "positions 0 and 2"),
    _indices("one of k", [4, 7, 49], ValueError, "indices: position 2", "49"),
    _indices("a negative one", [4, -1, 7], ValueError, "indices: position 1", "-1"),
    _indices("2^63 + 5", np.array([2**63 + 5] * 3, np.uint64), ValueError, str(2**63 + 5)),
    _indices("one too many", [1, 2, 3, 4], ValueError, "3 rows", "4 indices"),
    _call("push_sparse", "points")("NaN", lambda w: w.with_value(np.nan)[3:6], ValueError, "points: row 1", "nan"),
]  # fmt: skip


def _state(world: World) -> bytes:
    return world.completer.state()


def _learned(world: World, training: Any) -> dynmesh.Completer:
    return world.make(training=training(world.sequence.vertices))


def _other_faces(faces: Any) -> dict[str, Any]:
    """Faces that are not these, by how they differ; all but the last have the same edges."""
    return {
        "with a flipped one": _changed(faces, 3, value=faces[3, ::-1]),
        "all turned over": faces[:, ::-1],
        "in reverse order": faces[::-1],
        "one of which begins at another corner": _changed(faces, 3, value=np.roll(faces[3], 1)),
        "one of which is missing": faces[1:],
    }


_restore = _call("restore", "state")
_track = of("Tracker.restore")

_states = [
    _restore("another file's bytes", b"PK" * 500, ValueError, "state: not a completer state"),
    _restore("without its last byte", lambda w: _state(w)[:-1], ValueError, "truncated", "too few"),
    _restore("with one byte more", lambda w: _state(w) + b"x", ValueError, "1 byte"),
    *(
        _restore(f"byte {n} flipped", lambda w, n=n: _state(w)[:n] + bytes([_state(w)[n] ^ 1]) + _state(w)[n + 1 :], ValueError, told)
        for n, told in ((9, "2112-bit"), (200, "state: damaged"))
    ),
    _restore("of float32", lambda w: w.single.state(), ValueError, "32-bit", "64-bit"),
    _restore("of `method='motion'`", lambda w: w.make(method="motion").state(), ValueError, "method is motion, not detail"),
    _restore("of one that learns", lambda w: w.make(learn=True).state(), ValueError, "learn is True, not False"),
    _restore("None", None, TypeError, "state:", "bytes", "NoneType"),
    of("restore")("of other training", lambda w: _learned(w, lambda x: x).restore(_learned(w, lambda x: x[::-1]).state()), ValueError, "another training sequence"),
    _track("of a completer", lambda w: w.tracker.restore(_state(w)), ValueError, "state: not a"),
    _track("of another resolution", lambda w: w.tracker.restore(dynmesh.Tracker(w.faces, w.vertices, resolution=20).state()), ValueError, "resolution"),
    _track("with `uncertainty`", lambda w: w.tracker.restore(dynmesh.Tracker(w.faces, w.vertices, uncertainty=True).state()), ValueError, "uncertainty is True, not False"),
    *(
        of(f"{kind.__name__}.restore")(f"of faces, {given}", lambda w, kind=kind, faces=faces: kind(w.faces, w.vertices).restore(kind(faces, w.vertices).state()), ValueError, "of a mesh with other faces")
        for kind in (dynmesh.Completer, dynmesh.Tracker)
        for given, faces in _other_faces(_SHEET.faces).items()
    ),
]  # fmt: skip


def _of_scan(function: Any, frame: str, scan: str) -> Callable[..., Case]:
    """Makes cases of a function of a mesh and a scan; what is given may depend on the world."""

    def case(given: str, error: type[Exception], *names: str, **arguments: Any) -> Case:
        def run(w: World) -> Any:
            usual = {"faces": w.faces, frame: w.vertices, scan: w.points}
            made = {name: f(w) if callable(f) else f for name, f in arguments.items()}
            return function(**(usual | made))

        return Case(function.__name__, given, run, error, names)

    return case


_find = _of_scan(dynmesh.alignment.find_alignment, "first_frame", "scan")
_register = _of_scan(dynmesh.register, "template", "points")


def _marks(given: str, vertices: Any, positions: Any, *names: str) -> Case:
    marks = (np.array(vertices), np.array(positions, dtype=np.float64))
    return _register(f"`landmarks`: {given}", ValueError, "landmarks:", *names, landmarks=marks)


_SCAN = np.ones((9, 3))
_DEPTH = np.ones((4, 5))
_LENS = np.array([[4.0, 0, 2], [0, 4, 2], [0, 0, 1]])
_POSE = np.eye(4)
_IMAGE = {"depth": _DEPTH, "intrinsics": _LENS, "pose": _POSE}


def _track_points(given: str, *names: str, **arguments: Any) -> Case:
    run = lambda w: w.tracker.push(**({"points": _SCAN} | arguments))  # noqa: E731
    return Case("Tracker.push", given, run, ValueError, names)


def _depth(argument: str, given: str, value: Any, *names: str) -> Case:
    run = lambda w: w.tracker.push_depth(**(_IMAGE | {argument: value}))  # noqa: E731
    return Case("Tracker.push_depth", f"`{argument}`: {given}", run, (ValueError, TypeError), names)


def _tracker(given: str, error: type[Exception], *names: str, **settings: Any) -> Case:
    run = lambda w: dynmesh.Tracker(w.faces, w.vertices, **settings)  # noqa: E731
    return Case("Tracker", given, run, error, names)


_tracking = [
    _find("`scan`: no point", ValueError, "scan:", "no points", scan=np.zeros((0, 3))),
    _find("too few vertices", ValueError, "vertex 48", first_frame=lambda w: w.vertices[:48]),
    _register("`points`: all the same", ValueError, "points:", points=np.ones((49, 3))),
    _register("in another unit", ValueError, "points:", "times as large", points=lambda w: 1e3 * w.points),
    _register("`faces`: none", ValueError, "faces: is empty", faces=np.zeros((0, 3), np.int32)),
    _register("`template`: NaN", ValueError, "template: vertex 4", template=lambda w: w.with_value(np.nan)),
    _register("`align`: a word", TypeError, "align:", "'yes'", align="yes"),
    _register("`landmarks`: an array", TypeError, "landmarks:", "ndarray", landmarks=_SCAN),
    _marks("of vertex 49", [3, 49], _SCAN[:2], "landmark 1", "vertex 49"),
    _marks("a vertex twice", [3, 7, 3], np.eye(3), "0 and 2", "vertex 3"),
    _marks("a position twice", [3, 7], np.ones((2, 3)), "vertices 3 and 7", "(1, 1, 1)"),
    _marks("outside the scan", [3, 4], [[0, 0, 0], [900, 0, 0]], "landmark 1", "(900, 0, 0)"),
    of("register")("a negative depth", lambda w: dynmesh.register(w.faces, w.vertices, DepthScan([-_DEPTH.astype(np.float32)], [_LENS], [_POSE])), ValueError, "of image 0", "-1"),
    *(_tracker(f"`resolution`: {one!r}", ValueError, "resolution: must be 'best' or a number", resolution=one) for one in (0, "live", 2**31)),
    *(_tracker(f"`resolution`: {one!r}", TypeError, "resolution: ", resolution=one) for one in (True, 2.5)),
    of("Tracker.push")("a template elsewhere", lambda w: dynmesh.Tracker(w.faces, w.vertices).push(1e3 * w.vertices + 1e5), ValueError, "is far"),
    _track_points("`points`: NaN", "points: row 5", "nan", points=_changed(_SCAN, 5, 1, value=np.nan)),
    _track_points("`normals`: no rows", "normals:", "0", "9", normals=_SCAN[:0]),
    _track_points("`normals`: infinite", "normals: row 2", "inf", normals=_changed(_SCAN, 2, 0, value=np.inf)),
    _track_points("`viewpoints`: (3,)", "viewpoints:", "(3,)", viewpoints=np.ones(3)),
    _depth("depth", "shape (4,)", np.ones(4), "depth:", "(4,)"),
    _depth("depth", "negative", _changed(_DEPTH, 2, 3, value=-1), "of image 0 row 2, column 3", "-1"),
    _depth("depth", "two images, one pose", [_DEPTH, _DEPTH], "are 1, but 2"),
    _depth("depth", "16-bit integers", _DEPTH.astype(np.uint16), "depth:", "uint16"),
    _depth("intrinsics", "a focal length of 0", _changed(_LENS, 0, 0, value=0), "intrinsics:", "are singular"),
    _depth("pose", "twice as large", _POSE * [2, 2, 2, 1], "pose:", "of image 0 is not rigid", "4"),
    _depth("pose", "mirrored", _POSE * [1, -1, 1, 1], "of image 0 is not rigid", "-1"),
    _depth("pose", "transposed", _changed(_POSE, 3, 0, value=5), "of image 0 must be [[R, t"),
]  # fmt: skip

_complete = of("complete")
_cells = of("cells")
_nmsve = of("metrics.nmsve")
_lsm = of("baselines.LeastSquaresMesh")
_lia = of("baselines.LaplacianInterpolation")
_whole_frame = of("whole_frame")


def _stream(world: World, last: Any) -> Any:
    vertices = np.stack([world.vertices, world.points, last])
    masks = np.ones((3, 49), bool)
    return dynmesh.read(dynmesh.complete(dynmesh.Sequence(vertices, world.faces, masks)))


def _mesh(world: World, points: Any, known: Any, **more: Any) -> Any:
    return baselines.LeastSquaresMesh(world.faces, 49).complete(points, known, **more)


def _two_parts(call: Any, known: Any) -> Any:
    """`call` for a mesh of 49 vertices and one of 16, where the vertices of one part are known."""
    mesh = join(sheet(7), sheet(4, 10.0))
    return call(mesh.faces, 65).complete(mesh.vertices, known(np.arange(65)))


def _put_together(world: World, frames: Any = None, known: Any = None, **more: Any) -> Any:
    frames = world.sequence.vertices if frames is None else frames
    return dynmesh.whole_frames.whole_frame(world.faces, frames, known, **more)


def _drawn(world: World, **more: Any) -> Any:
    view = figures.View.of(world.vertices, "z", 0.0)
    plain = {"places": np.zeros(49), "colours": ("#d7dce3",)}
    drawn = {"faces": world.faces, "points": world.vertices, "view": view, **plain}
    return figures.render(**{**drawn, **more})


_functions = [
    _complete("an array", lambda w: dynmesh.complete(w.points), TypeError, "faces:", "missing"),
    _complete("infinity in frame 2, marked known", lambda w: _stream(w, w.with_value(np.inf)), ValueError, "frame 2: points: row 4", "inf"),
    _complete("`start`: a frame that is not there", lambda w: dynmesh.complete(w.sequence, start=99), ValueError, "start:", "no frame 99"),
    _cells("`n_vertices`: 49.0", lambda w: dynmesh.topology.cells(w.faces, 49.0), TypeError, "n_vertices:", "49.0"),  # type: ignore[arg-type]
    _cells("`n_vertices`: one too few", lambda w: dynmesh.topology.cells(w.faces, 48), ValueError, "faces: face 71", "vertex 48", "48 vertices"),
    _nmsve("`completed`: one row too few", lambda w: metrics.nmsve(w.faces, w.points, w.points[:48]), ValueError, "completed:", "(48, 3)", "(49, 3)"),
    _nmsve("no vertex", lambda w: metrics.nmsve(w.faces[:0], w.points[:0], w.points[:0]), ValueError, "reference:", "no vertices"),
    of("metrics.vertex_error")("a frame and a sequence", lambda w: metrics.vertex_error(w.points, w.points[None]), ValueError, "completed:", "(1, 49, 3)", "(49, 3)"),
    _lsm("nothing known", lambda w: _mesh(w, w.points, ~_WHOLE), ValueError, "known: component 0", "49 vertices"),
    _lsm("the second component not known", lambda _: _two_parts(baselines.LeastSquaresMesh, lambda v: v < 49), ValueError, "known: component 1", "16 vertices", "49"),
    _lia("the first component not known", lambda _: _two_parts(baselines.LaplacianInterpolation, lambda v: v > 48), ValueError, "known: component 0", "49 vertices"),
    _lia("inverse distances of nothing", lambda w: baselines.LaplacianInterpolation(w.faces, 49, weights="inverse_distance"), ValueError, "reference:", "is required"),
    _whole_frame("`frame='worst'`", lambda w: _put_together(w, frame="worst"), TypeError, "frame:", "'worst'"),
    _whole_frame("fewer masks than frames", lambda w: _put_together(w, known=np.ones((2, 49), bool)), ValueError, "known:", "(3, 49)", "(2, 49)"),
    _whole_frame("frame 1 smaller", lambda w: _put_together(w, [w.points, w.points[:5]]), ValueError, "frames:", "cannot be converted"),
    _whole_frame("NaN, marked known", lambda w: _put_together(w, [w.with_value(np.nan)], [_WHOLE]), ValueError, "frame 0: vertex 4", "nan"),
    of("picture")("NaN in frame 7 of the reference, the third", lambda w: dynmesh.picture(w.sequence, frames=2, reference=dynmesh.Sequence(np.stack([w.points, w.points, w.with_value(np.nan)]), w.faces, start=5)), ValueError, "reference: frame 7"),
    of("figures.render")("`points`: NaN", lambda w: _drawn(w, points=w.with_value(np.nan)), ValueError, "points: must be finite, but vertex 4"),
]  # fmt: skip


def _mask(name: str, argument: str, value: Any, error: type[Exception]) -> Case:
    """One wrong argument of a function that makes masks."""
    given = {"n_frames": 5, "n_vertices": 49, "share": 0.5, argument: value}
    more = {"faces": _SHEET.faces} if name == "patch_known" else {}
    run = lambda _: getattr(losses, name)(**given, **more)  # noqa: E731
    case = of(f"losses.{name}")
    return case(f"`{argument}`: {value!r}", run, error, f"{argument}:", f"not {value!r}")


_changes: dict[str, Callable[[World, Any], Any]] = {
    "add_noise": lambda w, frames: losses.add_noise(frames, w.faces, 0.1),
    "add_outliers": lambda w, frames: losses.add_outliers(frames, w.faces, 0.1),
    "camera_known": lambda w, frames: losses.camera_known(frames, w.faces, losses.orbit(w.vertices, 1)),
}  # fmt: skip


def _frames(name: str, given: str, frames: Any, *names: str) -> Case:
    """Wrong frames, given to a function that returns others of the same mesh."""
    run = lambda w: list(_changes[name](w, frames(w)))  # noqa: E731
    return Case(f"losses.{name}", given, run, (ValueError, TypeError), names)


_eye = of("losses.Camera")
_orbit = of("losses.orbit")

_losses = [
    *(
        _mask(name, *wrong)
        for name in ("random_known", "patch_known", "dropout")
        for wrong in (("share", 1, ValueError), ("share", "x", TypeError), ("n_frames", 0, ValueError), ("n_vertices", True, TypeError), ("seed", -1, ValueError))
    ),
    *(
        _frames(name, *wrong)
        for name in _changes
        for wrong in (
            ("frame 2 smaller", lambda w: [w.points, w.points, w.points[:48]], "frame 2:", "(49, 3)", "(48, 3)"),
            ("frame 0 of integers", lambda w: [w.points.astype(int)], "frame 0:", "int64"),
            ("frame 0 without its last vertex", lambda w: [w.points[:48]], "face 71", "vertex 48"),
        )
    ),
    _frames("add_noise", "all vertices in one place", lambda w: [0 * w.points], "frame 0", "edges"),
    of("losses.camera_known")("no camera for frame 2", lambda w: list(losses.camera_known([w.points] * 4, w.faces, lambda frame: losses.orbit(w.vertices, 1)(frame) if frame < 2 else [])), ValueError, "cameras:", "frame 2"),
    of("losses.add_noise")("1e300, for float32", lambda w: list(losses.add_noise([w.points.astype(np.float32)] * 2, w.faces, 1e300)), ValueError, "frame 1: vertex 0", "float32"),
    _orbit("`first_frame`: NaN in it", lambda w: losses.orbit(w.with_value(np.nan)), ValueError, "first_frame:", "vertex 4"),
    _orbit("all vertices in one place", lambda w: losses.orbit(0 * w.points, 1), ValueError, "first_frame:"),
    _eye("`up`: parallel to the view", lambda _: losses.Camera((4, 0, 0), (0, 0, 0), (2, 0, 0)), ValueError, "up:", "parallel"),
    of("losses.scan_points")("`cameras`: none", lambda w: list(losses.scan_points([w.vertices], w.faces, [])), ValueError, "cameras:", "at least one"),
    of("losses.depth_images")("`width`: 0", lambda w: list(losses.depth_images([w.vertices], w.faces, width=0)), ValueError, "width:", "not 0"),
    of("synth")("`ocean(1, grid=1)`", lambda _: synth.ocean(1, grid=1), ValueError, "grid:", "not 1"),
]  # fmt: skip

cases = [*_construction, *_pushes, *_states, *_tracking, *_functions, *_losses]
