"""Cases of the functions of the package: streams, measures, baselines, whole frames and others."""

from collections.abc import Callable
from typing import Any

import numpy as np
from meshes import join, sheet

import dynmesh
from dynmesh import baselines, metrics
from dynmesh.draw import figures

from .case import Case, World

Run = Callable[[World], Any]


def of(call: str) -> Callable[..., Case]:
    """Makes cases of one call."""

    def case(given: str, run: Run, error: type[Exception], *names: str) -> Case:
        return Case(call, given, run, error, names)

    return case


_whole = np.ones(49, bool)
_complete = of("complete")


def _stream(world: World, last: Any) -> Any:
    vertices = np.stack([world.vertices, world.points, last])
    masks = np.ones((3, 49), bool)
    return dynmesh.read(dynmesh.complete(dynmesh.Sequence(vertices, world.faces, masks)))


streams = [
    _complete("an array", lambda w: dynmesh.complete(w.points), TypeError, "faces:", "missing"),
    _complete("infinity in frame 2, marked known", lambda w: _stream(w, w.with_value(np.inf)), ValueError, "frame 2: points: row 4", "inf"),
    _complete("`start`: a frame that is not there", lambda w: dynmesh.complete(w.sequence, start=99), ValueError, "start:", "no frame 99"),
    _complete("`speed=1`", lambda w: dynmesh.complete(w.sequence, speed=1), TypeError, "'speed'"),  # type: ignore[call-arg]
    _complete("`noise=-1`", lambda w: dynmesh.complete(w.sequence, noise=-1.0), ValueError, "noise:", "-1"),
    _complete("a report before its time", lambda _: dynmesh.complete("body.npz").report, ValueError, "report:", "go through"),
]  # fmt: skip

_cells = of("cells")

topology = [
    _cells("`n_vertices`: -1", lambda w: dynmesh.topology.cells(w.faces, -1), ValueError, "n_vertices:", "-1"),
    _cells("`n_vertices`: 49.0", lambda w: dynmesh.topology.cells(w.faces, 49.0), TypeError, "n_vertices:", "49.0"),  # type: ignore[arg-type]
    _cells("`n_vertices`: 2^31", lambda w: dynmesh.topology.cells(w.faces, 2**31), ValueError, "n_vertices:", str(2**31)),
    _cells("`n_vertices`: one too few", lambda w: dynmesh.topology.cells(w.faces, 48), ValueError, "faces: face 71", "vertex 48", "48 vertices"),
]  # fmt: skip

_nmsve = of("metrics.nmsve")
_vertex_error = of("metrics.vertex_error")
_summary = of("metrics.summary")

measures = [
    of("metrics.bounding_box_diagonal")("`frame`: two frames", lambda w: metrics.bounding_box_diagonal(np.stack([w.points] * 2)), ValueError, "frame:", "(k, 3)", "(2, 49, 3)"),
    _nmsve("`completed`: one row too few", lambda w: metrics.nmsve(w.faces, w.points, w.points[:48]), ValueError, "completed:", "(48, 3)", "(49, 3)"),
    _nmsve("`completed`: NaN in it", lambda w: metrics.nmsve(w.faces, w.points, w.with_value(np.nan)), ValueError, "completed: vertex 4", "nan"),
    _nmsve("`reference`: infinity in it", lambda w: metrics.nmsve(w.faces, w.with_value(np.inf), w.points), ValueError, "reference: vertex 4", "inf"),
    _nmsve("no vertex", lambda w: metrics.nmsve(w.faces[:0], w.empty, w.empty), ValueError, "reference:", "no vertices"),
    _nmsve("`faces` of a larger mesh", lambda w: metrics.nmsve(w.faces + 1, w.points, w.points), ValueError, "faces: face 71", "vertex 49"),
    _vertex_error("a frame and a sequence", lambda w: metrics.vertex_error(w.points, w.points[None]), ValueError, "completed:", "(1, 49, 3)", "(49, 3)"),
    _summary("nothing", lambda _: metrics.summary(np.zeros(0)), ValueError, "errors:", "empty"),
    _summary("NaN in it", lambda _: metrics.summary(np.array([0, np.nan])), ValueError, "errors: position 1"),
]  # fmt: skip

_lsm = of("baselines.LeastSquaresMesh")
_lia = of("baselines.LaplacianInterpolation")


def _mesh(world: World, points: Any, known: Any, **more: Any) -> Any:
    return baselines.LeastSquaresMesh(world.faces, 49).complete(points, known, **more)


def _two_parts(call: Any, known: Any) -> Any:
    """`call` for a mesh of 49 vertices and one of 16, where the vertices of one part are known."""
    mesh = join(sheet(7), sheet(4, 10.0))
    return call(mesh.faces, 65).complete(mesh.vertices, known(np.arange(65)))


def _interpolation(world: World, **more: Any) -> Any:
    return baselines.LaplacianInterpolation(world.faces, 49, **more)


