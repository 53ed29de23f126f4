"""Masks of arrays, frames and sequences are carried or refused, wherever positions are taken."""

import inspect
import types
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import to_file
from meshes import sheet
from sequences import sea

import dynmesh
from dynmesh import baselines, degrade, formats, metrics, scans

MESH = sheet(5)
K = len(MESH.vertices)
FRAME: Any = MESH.vertices
FRAMES: Any = np.stack([FRAME, FRAME + 0.01, FRAME + 0.02, FRAME + 0.03])
KNOWN: Any = np.arange(K) % 3 != 0
MASKS: Any = np.stack([np.ones(K, np.bool_), *[KNOWN] * 3])
UP: Any = np.tile([0.0, 0, 1], (K, 1))
SENSOR: Any = np.array([[2.0, 2, 20]])
HEADER: Any = {"faces": MESH.faces, "n_frames": 1, "n_vertices": K, "dtype": np.float64}
PLACES: Any = np.zeros((MESH.faces.size, 2), np.float32)
SCAN = next(degrade.depth_images(FRAMES, MESH.faces, 1, width=80, height=60))
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


def _append(folder: Path, **given: Any) -> None:
    header = dynmesh.Header(**HEADER, has_known=True, has_provenance=True)
    dynmesh.write(folder / "a.npz", to_file.frames_of(header, [dynmesh.Frame(**given)]))


def _write_scan(folder: Path, **given: Any) -> None:
    scans.write_ply(folder / "a.ply", scans.PointScan(**given))


def _write_images(folder: Path, **given: Any) -> None:
    pytest.importorskip("PIL")
    camera = scans.ScanCamera("a", IMAGE["pose"], IMAGE["intrinsics"], 1e-3, (80, 60))
    with scans.scan_folder(folder / "scans", scans.Rig((camera,), None)) as append:
        append(scans.DepthScan([given["depth"]], SCAN.intrinsics, SCAN.poses))


def _read(folder: Path, **given: Any) -> None:
    np.save(folder / "a.npy", FRAMES)
    dynmesh.read(folder / "a.npy", **given)


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
    "whole_frame": (_once(dynmesh.whole_frame), OF_FRAMES | {"known": MASKS}),
    "find_alignment": (
        _once(dynmesh.find_alignment),
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
        HEADER | {"n_frames": 4, "times": np.arange(4.0), "texture": PLACES},
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
    "summary": (_once(metrics.summary), {"errors": FRAME}),
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
    "orbit": (_once(degrade.orbit), {"first_frame": FRAME}),
    "add_noise": (_all(degrade.add_noise), OF_FRAMES | {"sigma": 0.1}),
    "add_outliers": (_all(degrade.add_outliers), OF_FRAMES | {"share": 0.1}),
    "camera_known": (
        _all(degrade.camera_known),
        OF_FRAMES | {"cameras": degrade.orbit(FRAME, 1)},
    ),
    "patch_known": (
        _all(degrade.patch_known),
        {"faces": MESH.faces, "n_frames": 2, "n_vertices": K, "share": 0.2},
    ),
    "scan_points": (_all(degrade.scan_points), OF_FRAMES | {"points": 10}),
    "depth_images": (_all(degrade.depth_images), OF_FRAMES | {"width": 8, "height": 6}),
    "cells": (_once(dynmesh.cells), {"faces": MESH.faces, "n_vertices": K}),
    "adjacency": (_once(dynmesh.adjacency), {"faces": MESH.faces, "n_vertices": K}),
    "laplacian": (_once(dynmesh.laplacian), {"faces": MESH.faces, "n_vertices": K}),
}
"""All that takes arrays of positions, masks or faces, with arrays that it accepts."""

RESULTS = {"Alignment", "Diagnosis", "Registration", "WholeFrame"}
"""What these hold is made by dynmesh."""

PLAIN = {"Frame", "Description", "PointScan.only", "DepthScan.only", "ScanCamera"}
"""Records, which are checked where they are used, and what takes neither positions nor masks."""


FILES = {("open", "faces"), ("open", "known"), ("complete", "training"), ("track", "training")}
"""Arrays in place of files, which are checked as those of files are."""


def _takers() -> Iterator[tuple[str, str]]:
    """All public functions and their parameters that may be arrays."""
    for module in (dynmesh, formats, metrics, baselines, degrade, scans):
        for name in module.__all__:
            found = getattr(module, name)
            if isinstance(found, types.ModuleType) or not callable(found):
                continue
            functions = {name: found}
            if inspect.isclass(found):
                own = inspect.getmembers(found, inspect.isfunction)
                functions = {f"{name}.{n}": method for n, method in own if not n.startswith("_")}
                functions[name] = found.__init__
            for function, called in functions.items():
                for parameter in inspect.signature(called).parameters.values():
                    is_options = parameter.kind is parameter.VAR_KEYWORD
                    if "ndarray" in str(parameter.annotation) and not is_options:
                        yield function, parameter.name


