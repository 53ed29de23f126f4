"""Cases of the functions of the package: streams, topology, measures, baselines, losses."""

from collections.abc import Callable
from typing import Any

import numpy as np

import dynmesh
from dynmesh import baselines, degrade, metrics, synth

from .case import Case, World

Run = Callable[[World], Any]
_NAN = float("nan")


def _of(call: str) -> Callable[..., Case]:
    """Makes cases of one call."""

    def case(given: str, run: Run, error: type[Exception], *names: str) -> Case:
        return Case(call, given, run, error, names)

    return case


def _stream(world: World, frames: Any, known: Any = None, **settings: Any) -> list[Any]:
    return list(dynmesh.complete(world.faces, frames, known, **settings))


_complete = _of("complete")
_whole = np.ones(49, bool)

streams = [
    _complete("no frame", lambda w: _stream(w, []), ValueError, "frames:", "empty"),
    _complete("`frames`: None", lambda w: _stream(w, None), TypeError, "frames:", "NoneType"),
    _complete("`known`: a number", lambda w: _stream(w, [], 5), TypeError, "known:", "int"),
    _complete(
        "`frames`: one frame, not several",
        lambda w: _stream(w, w.vertices),
        ValueError,
        "first_frame:",
        "(3,)",
    ),
    _complete(
        "NaN in frame 0",
        lambda w: _stream(w, [w.with_value(_NAN)]),
        ValueError,
        "first_frame: vertex 4",
        "nan",
    ),
    _complete(
        "a vertex of frame 0 not known",
        lambda w: _stream(w, [w.vertices], [np.arange(49) != 7]),
        ValueError,
        "known: vertex 7",
        "frame 0",
    ),
    _complete(
        "`known` of frame 0 one too few",
        lambda w: _stream(w, [w.vertices], [_whole[:48]]),
        ValueError,
        "known:",
        "(49,)",
        "(48,)",
    ),
    _complete(
        "`known` of frame 0 integers",
        lambda w: _stream(w, [w.vertices], [_whole.astype(int)]),
        TypeError,
        "known:",
        "int64",
    ),
    _complete(
        "fewer masks than frames",
        lambda w: _stream(w, [w.vertices, w.points], [_whole]),
        ValueError,
        "known:",
        "frame 1",
    ),
    _complete(
        "more masks than frames",
        lambda w: _stream(w, [w.vertices], [_whole] * 2),
        ValueError,
        "frames:",
        "frame 1",
    ),
    _complete(
        "frame 1 one row too few",
        lambda w: _stream(w, [w.vertices, w.points[:48]]),
        ValueError,
        "frame 1: points:",
        "48 rows",
    ),
    _complete(
        "infinity in frame 2, marked known",
        lambda w: _stream(w, [w.vertices, w.points, w.with_value(np.inf)], [_whole] * 3),
        ValueError,
        "frame 2: points: row 4",
        "inf",
    ),
    _complete(
        "`speed=1`", lambda w: _stream(w, [w.vertices], speed=1), TypeError, "speed:", "threads"
    ),
]

_cells = _of("cells")
_adjacency = _of("adjacency")
_laplacian = _of("laplacian")

topology = [
    _cells("`n_vertices`: -1", lambda w: dynmesh.cells(w.faces, -1), ValueError, "n_vertices:", "-1"),
    _cells("`n_vertices`: 49.0", lambda w: dynmesh.cells(w.faces, 49.0), TypeError, "n_vertices:", "float"),  # type: ignore[arg-type]
    _cells("`n_vertices`: True", lambda w: dynmesh.cells(w.faces, True), TypeError, "n_vertices:", "bool"),
    _cells("`n_vertices`: 2^31", lambda w: dynmesh.cells(w.faces, 2**31), ValueError, "n_vertices:", str(2**31)),
    _cells("`n_vertices`: one too few", lambda w: dynmesh.cells(w.faces, 48), ValueError, "faces: face 71", "vertex 48", "48 vertices"),
    _cells("`faces`: float64", lambda w: dynmesh.cells(w.faces * 1.0, 49), TypeError, "faces:", "float64"),
    _cells("`faces`: (m, 4)", lambda _: dynmesh.cells(np.zeros((5, 4), int), 49), ValueError, "faces:", "(5, 4)"),
    _adjacency("`n_vertices`: -1", lambda w: dynmesh.adjacency(w.faces, -1), ValueError, "n_vertices:", "-1"),
    _laplacian("`n_vertices`: None", lambda w: dynmesh.laplacian(w.faces, None), TypeError, "n_vertices:", "NoneType"),  # type: ignore[arg-type]
]  # fmt: skip

_nmsve = _of("metrics.nmsve")
_vertex_error = _of("metrics.vertex_error")
_summary = _of("metrics.summary")

