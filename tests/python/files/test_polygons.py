"""Every function takes faces that are quads, other polygons or lists, and positions in lists."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import to_file
from meshes import turned

import dynmesh
from dynmesh import baselines, degrade, metrics
from dynmesh.polygons import Polygons

N = 7
CORNERS = np.arange(N * N).reshape(N, N)
QUADS = np.stack(
    [CORNERS[:-1, :-1], CORNERS[:-1, 1:], CORNERS[1:, 1:], CORNERS[1:, :-1]], axis=-1
).reshape(-1, 4)
TRIANGLES = QUADS[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
MIXED = [*TRIANGLES[:2].tolist(), *QUADS[1:].tolist()]
POLYGONS = Polygons(np.array([3, 3] + [4] * (len(QUADS) - 1)), np.concatenate(MIXED))

ROW, COLUMN = (axis.ravel().astype(float) for axis in np.indices((N, N)))
FIRST = np.stack([COLUMN, 1.3 * ROW, 0.4 * np.sin(1.3 * ROW + 0.7 * COLUMN)], axis=1)
FRAMES = np.stack([turned(FIRST, 0.02 * i) for i in range(5)])
KNOWN = np.arange(5 * N * N).reshape(5, -1) % 3 != 0
KNOWN[0] = True
CAMERAS = degrade.orbit(FIRST, 2)
SCAN = next(degrade.scan_points(FRAMES, TRIANGLES, CAMERAS, points=500))
IMAGE = next(degrade.depth_images(FRAMES, TRIANGLES, CAMERAS, width=40, height=30))


def completer(faces: Any, frames: Any) -> Any:
    made = dynmesh.Completer(faces, frames[0], training=frames[:4])
    return [made.push(frames[1], KNOWN[1].tolist()), made.state()]


def tracker(faces: Any, frames: Any) -> Any:
    made = dynmesh.Tracker(faces, frames[0], training=frames[:4])
    return [made.push(SCAN.points.tolist()), made.state()]


def registered(found: dynmesh.Registration) -> Any:
    return [found.vertices, found.observed, found.far]


def sequence(faces: Any, frames: Any) -> dynmesh.Sequence:
    return dynmesh.Sequence(frames, faces, KNOWN.tolist())


def report(found: dynmesh.Evaluation) -> Any:
    return [found.nmsve, found.mean]


def as_given(arrays: Any, frames: Any) -> Any:
    """Arrays as lists if the frames are lists."""
    if isinstance(frames, np.ndarray):
        return arrays
    return [np.array(array).tolist() for array in arrays]


def written(frames: Any) -> Any:
    header = dynmesh.Header(TRIANGLES, len(frames), N * N, np.dtype(float), has_known=True)
    pairs = zip(frames, KNOWN.tolist(), strict=True)
    made = [dynmesh.Frame(np.array(points), np.array(known)) for points, known in pairs]
    dynmesh.write("written.npz", to_file.frames_of(header, made))
    again = dynmesh.read("written.npz", known=KNOWN[::-1].tolist())
    return [again.vertices, again.known]


def read_with_faces(faces: Any, frames: Any) -> Any:
    path = Path("positions.pc2")
    dynmesh.write(path, dynmesh.Sequence(np.array(frames, np.float32), TRIANGLES))
    for beside in path.parent.glob("positions*.obj"):
        beside.unlink()
    read = dynmesh.read(path, faces=faces)
    return [read.faces, read.vertices]


CALLS: dict[str, Callable[[Any, Any], Any]] = {
    "Completer": completer,
    "Tracker": tracker,
    "Sequence": lambda f, p: [sequence(f, p).faces, sequence(f, p).vertices, sequence(f, p).known],
    "Header": lambda f, _: dynmesh.Header(f, 1, N * N, np.dtype(float)).faces,
    "read": read_with_faces,
    "create": lambda _, p: written(p),
    "complete": lambda f, p: list(to_file.pushed(f, p, KNOWN.tolist())),
    "complete a sequence": lambda f, p: dynmesh.read(dynmesh.complete(sequence(f, p))).vertices,
    "evaluate": lambda f, p: report(
        dynmesh.evaluate(dynmesh.Sequence(p, f), dynmesh.Sequence(FRAMES * 1.1, f))
    ),
    "info": lambda f, p: str(dynmesh.diagnose(sequence(f, p)).findings),
    "register": lambda f, p: registered(
        dynmesh.register(f, p[0], SCAN.points.tolist(), align=False)
    ),
    "register images": lambda f, p: registered(dynmesh.register(f, p[0], IMAGE, align=False)),
    "push_depth": lambda f, p: dynmesh.Tracker(f, p[0]).push_depth(*as_given(IMAGE, p)),
    "push_depth of one camera": lambda f, p: dynmesh.Tracker(f, p[0]).push_depth(
        *as_given([images[0] for images in IMAGE], p)
    ),
    "whole_frame": lambda f, p: dynmesh.whole_frame(f, p, KNOWN[::-1].tolist()).positions,
    "find_alignment": lambda f, p: dynmesh.find_alignment(f, p[0], SCAN.points.tolist()).before,
    "cells": lambda f, _: dynmesh.cells(f, N * N),
    "adjacency": lambda f, _: dynmesh.adjacency(f, N * N).toarray(),
    "laplacian": lambda f, _: dynmesh.laplacian(f, N * N).toarray(),
    "nmsve": lambda f, p: metrics.nmsve(f, p, FRAMES[::-1].tolist()),
    "vertex_error": lambda _, p: metrics.vertex_error(p, FRAMES[::-1].tolist()),
    "summary": lambda _, p: metrics.summary(np.array(p)[0, 0].tolist()).rms,
    "bounding_box_diagonal": lambda _, p: metrics.bounding_box_diagonal(p[0]),
    "LeastSquaresMesh": lambda f, p: baselines.LeastSquaresMesh(f, N * N).complete(
        p[1], KNOWN[1].tolist()
    ),
    "LaplacianInterpolation": lambda f, p: baselines.LaplacianInterpolation(
        f, N * N, reference=p[0], weights="inverse_distance"
    ).complete(p[1], KNOWN[1].tolist()),
    "add_noise": lambda f, p: list(degrade.add_noise(p, f, 0.1)),
    "add_outliers": lambda f, p: list(degrade.add_outliers(p, f, 0.1)),
    "camera_known": lambda f, p: list(degrade.camera_known(p, f, CAMERAS)),
    "patch_known": lambda f, _: list(degrade.patch_known(f, 3, N * N, 0.3)),
    "orbit": lambda _, p: degrade.orbit(p[0])(0)[0].position,
    "scan_points": lambda f, p: next(degrade.scan_points(p, f, CAMERAS, points=500)).points,
    "depth_images": lambda f, p: (
        next(degrade.depth_images(p, f, CAMERAS, width=40, height=30)).depth
    ),
    "view": lambda f, p: dynmesh.view(sequence(f, p), max_frames=2).shown.triangles,
    "picture": lambda f, p: dynmesh.picture(sequence(f, p), count=1, size=32).size,
}
FACES: dict[str, Any] = {
    "triangles in lists": TRIANGLES.tolist(),
    "quads": QUADS,
    "quads in tuples": tuple(map(tuple, QUADS.tolist())),
    "mixed lists": MIXED,
    "rows of an array": [np.array(polygon, np.uint32) for polygon in MIXED],
    "Polygons": POLYGONS,
}
NEEDS = {"view": "pyvista", "picture": "pyvista", "adjacency": "scipy", "laplacian": "scipy"}


@pytest.mark.parametrize("call", CALLS)
def test_every_function_takes_polygons_and_lists(
    call: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip(NEEDS.get(call, "numpy"))
    monkeypatch.chdir(tmp_path)
    expected = CALLS[call](TRIANGLES, FRAMES)
    for given in FACES.values():
        for points in (FRAMES, FRAMES.tolist()):
            found = CALLS[call](given, points)
            for ours, theirs in zip(listed(found), listed(expected), strict=True):
                np.testing.assert_array_equal(ours, theirs)


def listed(found: Any) -> Any:
    return found if isinstance(found, list | tuple) else [found]


def test_lists_of_whole_numbers_are_positions_but_arrays_of_them_are_not() -> None:
    corners: Any = [[0, 0, 0], [2, 0, 0], [2, 3, 0], [0, 3, 0]]
    known: Any = [1, 0, 1, 1]
    completed = dynmesh.Completer([[0, 1, 2, 3]], corners).push(corners, known)
    assert completed.dtype == np.float64
    np.testing.assert_allclose(completed, corners, atol=1e-12)
    lists: dict[str, Any] = {"vertices": [corners] * 2, "faces": [[0, 1, 2, 3]], "times": [3, 7]}
    sequence = dynmesh.Sequence(**lists)
    assert sequence.vertices.dtype == np.float64
    with pytest.raises(TypeError, match="first_frame: must be float32 or float64, not int64"):
        dynmesh.Completer([[0, 1, 2, 3]], np.array(corners))


def test_a_sequence_keeps_the_polygons() -> None:
    every = Polygons(np.full(len(QUADS), 4), QUADS.ravel())
    given: Any
    for given, polygons in ((QUADS, every), (MIXED, POLYGONS), (POLYGONS, POLYGONS)):
        made = dynmesh.Sequence(FRAMES, given)
        np.testing.assert_array_equal(made.faces, TRIANGLES)
        np.testing.assert_equal(made.polygons, polygons)
        assert made[1:3].polygons is made.polygons
    assert dynmesh.Sequence(FRAMES, FACES["triangles in lists"]).polygons is None


BAD: dict[str, tuple[Any, str]] = {
    "two corners": ([[0, 1, 2], [0, 1]], "faces: polygon 1 has 2 corners"),
    "no corners": ([[0, 1, 2], []], "faces: polygon 1 has 0 corners"),
    "a corner twice": (np.array([[0, 1, 8, 7], [0, 1, 8, 1]]), "polygon 1 has the corner 1 twice"),
    "a corner of -1": ([[0, 1, 2], [0, 1, 8, -1]], "faces: polygon 1 refers to vertex -1"),
    "too large a corner": ([[0, 1, 2], [0, 1, 8, 49]], "faces: polygon 1 refers to vertex 49"),
    "no list": ([[0, 1, 2], 5], "faces: polygon 1 must be integers"),
    "a fraction": ([[0, 1, 2], [0, 1, 8, 0.5]], "faces: polygon 1 must be integers"),
    "lists in lists": ([[0, 1, 2], [0, 1, [8, 7]]], "faces: polygon 1 must be integers"),
}
POSITIONS_ALONE = {"read", "create", "orbit", "vertex_error", "summary"}
AT_ONCE = {*CALLS} - POSITIONS_ALONE - {"bounding_box_diagonal"}


@pytest.mark.parametrize("bad", BAD)
def test_bad_polygons_are_named_by_every_function(bad: str) -> None:
    pytest.importorskip("pyvista")
    faces, message = BAD[bad]
    for call in AT_ONCE:
        with pytest.raises((ValueError, TypeError), match=message):
            CALLS[call](faces, FRAMES)