other_methods = [
    _lsm("nothing known", lambda w: _mesh(w, w.points, ~_whole), ValueError, "known: component 0", "49 vertices"),
    _lsm("the second component not known", lambda _: _two_parts(baselines.LeastSquaresMesh, lambda v: v < 49), ValueError, "known: component 1", "16 vertices", "49"),
    _lia("the first component not known", lambda _: _two_parts(baselines.LaplacianInterpolation, lambda v: v > 48), ValueError, "known: component 0", "49 vertices"),
    _lsm("`points`: NaN, marked known", lambda w: _mesh(w, w.with_value(np.nan), w.known), ValueError, "points: row 4"),
    _lsm("`previous`: NaN in it", lambda w: _mesh(w, w.points, w.known, previous=w.with_value(np.nan)), ValueError, "previous: vertex 4"),
    _lia("`objective='x'`", lambda w: _interpolation(w, objective="x"), ValueError, "objective:", "'x'", "'harmonic'"),
    _lia("`weights='x'`", lambda w: _interpolation(w, weights="x"), ValueError, "weights:", "'x'", "'uniform'"),
    _lia("inverse distances of nothing", lambda w: _interpolation(w, weights="inverse_distance"), ValueError, "reference:", "is required"),
    _lia("a reference for nothing", lambda w: _interpolation(w, reference=w.points), ValueError, "reference:", "inverse_distance"),
    _lsm("`n_vertices`: -1", lambda w: baselines.LeastSquaresMesh(w.faces, -1), ValueError, "n_vertices:", "-1"),
]  # fmt: skip

_whole_frame = of("whole_frame")
_render = of("draw.figures.render")


def _put_together(world: World, frames: Any = None, known: Any = None, **more: Any) -> Any:
    frames = world.sequence.vertices if frames is None else frames
    return dynmesh.whole_frames.whole_frame(world.faces, frames, known, **more)


def _drawn(world: World, **more: Any) -> Any:
    view = figures.View.of(world.vertices, more.pop("up", "z"), 0.0)
    plain = {"places": np.zeros(49), "colours": ("#d7dce3",)}
    drawn = {"faces": world.faces, "points": world.vertices, "view": view, **plain}
    return figures.render(**{**drawn, **more})


_masks = np.ones((3, 49), bool)

pictures_and_whole_frames = [
    _whole_frame("`frames`: an iterator", lambda w: _put_together(w, iter([w.points])), TypeError, "frames:", "must be a numpy array"),
    _whole_frame("`known`: an iterator", lambda w: _put_together(w, known=iter(_masks)), TypeError, "known:", "must be a numpy array"),
    _whole_frame("`frames`: none", lambda w: _put_together(w, w.sequence.vertices[:0]), ValueError, "has no frames"),
    _whole_frame("`frame`: 3 of 3", lambda w: _put_together(w, frame=3), ValueError, "frame:", "is 3, not 3"),
    _whole_frame("`frame`: -1", lambda w: _put_together(w, frame=-1), ValueError, "frame:", "-1"),
    _whole_frame("`frame='worst'`", lambda w: _put_together(w, frame="worst"), TypeError, "frame:", "'worst'"),
    _whole_frame("fewer masks than frames", lambda w: _put_together(w, known=_masks[:2]), ValueError, "known:", "(3, 49)", "(2, 49)"),
    _whole_frame("no vertex known", lambda w: _put_together(w, known=~_masks), ValueError, "no vertex is known"),
    _whole_frame("frame 1 smaller", lambda w: _put_together(w, [w.points, w.points[:5]]), ValueError, "frames:", "cannot be converted"),
    _whole_frame("frames of text", lambda w: _put_together(w, w.sequence.vertices.astype(str)), TypeError, "frames:", "float32 or float64"),
    _whole_frame("NaN, marked known", lambda w: _put_together(w, [w.with_value(np.nan)], [_whole]), ValueError, "frame 0: vertex 4", "nan"),
    of("picture")("NaN in frame 7 of the reference, the third", lambda w: dynmesh.picture(w.sequence, frames=2, reference=dynmesh.Sequence(np.stack([w.points, w.points, w.with_value(np.nan)]), w.faces, start=5)), ValueError, "reference: frame 7"),
    _render("`faces`: an index of k", lambda w: _drawn(w, faces=w.faces + 1), ValueError, "faces:", "vertex 49"),
    _render("`points`: NaN", lambda w: _drawn(w, points=w.with_value(np.nan)), ValueError, "points: must be finite, but vertex 4"),
    _render("`places`: NaN", lambda w: _drawn(w, places=np.full(49, np.nan)), ValueError, "places: must be finite"),
    _render("`up`: w", lambda w: _drawn(w, up="w"), ValueError, "up:", "'w'"),
]  # fmt: skip

cases = [*streams, *topology, *measures, *other_methods, *pictures_and_whole_frames]