measures = [
    _nmsve("`completed`: one row too few", lambda w: metrics.nmsve(w.faces, w.points, w.points[:48]), ValueError, "completed:", "(48, 3)", "(49, 3)"),
    _nmsve("`completed`: NaN in it", lambda w: metrics.nmsve(w.faces, w.points, w.with_value(_NAN)), ValueError, "completed: vertex 4", "nan"),
    _nmsve("`reference`: infinity in it", lambda w: metrics.nmsve(w.faces, w.with_value(np.inf), w.points), ValueError, "reference: vertex 4", "inf"),
    _nmsve("`reference`: one axis", lambda w: metrics.nmsve(w.faces, w.points[0], w.points), ValueError, "reference:", "(3,)"),
    _nmsve("`reference`: integers", lambda w: metrics.nmsve(w.faces, w.points.astype(int), w.points), TypeError, "reference:", "int64"),
    _nmsve("no vertex", lambda w: metrics.nmsve(w.faces[:0], w.empty, w.empty), ValueError, "reference:", "no vertices"),
    _nmsve("`faces` of a larger mesh", lambda w: metrics.nmsve(w.faces + 1, w.points, w.points), ValueError, "faces: face 71", "vertex 49"),
    _vertex_error("a frame and a sequence", lambda w: metrics.vertex_error(w.points, w.points[None]), ValueError, "completed:", "(1, 49, 3)", "(49, 3)"),
    _vertex_error("text", lambda w: metrics.vertex_error("abc", w.points), TypeError, "reference:", "<U3"),  # type: ignore[arg-type]
    _summary("nothing", lambda _: metrics.summary(np.zeros(0)), ValueError, "errors:", "empty"),
    _summary("NaN in it", lambda _: metrics.summary(np.array([0, _NAN])), ValueError, "errors: position 1"),
    _summary("integers", lambda _: metrics.summary(np.arange(3)), TypeError, "errors:", "int64"),  # type: ignore[arg-type]
]  # fmt: skip

_lsm = _of("baselines.least_squares_mesh")
_lia = _of("baselines.laplacian_interpolation")
_class = _of("baselines.LeastSquaresMesh")


def _mesh(world: World, points: Any, known: Any, **more: Any) -> Any:
    return baselines.least_squares_mesh(world.faces, points, known, **more)


def _interpolation(world: World, **more: Any) -> Any:
    return baselines.laplacian_interpolation(world.faces, world.points, world.known, **more)


rivals = [
    _lsm("nothing known", lambda w: _mesh(w, w.points, ~_whole), ValueError, "known: component 0", "49 vertices"),
    _lsm("`known`: one too few", lambda w: _mesh(w, w.points, w.known[:48]), ValueError, "known:", "48 rows", "49"),
    _lsm("`known`: integers", lambda w: _mesh(w, w.points, w.known.astype(int)), TypeError, "known:", "int64"),
    _lsm("`points`: None", lambda w: _mesh(w, None, w.known), TypeError, "points:", "None"),
    _lsm("`points`: NaN, marked known", lambda w: _mesh(w, w.with_value(_NAN), w.known), ValueError, "points: row 4"),
    _lsm("`previous`: NaN in it", lambda w: _mesh(w, w.points, w.known, previous=w.with_value(_NAN)), ValueError, "previous: vertex 4"),
    _lsm("`previous`: one row too few", lambda w: _mesh(w, w.points, w.known, previous=w.points[1:]), ValueError, "previous:", "48 rows", "49"),
    _lia("`objective='x'`", lambda w: _interpolation(w, objective="x"), ValueError, "objective:", "'x'", "'harmonic'"),
    _lia("`objective=1`", lambda w: _interpolation(w, objective=1), TypeError, "objective:", "int"),
    _lia("`weights='x'`", lambda w: _interpolation(w, weights="x"), ValueError, "weights:", "'x'", "'uniform'"),
    _lia("inverse distances of nothing", lambda w: _interpolation(w, weights="inverse_distance"), ValueError, "reference:", "is required"),
    _lia("a reference for nothing", lambda w: _interpolation(w, reference=w.points), ValueError, "reference:", "inverse_distance"),
    _class("`n_vertices`: -1", lambda w: baselines.LeastSquaresMesh(w.faces, -1), ValueError, "n_vertices:", "-1"),
    _class("`n_vertices`: text", lambda w: baselines.LeastSquaresMesh(w.faces, "49"), TypeError, "n_vertices:", "str"),  # type: ignore[arg-type]
]  # fmt: skip

_random = _of("degrade.random_known")
_camera = _of("degrade.camera_known")
_patch = _of("degrade.patch_known")
_dropout = _of("degrade.dropout")
_noise = _of("degrade.add_noise")
_outliers = _of("degrade.add_outliers")
_orbit = _of("degrade.orbit")
_eye = _of("degrade.Camera")
_synth = _of("synth")


def _seen(world: World, frames: Any, cameras: Any = None) -> list[Any]:
    cameras = world.cameras if cameras is None else cameras
    return list(degrade.camera_known(frames, world.faces, cameras))


def _noisy(world: World, frames: Any, sigma: Any = 0.1) -> list[Any]:
    return list(degrade.add_noise(frames, world.faces, sigma))


