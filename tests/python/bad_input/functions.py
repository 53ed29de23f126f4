"""Cases of the functions of the package: streams, topology, measures, baselines."""

from collections.abc import Callable
from typing import Any

import numpy as np
from meshes import join, sheet

import dynmesh
from dynmesh import baselines, metrics

from .case import Case, World

Run = Callable[[World], Any]
_NAN = float("nan")


def of(call: str) -> Callable[..., Case]:
    """Makes cases of one call."""

    def case(given: str, run: Run, error: type[Exception], *names: str) -> Case:
        return Case(call, given, run, error, names)

    return case


def _stream(world: World, frames: Any, known: Any = None, **settings: Any) -> list[Any]:
    return list(dynmesh.complete(world.faces, frames, known, **settings))


_complete = of("complete")
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

_cells = of("cells")
_adjacency = of("adjacency")
_laplacian = of("laplacian")

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

_nmsve = of("metrics.nmsve")
_vertex_error = of("metrics.vertex_error")
_summary = of("metrics.summary")

measures = [
    _nmsve("`completed`: one row too few", lambda w: metrics.nmsve(w.faces, w.points, w.points[:48]), ValueError, "completed:", "(48, 3)", "(49, 3)"),
    _nmsve("`completed`: NaN in it", lambda w: metrics.nmsve(w.faces, w.points, w.with_value(_NAN)), ValueError, "completed: vertex 4", "nan"),
    _nmsve("`reference`: infinity in it", lambda w: metrics.nmsve(w.faces, w.with_value(np.inf), w.points), ValueError, "reference: vertex 4", "inf"),
    _nmsve("`reference`: one axis", lambda w: metrics.nmsve(w.faces, w.points[0], w.points), ValueError, "reference:", "(3,)"),
    _nmsve("`reference`: integers", lambda w: metrics.nmsve(w.faces, w.points.astype(int), w.points), TypeError, "reference:", "int64"),
    _nmsve("no vertex", lambda w: metrics.nmsve(w.faces[:0], w.empty, w.empty), ValueError, "reference:", "no vertices"),
    _nmsve("`faces` of a larger mesh", lambda w: metrics.nmsve(w.faces + 1, w.points, w.points), ValueError, "faces: face 71", "vertex 49"),
    _vertex_error("a frame and a sequence", lambda w: metrics.vertex_error(w.points, w.points[None]), ValueError, "completed:", "(1, 49, 3)", "(49, 3)"),
    _vertex_error("one axis", lambda w: metrics.vertex_error(w.points[0], w.points[0]), ValueError, "reference:", "(3,)"),
    _vertex_error("text", lambda w: metrics.vertex_error("abc", w.points), TypeError, "reference:", "<U3"),  # type: ignore[arg-type]
    _summary("nothing", lambda _: metrics.summary(np.zeros(0)), ValueError, "errors:", "empty"),
    _summary("NaN in it", lambda _: metrics.summary(np.array([0, _NAN])), ValueError, "errors: position 1"),
    _summary("integers", lambda _: metrics.summary(np.arange(3)), TypeError, "errors:", "int64"),  # type: ignore[arg-type]
]  # fmt: skip

_lsm = of("baselines.least_squares_mesh")
_lia = of("baselines.laplacian_interpolation")
_class = of("baselines.LeastSquaresMesh")


def _mesh(world: World, points: Any, known: Any, **more: Any) -> Any:
    return baselines.least_squares_mesh(world.faces, points, known, **more)


def _two_parts(call: Any, known: Any) -> Any:
    """`call` for a mesh of 49 vertices and one of 16, where the vertices of one part are known."""
    mesh = join(sheet(7), sheet(4, 10.0))
    return call(mesh.faces, mesh.vertices, known(np.arange(65)))


def _interpolation(world: World, **more: Any) -> Any:
    return baselines.laplacian_interpolation(world.faces, world.points, world.known, **more)


other_methods = [
    _lsm("nothing known", lambda w: _mesh(w, w.points, ~_whole), ValueError, "known: component 0", "49 vertices"),
    _lsm("the second component not known", lambda _: _two_parts(baselines.least_squares_mesh, lambda v: v < 49), ValueError, "known: component 1", "16 vertices", "49"),
    _lia("the first component not known", lambda _: _two_parts(baselines.laplacian_interpolation, lambda v: v > 48), ValueError, "known: component 0", "49 vertices"),
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
    _lia("`previous`: one row too few", lambda w: _interpolation(w, previous=w.points[1:]), ValueError, "previous:", "48 rows", "49"),
    _class("`n_vertices`: -1", lambda w: baselines.LeastSquaresMesh(w.faces, -1), ValueError, "n_vertices:", "-1"),
    _class("`n_vertices`: text", lambda w: baselines.LeastSquaresMesh(w.faces, "49"), TypeError, "n_vertices:", "str"),  # type: ignore[arg-type]
]  # fmt: skip

cases = [*streams, *topology, *measures, *other_methods]
