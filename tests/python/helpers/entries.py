"""All functions that take positions, masks or faces, with arrays that they accept."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import to_file
from meshes import Mesh

import dynmesh
from dynmesh import baselines, losses, metrics, scans

N = 5
CORNERS = np.arange(N * N).reshape(N, N)
QUADS = np.stack(
    [CORNERS[:-1, :-1], CORNERS[:-1, 1:], CORNERS[1:, 1:], CORNERS[1:, :-1]], axis=-1
).reshape(-1, 4)
ROW, COLUMN = (axis.ravel().astype(float) for axis in np.indices((N, N)))
MESH = Mesh(
    QUADS[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3),
    np.stack([COLUMN, 1.3 * ROW, 0.4 * np.sin(1.3 * ROW + 0.7 * COLUMN)], axis=1),
)
"""The quads, each cut as dynmesh cuts them."""
K = len(MESH.vertices)
FRAME: Any = MESH.vertices
FRAMES: Any = np.stack([FRAME, FRAME + 0.01, FRAME + 0.02, FRAME + 0.03])
KNOWN: Any = np.arange(K) % 3 != 0
MASKS: Any = np.stack([np.ones(K, np.bool_), *[KNOWN] * 3])
UP: Any = np.tile([0.0, 0, 1], (K, 1))
SENSOR: Any = np.array([[2.0, 2, 20]])
HEADER: Any = {"faces": MESH.faces, "n_frames": 1, "n_vertices": K, "dtype": np.float64}
SCAN = next(losses.depth_images(FRAMES, MESH.faces, 1, width=80, height=60))
IMAGE: Any = {"depth": SCAN.depth[0], "intrinsics": SCAN.intrinsics[0], "pose": SCAN.poses[0]}
POSED: Any = {"faces": MESH.faces, "template": FRAME, "training": FRAMES, "align": False}
MARKS: Any = (np.array([0, 4, 20]), FRAME[[0, 4, 20]])
OF_FRAMES: Any = {"frames": FRAMES, "faces": MESH.faces}
SEEN: Any = {"points": FRAME, "known": KNOWN}
BY_DISTANCE: Any = {"weights": "inverse_distance", "reference": FRAME}


def completer() -> dynmesh.Completer:
    return dynmesh.Completer(MESH.faces, FRAME)


def tracker() -> dynmesh.Tracker:
    return dynmesh.Tracker(MESH.faces, FRAME)


def _append(folder: Path, **given: Any) -> Any:
    header = dynmesh.Header(**HEADER, attributes=["known", "generation", "age"])
    dynmesh.write(folder / "a.npz", to_file.frames_of(header, [dynmesh.Frame(**given)]))
    return dynmesh.read(folder / "a.npz")


def _write_scan(folder: Path, **given: Any) -> Any:
    scans.write_ply(folder / "a.ply", scans.PointScan(**given))
    return scans.read_points(folder / "a.ply").scan


def _write_images(folder: Path, **given: Any) -> Any:
    pytest.importorskip("PIL")
    camera = scans.ScanCamera("a", IMAGE["pose"], IMAGE["intrinsics"], 1e-3, (80, 60))
    with scans.scan_folder(folder / "scans", scans.Rig((camera,), None)) as append:
        append(scans.DepthScan([given["depth"]], SCAN.intrinsics, SCAN.poses))
    return [*scans.open_scans(folder / "scans")]


def _read(folder: Path, **given: Any) -> Any:
    np.save(folder / "a.npy", FRAMES)
    return dynmesh.read(folder / "a.npy", **given)


def _all(function: Callable[..., Iterator[Any]]) -> Callable[..., Any]:
    return lambda _, **given: list(function(**given))


def _once(function: Callable[..., Any]) -> Callable[..., Any]:
    return lambda _, **given: function(**given)


def _of(make: Callable[[], Any], method: str) -> Callable[..., Any]:
    return lambda _, **given: getattr(make(), method)(**given)


ENTRIES: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {
    "Completer": (
        _once(dynmesh.Completer),
        {"faces": MESH.faces, "first_frame": FRAME, "training": FRAMES},
    ),
    "Completer.push": (_of(completer, "push"), SEEN | {"out": FRAME.copy()}),
    "Completer.push_sparse": (
        _of(completer, "push_sparse"),
        {"indices": np.arange(3), "points": FRAME[:3], "out": FRAME.copy()},
    ),
    "Completer.reset": (_of(completer, "reset"), {"frame": FRAME}),
    "Completer.skip": (_of(completer, "skip"), {"out": FRAME.copy()}),
    "Tracker": (
        _once(dynmesh.Tracker),
        {"faces": MESH.faces, "first_frame": FRAME, "training": FRAMES},
    ),
    "Tracker.push": (
        _of(tracker, "push"),
        {"points": FRAME, "normals": UP, "viewpoints": SENSOR, "out": FRAME.copy()},
    ),
    "Tracker.push_depth": (_of(tracker, "push_depth"), IMAGE | {"out": FRAME.copy()}),
    "Tracker.reset": (_of(tracker, "reset"), {"frame": FRAME}),
    "Tracker.skip": (_of(tracker, "skip"), {"out": FRAME.copy()}),
    "whole_frame": (_once(dynmesh.whole_frames.whole_frame), OF_FRAMES | {"known": MASKS}),
    "find_alignment": (
        _once(dynmesh.alignment.find_alignment),
        {"faces": MESH.faces, "first_frame": FRAME, "scan": FRAME},
    ),
    "register": (
        _once(dynmesh.register),
        POSED | {"points": FRAME, "normals": UP, "landmarks": MARKS, "viewpoints": SENSOR},
    ),
    "Sequence": (
        _once(dynmesh.Sequence),
        {
            "vertices": FRAMES,
            "faces": MESH.faces,
            "known": MASKS,
            "generation": MASKS.astype(int),
            "age": MASKS.astype(int),
            "standard_error": MASKS.astype(float),
            "times": np.arange(4.0),
        },
    ),
    "Header": (
        _once(dynmesh.Header),
        HEADER | {"n_frames": 4, "times": np.arange(4.0)},
    ),
    "write": (
        _append,
        SEEN | {"generation": KNOWN.astype(np.int32), "age": KNOWN.astype(np.int32)},
    ),
    "read": (_read, {"faces": MESH.faces, "known": MASKS}),
    "write_ply": (_write_scan, {"points": FRAME, "normals": UP, "viewpoints": SENSOR}),
    "scan_folder": (_write_images, {"depth": SCAN.depth[0]}),
    "bounding_box_diagonal": (_once(metrics.bounding_box_diagonal), {"frame": FRAME}),
    "nmsve": (
        _once(metrics.nmsve),
        {"faces": MESH.faces, "reference": FRAMES, "completed": FRAMES},
    ),
    "vertex_error": (_once(metrics.vertex_error), {"reference": FRAME, "completed": FRAME}),
    "LeastSquaresMesh": (
        _once(baselines.LeastSquaresMesh),
        {"faces": MESH.faces, "n_vertices": K},
    ),
    "LeastSquaresMesh.complete": (
        _of(lambda: baselines.LeastSquaresMesh(MESH.faces, K), "complete"),
        SEEN | {"previous": FRAME},
    ),
    "LaplacianInterpolation": (
        _once(baselines.LaplacianInterpolation),
        BY_DISTANCE | {"faces": MESH.faces, "n_vertices": K},
    ),
    "LaplacianInterpolation.complete": (
        _of(lambda: baselines.LaplacianInterpolation(MESH.faces, K), "complete"),
        SEEN | {"previous": FRAME},
    ),
    "orbit": (_once(losses.orbit), {"first_frame": FRAME}),
    "add_noise": (_all(losses.add_noise), OF_FRAMES | {"sigma": 0.1}),
    "add_outliers": (_all(losses.add_outliers), OF_FRAMES | {"share": 0.1}),
    "camera_known": (
        _all(losses.camera_known),
        OF_FRAMES | {"cameras": losses.orbit(FRAME, 1)},
    ),
    "patch_known": (
        _all(losses.patch_known),
        {"faces": MESH.faces, "n_frames": 2, "n_vertices": K, "share": 0.2},
    ),
    "scan_points": (_all(losses.scan_points), OF_FRAMES | {"points": 10}),
    "depth_images": (_all(losses.depth_images), OF_FRAMES | {"width": 8, "height": 6}),
    "cells": (_once(dynmesh.topology.cells), {"faces": MESH.faces, "n_vertices": K}),
}
"""All that takes arrays of positions, masks or faces, with arrays that it accepts."""