losses = [
    _random("`share`: 0", lambda _: degrade.random_known(5, 49, 0), ValueError, "share:", "not 0"),
    _random("`share`: 30, for 30 %", lambda _: degrade.random_known(5, 49, 30), ValueError, "share:", "30"),
    _random("`share`: NaN", lambda _: degrade.random_known(5, 49, _NAN), ValueError, "share:", "nan"),
    _random("`share`: text", lambda _: degrade.random_known(5, 49, "x"), TypeError, "share:", "'x'"),  # type: ignore[arg-type]
    _random("`n_frames`: 0", lambda _: degrade.random_known(0, 49, 0.5), ValueError, "n_frames:", "not 0"),
    _random("`n_vertices`: 49.0", lambda _: degrade.random_known(5, 49.0, 0.5), TypeError, "n_vertices:", "49.0"),  # type: ignore[arg-type]
    _random("`seed`: -1", lambda _: degrade.random_known(5, 49, 0.5, seed=-1), ValueError, "seed:", "-1"),
    _camera("no camera", lambda w: _seen(w, [w.points], []), ValueError, "cameras:", "none"),
    _camera("something else for a camera", lambda w: _seen(w, [w.points], [3]), TypeError, "cameras: item 0", "3"),
    _camera("`frames`: lists", lambda w: _seen(w, [w.points.tolist()]), TypeError, "frame 0:", "list"),
    _camera("frame 1 smaller than frame 0", lambda w: _seen(w, [w.points, w.points[:3]]), ValueError, "frame 1:", "(49, 3)", "(3, 3)"),
    _camera("`faces`: a list", lambda w: degrade.camera_known([], [[0, 1, 2]], w.cameras), TypeError, "faces:", "list"),  # type: ignore[arg-type]
    _patch("`share`: 1.0", lambda w: degrade.patch_known(w.faces, 5, 49, 1.0), ValueError, "share:", "1.0"),
    _patch("`patches`: 0", lambda w: degrade.patch_known(w.faces, 5, 49, 0.5, patches=0), ValueError, "patches:", "not 0"),
    _patch("`lifetime`: 0", lambda w: degrade.patch_known(w.faces, 5, 49, 0.5, lifetime=0), ValueError, "lifetime:", "not 0"),
    _patch("`n_vertices`: too few", lambda w: degrade.patch_known(w.faces, 5, 40, 0.5), ValueError, "faces: face 29", "vertex 40"),
    _dropout("`share`: -0.1", lambda _: degrade.dropout(5, 49, -0.1), ValueError, "share:", "-0.1"),
    _noise("`sigma`: -1", lambda w: _noisy(w, [w.points], -1), ValueError, "sigma:", "-1"),
    _noise("`sigma`: NaN", lambda w: _noisy(w, [w.points], _NAN), ValueError, "sigma:", "nan"),
    _noise("`sigma`: 1e300, for float32", lambda w: _noisy(w, [w.points.astype(np.float32)] * 2, 1e300), ValueError, "frame 1: vertex 0", "float32"),
    _noise("NaN in frame 0", lambda w: _noisy(w, [w.with_value(_NAN)]), ValueError, "frame 0:", "vertex 4", "nan"),
    _noise("all vertices in one place", lambda w: _noisy(w, [0 * w.points]), ValueError, "frame 0"),
    _noise("integers", lambda w: _noisy(w, [w.points.astype(int)]), TypeError, "frame 0:", "int64"),
    _outliers("`share`: 1.1", lambda w: degrade.add_outliers([], w.faces, 1.1), ValueError, "share:", "1.1"),
    _outliers("`distance`: 0", lambda w: degrade.add_outliers([], w.faces, 0.1, distance=0), ValueError, "distance:", "not 0"),
    _orbit("`n_cameras`: 0", lambda w: degrade.orbit(w.points, 0), ValueError, "n_cameras:", "not 0"),
    _orbit("`up`: zero", lambda w: degrade.orbit(w.points, 1, up=(0, 0, 0)), ValueError, "up:", "(0, 0, 0)"),
    _orbit("`up`: two numbers", lambda w: degrade.orbit(w.points, 1, up=(0, 1)), ValueError, "up:", "(0, 1)"),  # type: ignore[arg-type]
    _orbit("`up`: a number", lambda w: degrade.orbit(w.points, 1, up=5), TypeError, "up:", "5"),  # type: ignore[arg-type]
    _orbit("`elevation`: 90", lambda w: degrade.orbit(w.points, 1, elevation=90), ValueError, "elevation:", "not 90"),
    _orbit("all vertices in one place", lambda w: degrade.orbit(0 * w.points, 1), ValueError, "first_frame:"),
    _eye("`target` is `position`", lambda _: degrade.Camera((1, 2, 3), (1, 2, 3), (0, 0, 1)), ValueError, "target:", "(1, 2, 3)"),
    _synth("`ocean(0)`", lambda _: synth.ocean(0), ValueError, "frames:", "not 0"),
    _synth("`walker(2.5)`", lambda _: synth.walker(2.5), TypeError, "frames:", "2.5"),  # type: ignore[arg-type]
    _synth("`ocean(5, fps=0)`", lambda _: synth.ocean(5, fps=0), ValueError, "fps:", "not 0"),
]  # fmt: skip

cases = [*streams, *topology, *measures, *rivals, *losses]
