"""Scans as depth cameras make them: loose points, or depth images, of a sequence that is known.

Nothing of a scan says which vertex it belongs to. Unlike known masks, scans have no complete
frame 0: every frame is scanned alike. Surfaces that are nearly edge-on to a camera return nothing.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain, repeat
from typing import NamedTuple, TypeAlias, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from .._arrays import Floats, Integers, Mask, Positions
from .._checks import check_finite, check_integer, check_not_negative
from .._errors import InputError
from ..polygons import Faces
from ..scan import DepthScan, PointScan
from ..topology import mean_edge_of, unit
from .losses import (
    Purpose,
    check_cameras,
    numbered,
    patch_known,
    rng_of,
    triangles_of,
)
from .visibility import Camera, DepthBuffer, depth_buffer, intrinsics_of, orbit, pose_of, visible

Cameras: TypeAlias = int | Sequence[Camera] | Callable[[int], Sequence[Camera]]
"""A number of cameras that stand around frame 0; cameras; or those of each frame."""

_EDGE_ON = 0.1
"""The cosine of the angle between normal and ray below which a sensor measures nothing, which is
about 84 degrees."""

_HOLES = 6
"""Holes at a time; each stays for 15 frames."""

_OUTLIER_DISTANCE = 10.0
"""How far outliers are from the surface, in mean edges, as in :func:`add_outliers`."""

_CANDIDATES = 100_000
_ROUNDS = 20
"""At most so many points are tried at a time, and so many times, until enough of them are seen."""


class Sensor(TypedDict, total=False):
    """What all scans have: keywords of :func:`scan_points` and :func:`depth_images`.

    Attributes:
        noise: standard deviation of every coordinate, or of the depths, in mean edges of frame 0;
            0.02 by default.
        missing: share of the points, or pixels, that is lost at random, at least 0 and below 1; 0.
        holes: about this share of the surface returns nothing, in patches that stay for 15 frames;
            see :func:`patch_known`. Frame 0 has none. 0 by default.
        outliers: share of the points that is moved 10 mean edges in a random direction, or of the
            pixels whose depth is changed by up to as much; 0.
        up: the axis around which a number of cameras stand; (0, 0, 1) by default.
        seed: equal seeds give equal scans; 0. Frame i does not depend on the number of frames.
    """

    noise: float
    missing: float
    holes: float
    outliers: float
    up: tuple[float, float, float]
    seed: int


class _Scene(NamedTuple):
    """A frame, and who looks at it."""

    number: int
    points: Positions
    faces: Integers
    cameras: Sequence[Camera]
    present: Mask
    """(k,) False in holes."""
    mean_edge: float
    """Of frame 0."""


def scan_points(
    frames: Iterable[Positions],
    faces: Faces,
    cameras: Cameras = 4,
    *,
    points: int = 20_000,
    colours: Positions | None = None,
    **sensor: Unpack[Sensor],
) -> Iterator[PointScan]:
    """Scans the surface that cameras see, as a set of points with normals.

    The points are spread evenly over the area that at least one camera sees. Occlusion is exact: no
    triangle lies between a point, before noise is added, and the camera that sees it.

    Args:
        frames: (k, 3) positions each; the first must be finite.
        faces: (m, 3) integers, or other polygons. Both sides of a triangle are seen, and hide what
            is behind them.
        cameras: a number of cameras that stand around frame 0, as :func:`orbit` places them; the
            same cameras for all frames; or a function that returns those of a frame.
        points: number of points of a frame before some are lost; fewer where nothing is seen.
        colours: (k, 3) those of the vertices, which are interpolated between them; None for none.
        **sensor: see :class:`Sensor`.

    Returns:
        An iterator over :class:`PointScan`, one for each frame.
    """
    check_integer("points", points, 1)
    noise, missing, holes, outliers, up, seed = _checked(faces, cameras, **sensor)

    def scans() -> Iterator[PointScan]:
        for scene in _scenes_of(frames, faces, cameras, holes, up, seed):
            rng = rng_of(Purpose.SCAN, seed, scene.number)
            positions, normals, of_points = _sampled(scene, points, rng, colours)
            positions += noise * scene.mean_edge * rng.standard_normal(positions.shape)
            moved = rng.random(len(positions)) < outliers
            away = unit(rng.standard_normal((int(moved.sum()), 3)))
            positions[moved] += _OUTLIER_DISTANCE * scene.mean_edge * away
            kept = rng.random(len(positions)) >= missing
            viewpoints = np.array([camera.position for camera in scene.cameras])
            dtype = scene.points.dtype
            yield PointScan(
                positions[kept].astype(dtype),
                normals[kept].astype(dtype),
                viewpoints.astype(dtype),
                None if colours is None else of_points[kept].astype(dtype),
            )

    return scans()


def depth_images(
    frames: Iterable[Positions],
    faces: Faces,
    cameras: Cameras = 4,
    *,
    width: int = 640,
    height: int = 480,
    **sensor: Unpack[Sensor],
) -> Iterator[DepthScan]:
    """Scans what cameras see as depth images, which are exact at the centres of the pixels.

    The arguments that :func:`scan_points` has, too, mean the same, but the fields of view of
    cameras are those from the lower to the upper edge of the image, of `width` x `height` pixels.

    Returns:
        An iterator over :class:`DepthScan`, one for each frame.
    """
    check_integer("width", width, 1)
    check_integer("height", height, 1)
    noise, missing, holes, outliers, up, seed = _checked(faces, cameras, **sensor)

    def scans() -> Iterator[DepthScan]:
        for scene in _scenes_of(frames, faces, cameras, holes, up, seed):
            images = []
            for number, camera in enumerate(scene.cameras):
                rng = rng_of(Purpose.DEPTH, seed, scene.number, number)
                buffer = depth_buffer(scene.points, scene.faces, camera, width, height)
                edge = scene.mean_edge
                depth = _measured(buffer, scene, camera)
                depth += noise * edge * rng.standard_normal(depth.shape)
                moved = rng.random(depth.shape) < outliers
                depth += moved * _OUTLIER_DISTANCE * edge * rng.uniform(-1, 1, depth.shape)
                lost = (rng.random(depth.shape) < missing) | ~(np.isfinite(depth) & (depth > 0))
                images.append(np.where(lost, 0, depth).astype(np.float32))
            yield DepthScan(
                images,
                [intrinsics_of(camera, width, height) for camera in scene.cameras],
                [pose_of(camera) for camera in scene.cameras],
            )

    return scans()


def _scenes_of(
    frames: Iterable[Positions],
    faces: Faces,
    cameras: Cameras,
    holes: float,
    up: tuple[float, float, float],
    seed: int,
) -> Iterator[_Scene]:
    """Yields the frames with those who look at them."""
    rest = numbered(frames)
    first = next(rest, None)
    if first is None:
        return
    mean_edge = mean_edge_of(first[1], faces)  # refuses polygons with corners that are no vertex
    triangles = triangles_of(faces)
    k = len(first[1])
    if isinstance(cameras, int):
        cameras = orbit(first[1], cameras, degrees_per_frame=0.0, up=up)
    present: Iterator[Mask] = repeat(np.ones(k, np.bool_))
    if holes:
        endless = 1 << 62  # frames; only those that exist are asked for
        present = patch_known(triangles, endless, k, holes, patches=_HOLES, seed=seed)
    for (number, points), mask in zip(chain([first], rest), present, strict=False):
        own = cameras(number) if callable(cameras) else cameras
        check_cameras(own, f"frame {number} has none")
        yield _Scene(number, points, triangles, own, mask, mean_edge)


def _sampled(
    scene: _Scene, wanted: int, rng: "np.random.Generator", colours: Positions | None
) -> tuple[Floats, Floats, Floats]:
    """Returns (n, 3) points on the surface that cameras see, their normals and colours, or 0."""
    of_vertices = np.zeros_like(scene.points) if colours is None else np.asarray(colours)
    if of_vertices.shape != scene.points.shape:
        message = f"must have shape {scene.points.shape}, not {of_vertices.shape}"
        raise InputError(message, argument="colours")
    faces = scene.faces
    corners = scene.points.astype(np.float64)[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    areas[~np.isfinite(areas)] = 0
    normals = unit(np.nan_to_num(normals))
    result, sides, shades = ([np.zeros((0, 3))] for _ in range(3))
    n_found = n_tried = 0
    for _ in range(_ROUNDS if areas.any() else 0):
        share = max(n_found / n_tried, 0.05) if n_tried else 0.3
        n = int(np.clip(1.1 * (wanted - n_found) / share, 1000, _CANDIDATES))
        face = rng.choice(len(faces), n, p=areas / areas.sum())
        # Uniform numbers in the unit square become uniform weights of the corners of a triangle.
        uniform, along = rng.random((n, 2)).T
        root = np.sqrt(uniform)
        weights = np.stack([1 - root, root * (1 - along), root * along], axis=1)
        points = np.einsum("nc,ncx->nx", weights, corners[face])
        nearest = faces[face, weights.argmax(axis=1)]
        side = _seen_from(scene, points, normals[face]) * scene.present[nearest]
        seen = side != 0
        result.append(points[seen])
        sides.append(side[seen, None] * normals[face][seen])
        shades.append(np.einsum("nc,ncx->nx", weights[seen], of_vertices[faces[face[seen]]]))
        n_found, n_tried = n_found + int(seen.sum()), n_tried + n
        if n_found >= wanted:
            break
    points, normals, colours = (np.concatenate(each)[:wanted] for each in (result, sides, shades))
    return points, normals, colours


def _seen_from(scene: _Scene, points: Floats, normals: Floats) -> NDArray[np.float64]:
    """Returns for each point 1 or -1, the side from which it is seen best, or 0 if it is not."""
    best = np.zeros(len(points))
    # Points that belong to no triangle hide nothing; all else is as for vertices.
    everything = np.concatenate([scene.points.astype(np.float64), points])
    vertices = np.zeros(len(scene.points), np.bool_)
    for camera in scene.cameras:
        cosines = np.einsum("nx,nx->n", normals, unit(np.array(camera.position) - points))
        better = np.abs(cosines) > np.maximum(np.abs(best), _EDGE_ON)
        seen = visible(everything, scene.faces, camera, np.concatenate([vertices, better]))
        best = np.where(seen[len(vertices) :], cosines, best)
    return np.sign(best)


def _measured(buffer: DepthBuffer, scene: _Scene, camera: Camera) -> NDArray[np.float64]:
    """Returns the depths, infinite where nothing is measured."""
    row, column = np.nonzero(buffer.triangle >= 0)
    corners = scene.faces[buffer.triangle[row, column]]
    a, b, c = scene.points.astype(np.float64)[corners.T]
    height, width = buffer.depth.shape
    pixels = np.stack([column, row, np.ones(len(row))], axis=1)
    to_rays = pose_of(camera)[:3, :3] @ np.linalg.inv(intrinsics_of(camera, width, height))
    normals = np.cross(b - a, c - a)
    cosines = (unit(normals) * unit(pixels @ to_rays.T)).sum(axis=1)
    nearest = buffer.weights[row, column].argmax(axis=1)
    present = scene.present[corners[np.arange(len(corners)), nearest]]
    seen = present & (np.abs(cosines) > _EDGE_ON)
    depth = buffer.depth.copy()
    depth[row[~seen], column[~seen]] = np.inf
    return depth


def _checked(
    faces: Faces,
    cameras: Cameras,
    noise: float = 0.02,
    missing: float = 0.0,
    holes: float = 0.0,
    outliers: float = 0.0,
    up: tuple[float, float, float] = (0, 0, 1),
    seed: int = 0,
) -> tuple[float, float, float, float, tuple[float, float, float], int]:
    """Returns what is given of a sensor, and what is usual of the rest."""
    triangles_of(faces)
    check_integer("seed", seed, 0)
    if isinstance(cameras, int):
        check_integer("cameras", cameras, 1)
    elif not callable(cameras):
        check_cameras(cameras, "there are none")
    check_not_negative("noise", noise)
    for name, share in {"missing": missing, "holes": holes, "outliers": outliers}.items():
        check_finite(name, share)
        if not 0 <= share < 1:
            raise InputError(f"must be at least 0 and below 1, not {share}", argument=name)
    return noise, missing, holes, outliers, up, seed
