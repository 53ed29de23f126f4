"""Arrays of any byte order and layout give the same as packed ones of this processor."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from to_file import frames_of

import dynmesh
from dynmesh.scans import PointScan, read_points, write_ply

Array = NDArray[Any]
SEA = dynmesh.synth.ocean(3, grid=9)
POINTS, FACES = SEA.vertices, SEA.faces.astype(np.int32)
QUADS = np.array([[i, i + 1, i + 10, i + 9] for i in range(71) if i % 9 < 8])
KNOWN = np.random.default_rng(0).random(POINTS.shape[:2]) < 0.5
KNOWN[0] = True
ESTIMATED = (~KNOWN).astype(np.int32)
ERRORS = np.random.default_rng(1).random(KNOWN.shape).astype(np.float32)
NORMALS = np.zeros_like(POINTS[0]) + np.array([0, 0, 1], np.float32)
DEPTH, LENS = np.full((8, 8), 5, np.float32), np.array([[8.0, 0, 4], [0, 8, 4], [0, 0, 1]])
POSE = np.diag([1.0, -1, -1, 1]) + np.eye(4, k=1) * [0, 0, 0, 5]


def swapped(array: Array) -> Array:
    return array.astype(array.dtype.newbyteorder())


def unaligned(array: Array) -> Array:
    result: Array = np.ndarray(array.shape, array.dtype, bytearray(array.nbytes + 1), 1)
    result[...] = array
    return result


def mapped(array: Array, tmp_path: Path) -> Array:
    np.save(tmp_path / "mapped.npy", swapped(array))
    result: Array = np.load(tmp_path / "mapped.npy", mmap_mode="r")
    return result


def layouts(array: Array, tmp_path: Path) -> dict[str, Array]:
    protected = array.copy()
    protected.flags.writeable = False
    return {
        "of the other byte order": swapped(array),
        "mapped": mapped(array, tmp_path),
        "unaligned": unaligned(array),
        "strided": np.repeat(array, 2, axis=-1)[..., ::2],
        "backwards": array[::-1].copy()[::-1],
        "by columns": np.asfortranarray(array),
        "read-only": protected,
    }


def completed(
    points: Array = POINTS, faces: Any = FACES, known: Array = KNOWN, **more: Any
) -> Array:
    sequence = dynmesh.Sequence(points, faces, known, **more)
    made: Array = sequence.complete().vertices
    return made


def pushed(
    faces: Array = FACES, first: Array = POINTS[0], points: Array = POINTS[1], **more: Any
) -> Array:
    return dynmesh.Completer(faces, first, **more).push(points, KNOWN[1])


def tracked(
    faces: Array = FACES, first: Array = POINTS[0], points: Array = POINTS[1], **more: Any
) -> Array:
    return dynmesh.Tracker(faces, first).push(points, **more)


def seen(depth: Array = DEPTH, lens: Array = LENS, pose: Array = POSE) -> Array:
    return dynmesh.Tracker(FACES, POINTS[0]).push_depth([depth], [lens], [pose])


def computed(points: Array) -> Array:
    header = dynmesh.Header(FACES, len(points), points.shape[1], points.dtype)
    made: Array = dynmesh.complete(frames_of(header, points)).read().vertices
    return made


def cloud(tmp_path: Path, points: Array, normals: Array) -> Array:
    write_ply(tmp_path / "cloud.ply", PointScan(points, normals, None))
    scan = read_points(tmp_path / "cloud.ply").scan
    return np.hstack([scan.points, np.asarray(scan.normals)])


def stored(tmp_path: Path, name: str, **arrays: Array) -> Array:
    given: dict[str, Any] = {"vertices": POINTS, "faces": FACES} | arrays
    dynmesh.write(tmp_path / name, dynmesh.Sequence(**given))
    back = dynmesh.read(tmp_path / name)
    return np.concatenate([getattr(back, of).ravel().astype(float) for of in given])


def attributes(tmp_path: Path, **arrays: Array) -> Array:
    given = {"generation": ESTIMATED, "age": ESTIMATED, "standard_error": ERRORS} | arrays
    return stored(tmp_path, "attributes.npz", **given)


CASES: dict[str, tuple[Array, Callable[[Array, Path], Array]]] = {
    "points of a sequence": (POINTS, lambda a, _: completed(a)),
    "double points of a sequence": (POINTS.astype(float), lambda a, _: completed(a)),
    "faces of a sequence": (FACES, lambda a, _: completed(faces=a)),
    "short faces": (FACES.astype(np.uint16), lambda a, _: completed(faces=a)),
    "quads": (QUADS, lambda a, _: completed(faces=a)),
    "corners": (
        QUADS.reshape(-1),
        lambda a, _: completed(faces=dynmesh.polygons.Polygons(np.full(len(QUADS), 4), a)),
    ),
    "a mask of numbers": (KNOWN.astype(np.int32), lambda a, _: completed(known=a)),
    "times": (np.array([1.0, 2, 4]), lambda a, path: stored(path, "a.npz", times=a)),
    "generations": (ESTIMATED, lambda a, path: attributes(path, generation=a, age=a)),
    "standard errors": (ERRORS, lambda a, path: attributes(path, standard_error=a)),
    "computed frames": (POINTS, lambda a, _: computed(a)),
    "a first frame": (POINTS[0], lambda a, _: pushed(first=a)),
    "faces of a completer": (FACES, lambda a, _: pushed(a)),
    "a frame": (POINTS[1], lambda a, _: pushed(points=a)),
    "training frames": (POINTS, lambda a, _: pushed(training=a)),
    "a template": (POINTS[0], lambda a, _: tracked(first=a)),
    "faces of a tracker": (FACES, lambda a, _: tracked(a)),
    "a scan": (POINTS[1], lambda a, _: tracked(points=a)),
    "normals of a scan": (NORMALS, lambda a, _: tracked(normals=a)),
    "viewpoints": (5 * NORMALS, lambda a, _: tracked(viewpoints=a)),
    "depth": (DEPTH, lambda a, _: seen(a)),
    "intrinsics": (LENS, lambda a, _: seen(lens=a)),
    "poses": (POSE, lambda a, _: seen(pose=a)),
    "points of a file": (
        POINTS[0].astype(float) + 1e-9,
        lambda a, path: cloud(path, a, NORMALS.astype(float)),
    ),
    "normals of a file": (NORMALS, lambda a, path: cloud(path, POINTS[0], a)),
    "metrics": (POINTS[2], lambda a, _: dynmesh.metrics.vertex_error(a, POINTS[1])),
    "a registered scan": (POINTS[1], lambda a, _: dynmesh.register(FACES, POINTS[0], a).vertices),
    "whole frames": (
        POINTS,
        lambda a, _: dynmesh.whole_frames.whole_frame(FACES, a, KNOWN).positions,
    ),
    **{
        f"{name} of {file}": (
            array,
            lambda a, path, name=name, file=file: stored(path, file, **{name: a}),  # type: ignore[misc]
        )
        for file in ("a.npz", "a.npy", "a.h5", "f_%d.ply", "f_%d.obj", "a.usdc", "a.abc", "a.pc2")
        for name, array in (("vertices", POINTS), ("faces", FACES))
    },
}


@pytest.mark.parametrize("case", CASES)
def test_the_layout_of_an_array_does_not_matter(case: str, tmp_path: Path) -> None:
    array, result_of = CASES[case]
    if case.endswith((".h5", ".usdc")):
        pytest.importorskip("h5py" if case.endswith(".h5") else "pxr")
    expected = result_of(array, tmp_path)
    for layout, given in layouts(array, tmp_path).items():
        np.testing.assert_array_equal(given, array)
        np.testing.assert_array_equal(result_of(given, tmp_path), expected, err_msg=layout)


@pytest.mark.parametrize("dtype", [np.float16, np.longdouble, np.complex64])
def test_what_is_no_precision_of_positions_is_refused_at_once(dtype: Any, tmp_path: Path) -> None:
    given = POINTS.astype(dtype)
    for call in (
        lambda: dynmesh.Sequence(given, FACES),
        lambda: dynmesh.Completer(FACES, given[0]),
        lambda: pushed(points=given[1]),
        lambda: tracked(points=given[1]),
        lambda: cloud(tmp_path, given[0], NORMALS),
    ):
        with pytest.raises(TypeError, match="must be float32 or float64, not "):
            call()


def test_an_output_of_the_other_byte_order_is_refused() -> None:
    completer = dynmesh.Completer(FACES, POINTS[0])
    with pytest.raises(TypeError, match="out: must be float32, the dtype of first_frame"):
        completer.push(POINTS[1], KNOWN[1], out=swapped(POINTS[1]))