def test_the_table_names_all_that_takes_arrays() -> None:
    there = {(name, argument) for name, (_, given) in ENTRIES.items() for argument in given}
    takers = {one for one in _takers() if one[0] not in RESULTS | PLAIN}
    assert len(takers) > 60
    assert takers - there - FILES == set()


@pytest.mark.parametrize("name", ENTRIES)
def test_the_arrays_of_the_table_are_accepted(name: str, tmp_path: Path) -> None:
    call, given = ENTRIES[name]
    call(tmp_path, **given)


def _masked(values: Any) -> Any:
    mask = np.zeros(values.shape, np.bool_)
    mask.flat[0] = True
    return np.ma.masked_array(values, mask)


def _carriers(values: Any) -> dict[str, Any]:
    """The same, with masks of their own."""
    if isinstance(values, tuple):
        *others, last = values
        return {given: (*others, one) for given, one in _carriers(last).items()}
    found = {"a masked array": _masked(values), "a list": list(_masked(values))}
    ages: Any = {"generation": MASKS[: len(values)].astype(int)}
    ages["age"] = ages["generation"]
    if values.shape == FRAMES.shape:
        found["a sequence with a mask"] = dynmesh.Sequence(values, MESH.faces, MASKS)
        found["a sequence with generations"] = dynmesh.Sequence(values, MESH.faces, **ages)
        found["a list of frames"] = [dynmesh.Frame(one, KNOWN) for one in values]
    elif values.shape == FRAME.shape:
        found["a frame with a mask"] = dynmesh.Frame(values, KNOWN)
        found["a frame with generations"] = dynmesh.Frame(values, generation=KNOWN.astype(int))
    return found


CASES = [
    pytest.param(name, argument, carrier, id=f"{name}, {argument}: {given}")
    for name, (_, arguments) in ENTRIES.items()
    for argument, values in arguments.items()
    if isinstance(values, np.ndarray | tuple)
    for given, carrier in _carriers(values).items()
    if not (argument == "out" and given != "a masked array")  # what is no array
    if not ((name, argument) == ("whole_frame", "frames") and "sequence" in given)  # carries it
]


@pytest.mark.parametrize(("name", "argument", "carrier"), CASES)
def test_a_mask_that_would_be_ignored_is_refused(
    name: str, argument: str, carrier: Any, tmp_path: Path
) -> None:
    call, given = ENTRIES[name]
    kinds = "(MaskedArray|MaskedConstant|Sequence|Frame)"
    with pytest.raises((TypeError, ValueError), match=f"{argument}: the .* of a {kinds} would be"):
        call(tmp_path, **given | {argument: carrier})


PARTIAL = sea(6, share=0.6)


def _measured(sequence: dynmesh.Sequence) -> Any:
    whole = sea(6)
    completed = dynmesh.read(dynmesh.complete(whole))
    return dynmesh.evaluate(completed, whole, input=sequence, only="missing").to_dict()


CARRYING: dict[str, Callable[[dynmesh.Sequence, Path], Any]] = {
    "complete": lambda s, _: dynmesh.read(dynmesh.complete(s)).vertices,
    "whole_frame": lambda s, _: dynmesh.whole_frame(s.faces, s).positions,
    "convert": lambda s, _: (
        dynmesh.read(dynmesh.complete(dynmesh.read(dynmesh.convert(s, scale=2)))).vertices
    ),
    "a slice": lambda s, _: dynmesh.read(dynmesh.complete(s[1:5])).vertices,
    "info": lambda s, _: dynmesh.info(s).to_dict(),
    "evaluate": lambda s, _: _measured(s),
}
"""What takes a sequence as such, and a result that its positions decide."""


@pytest.mark.parametrize("name", CARRYING)
@pytest.mark.parametrize("sentinel", [0.0, -1e4, np.nan])
def test_what_stands_where_nothing_is_known_does_not_matter(
    name: str, sentinel: float, tmp_path: Path
) -> None:
    known: Any = PARTIAL.known
    spoilt = np.where(known[..., None], PARTIAL.vertices, np.float32(sentinel))
    run = CARRYING[name]
    expected = run(PARTIAL, tmp_path)
    found = run(replace(PARTIAL, vertices=spoilt), tmp_path)
    np.testing.assert_equal(found, expected)
