"""Prints how far the error of tracking depends on each of its constants, as a table.

    python -m benchmarks.tracking_constants [FILE ...] [--cameras 4]

FILE is a sequence; the default is the built-in walker. The first 30 frames of each are scanned as
in benchmarks.tracking_table, by four cameras and by one, and tracked with every constant of
cpp/src/tracking/constants.hpp halved and doubled, one at a time; counts are rounded, and cosines
and shares stay below 1. The table shows the mean distance from the true vertex, relative to that
with the unchanged constants. script/bench builds the compiled part.
"""

import argparse
import ctypes
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track

from dynmesh.degrade.shared import mean_edge_of
from dynmesh.files.scans import PointScan
from dynmesh.study.subjects import Subject, built_in, from_file
from dynmesh.study.tables import Line, markdown

from .subjects import require
from .tracking_table import around, scans_of

CONSTANTS = (
    "prediction",
    "rigid_steps",
    "rigid_radius",
    "rigid_scale",
    "iterations",
    "steps",
    "first_weight",
    "last_weight",
    "wide_radius",
    "narrow_radius",
    "scale",
    "side",
    "vertices_per_point",
    "agreement",
    "pull",
    "least_unexplained",
    "drawing_radius",
    "drawing_scale",
    "drawing_weight",
    "largest_limb",
    "examined_points",
    "lost_share",
    "most_searches",
    "pixel",
    "thickness",
    "back_thickness",
)
FACTORS = (0.5, 2.0)
FRAMES = 30
BELOW_1 = {"prediction", "agreement", "pull"}


@lru_cache
def _library() -> ctypes.CDLL:
    library = ctypes.CDLL(str(require("dynmesh-tracking.so")))
    size, pointer = ctypes.c_size_t, ctypes.c_void_p
    library.tracking_constant.argtypes = [ctypes.c_char_p]
    library.tracking_constant.restype = ctypes.c_double
    library.tracking_create.argtypes = [pointer, size, pointer, size, pointer, pointer, size]
    library.tracking_create.restype = pointer
    library.tracking_destroy.argtypes = [pointer]
    library.tracking_push.argtypes = [pointer, pointer, pointer, size, pointer, size, pointer]
    library.tracking_push.restype = ctypes.c_int
    return library


def error(subject: Subject, scans: Sequence[PointScan], changes: dict[str, float]) -> float:
    """Return the mean distance from the true vertices, in mean edges.

    Raises:
        ImportError: the compiled part is not built.
        ValueError: there is no constant of that name, or a scan is refused.
    """
    library = _library()
    faces = np.ascontiguousarray(subject.faces, np.int32)
    tracked = np.array(subject.vertices[0], np.float32)
    names = (ctypes.c_char_p * len(changes))(*(name.encode() for name in changes))
    values = np.array(list(changes.values()), np.float64)
    tracker = library.tracking_create(
        faces.ctypes.data,
        len(faces),
        tracked.ctypes.data,
        len(tracked),
        names,
        values.ctypes.data,
        len(changes),
    )
    if not tracker:
        raise ValueError(f"the library refuses {changes}")
    errors = []
    try:
        for truth, scan in zip(subject.vertices, scans, strict=True):
            assert scan.normals is not None
            assert scan.viewpoints is not None
            points, normals, viewpoints = (_packed(rows) for rows in scan)
            sensors = viewpoints.ctypes.data, len(viewpoints)
            if (
                library.tracking_push(
                    tracker,
                    points.ctypes.data,
                    normals.ctypes.data,
                    len(points),
                    *sensors,
                    tracked.ctypes.data,
                )
                < 0
            ):
                raise ValueError(f"the first scan is refused with {changes}")
            errors.append(np.linalg.norm(tracked - truth, axis=1).mean())
    finally:
        library.tracking_destroy(tracker)
    return float(np.mean(errors) / mean_edge_of(subject.vertices[0], subject.faces))


def _packed(rows: NDArray[np.floating] | None) -> NDArray[np.float32]:
    return np.ascontiguousarray(rows, np.float32)


def changed(name: str, factor: float) -> float:
    """Return a constant times a factor.

    Raises:
        ImportError: the compiled part is not built.
        ValueError: there is no constant of that name.
    """
    value = float(_library().tracking_constant(name.encode()))
    if np.isnan(value):
        raise ValueError(f"there is no constant {name}")
    return min(factor * value, 0.95) if name in BELOW_1 else factor * value


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("files", type=Path, nargs="*")
    parser.add_argument("--constants", nargs="+", default=CONSTANTS, help="only these constants")
    parser.add_argument("--cameras", type=int, nargs="+", default=[4, 1])
    parser.add_argument("--frames", type=int, default=FRAMES)
    arguments = parser.parse_args()
    console = Console(stderr=True)
    files = [from_file(file, arguments.frames) for file in arguments.files]
    rows: dict[str, list[str]] = {name: [] for name in arguments.constants}
    head = ["constant", "value"]
    for name in rows:
        rows[name].append(f"{changed(name, 1):g}")
    for subject in files or built_in(arguments.frames)[:1]:
        for n in arguments.cameras:
            cameras = around(subject, subject.vertices, n)
            scans = [
                scan
                for scan in scans_of(subject, subject.vertices, cameras, depth=False)
                if isinstance(scan, PointScan)
            ]
            unchanged = error(subject, scans, {})
            for name in track(rows, f"{subject.name}, {n}", console=console):
                for factor in FACTORS:
                    value = error(subject, scans, {name: changed(name, factor)})
                    rows[name].append(f"{value / unchanged:.2f}")
            label = f"{subject.name}, {n} camera{'s' if n > 1 else ''}"
            head += [f"{label}: halved", "doubled"]
    lines: list[Line] = [tuple(head), *((f"`{name}`", *cells) for name, cells in rows.items())]
    print(markdown(lines))


if __name__ == "__main__":
    main()
