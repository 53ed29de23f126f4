"""Scans as depth cameras make them: loose points, or depth images, of a sequence that is known.

Nothing of a scan says which vertex it belongs to. Unlike known masks, scans have no complete
frame 0: every frame is scanned alike. Surfaces that are nearly edge-on to a camera return nothing.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .._checks import check_finite, check_integer
from .._errors import InputError
from ..files.scans.scan import DepthScan, PointScan
from ..sequence import Mask, Positions
from .depth_buffer import DepthBuffer, depth_buffer, intrinsics_of, pose_of
from .losses import patch_known
from .shared import Purpose, check_cameras, check_triangles, mean_edge_of, numbered, rng_of
from .silhouettes import Silhouettes
from .visibility import Camera, orbit, visible

_Integers = NDArray[np.integer[Any]]
_Floats = NDArray[np.float64]

Cameras: TypeAlias = int | Sequence[Camera] | Callable[[int], Sequence[Camera]]
"""A number of cameras that stand around frame 0; cameras; or those of each frame."""

_EDGE_ON = 0.1
"""The cosine of the angle between normal and ray below which a sensor measures nothing, which is
about 84 degrees."""

_FLIGHT = 10.0
"""A flying pixel lies up to this many mean edges behind the silhouette that it is mixed from."""

_OUTLIER_DISTANCE = 10.0
"""How far outliers are from the surface, in mean edges, as in :func:`add_outliers`."""

_HOLES = 6
"""Holes at a time; each stays for 15 frames."""

_JUMP = 3.0
"""Pixels whose depths differ by more than this many mean edges are on different surfaces."""

_CANDIDATES = 100_000
_ROUNDS = 20
"""At most so many points are tried at a time, and so many times, until enough of them are seen."""


def scan_points(
    frames: Iterable[Positions],
    faces: _Integers,
    cameras: Cameras = 4,
    *,
    points: int = 20_000,
    noise: float = 0.02,
    missing: float = 0.0,
    holes: float = 0.0,
    flying: float = 0.0,
    outliers: float = 0.0,
    up: tuple[float, float, float] = (0, 0, 1),
    seed: int = 0,
) -> Iterator[PointScan]:
    """Scans the surface that cameras see, as a set of points with normals.

    The points are spread evenly over the area that at least one camera sees. Occlusion is exact: no
    triangle lies between a point, before noise is added, and the camera that sees it.

    Args:
        frames: (k, 3) positions each; only one frame is held at a time; the first must be finite.
        faces: (m, 3) integers. Both sides of a triangle are seen, and hide what is behind them.
        cameras: a number of cameras that stand around frame 0, as :func:`orbit` places them; the
            same cameras for all frames; or a function that returns those of a frame.
        points: number of points of a frame before some are lost; fewer where nothing is seen.
        noise: standard deviation of every coordinate, in mean edges of frame 0.
        missing: share of the points that is lost at random, at least 0 and below 1.
        holes: about this share of the surface returns nothing, in patches that stay for 15 frames;
            see :func:`patch_known`. Frame 0 has none.
        flying: share of the points that are flying pixels: mixtures of a silhouette and what is
            behind it, anywhere up to 10 mean edges behind the silhouette, with useless normals.
        outliers: share of the points that is moved 10 mean edges in a random direction.
        up: the axis around which a number of cameras stand.
        seed: equal seeds give equal scans. Frame i does not depend on the number of frames.

    Returns:
        An iterator over :class:`PointScan`, one for each frame.

    Raises:
        TypeError: an argument or a frame has the wrong kind.
        ValueError: an argument is out of range, frame 0 is not finite or has no edge longer than 0,
            or a frame has another shape than frame 0.
    """
    check_integer("points", points, 1)
    _check(faces, cameras, noise, missing, holes, flying, outliers, seed)

    def scans() -> Iterator[PointScan]:
        silhouettes = Silhouettes(faces)
        for scene in _scenes(frames, faces, cameras, holes, up, seed):
            rng = rng_of(Purpose.SCAN, seed, scene.number)
            n_flying = round(flying * points)
            positions, normals = _sampled(scene, faces, points - n_flying, rng)
            mixed = silhouettes.flying(scene.points, scene.cameras, n_flying, rng)
            behind = _FLIGHT * scene.mean_edge * rng.random(len(mixed.points))[:, None]
            positions = np.concatenate([positions, mixed.points + behind * mixed.rays])
            normals = np.concatenate([normals, _unit(mixed.normals - mixed.rays)])
            positions += noise * scene.mean_edge * rng.standard_normal(positions.shape)
            moved = rng.random(len(positions)) < outliers
            away = _unit(rng.standard_normal((int(moved.sum()), 3)))
            positions[moved] += _OUTLIER_DISTANCE * scene.mean_edge * away
            kept = rng.random(len(positions)) >= missing
            viewpoints = np.array([camera.position for camera in scene.cameras])
            dtype = scene.points.dtype
            yield PointScan(
                positions[kept].astype(dtype),
                normals[kept].astype(dtype),
                viewpoints.astype(dtype),
            )

    return scans()


def depth_images(
    frames: Iterable[Positions],
    faces: _Integers,
    cameras: Cameras = 4,
    *,
    width: int = 640,
    height: int = 480,
    noise: float = 0.02,
    missing: float = 0.0,
    holes: float = 0.0,
    flying: float = 0.0,
    outliers: float = 0.0,
    up: tuple[float, float, float] = (0, 0, 1),
    seed: int = 0,
) -> Iterator[DepthScan]:
    """Scans what cameras see as depth images, which are exact at the centres of the pixels.

    The arguments that :func:`scan_points` has, too, mean the same, with these differences:

    Args:
        frames: see :func:`scan_points`.
        faces: see :func:`scan_points`.
        cameras: see :func:`scan_points`; their fields of view are those from the lower to the upper
            edge of the image.
        width: of the images, in pixels.
        height: of the images, in pixels.
        noise: standard deviation of the depths, in mean edges of frame 0.
        missing: share of the pixels that is lost at random.
        holes: see :func:`scan_points`.
        flying: share of the pixels that are flying pixels; they are chosen from those at
            silhouettes, and are at most all of them.
        outliers: share of the pixels whose depth is changed by up to 10 mean edges.
        up: see :func:`scan_points`.
        seed: see :func:`scan_points`.

    Returns:
        An iterator over :class:`DepthScan`, one for each frame.

    Raises:
        TypeError, ValueError: see :func:`scan_points`.
    """
    check_integer("width", width, 1)
    check_integer("height", height, 1)
    _check(faces, cameras, noise, missing, holes, flying, outliers, seed)

    def scans() -> Iterator[DepthScan]:
        for scene in _scenes(frames, faces, cameras, holes, up, seed):
            images = []
            for number, camera in enumerate(scene.cameras):
                rng = rng_of(Purpose.DEPTH, seed, scene.number, number)
                buffer = depth_buffer(scene.points, faces, camera, width, height)
                edge = scene.mean_edge
                depth = _measured(buffer, scene, camera, faces)
                depth = _with_flying(depth, flying, edge, rng)
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


class _Scene(NamedTuple):
    """A frame, and who looks at it."""

    number: int
    points: Positions
    cameras: Sequence[Camera]
    present: Mask
    """(k,) False in holes."""
    mean_edge: float
    """Of frame 0."""


def _check(
    faces: _Integers,
    cameras: Cameras,
    noise: float,
    missing: float,
    holes: float,
    flying: float,
    outliers: float,
    seed: int,
) -> None:
    check_triangles(faces)
    check_integer("seed", seed, 0)
    if isinstance(cameras, int):
        check_integer("cameras", cameras, 1)
    elif not callable(cameras):
        check_cameras(cameras, "there are none")
    check_finite("noise", noise)
    if noise < 0:
        raise InputError(f"must be at least 0, not {noise}", argument="noise")
    shares = {"missing": missing, "holes": holes, "flying": flying, "outliers": outliers}
    for name, share in shares.items():
        check_finite(name, share)
        if not 0 <= share < 1:
            raise InputError(f"must be at least 0 and below 1, not {share}", argument=name)


def _scenes(
    frames: Iterable[Positions],
    faces: _Integers,
    cameras: Cameras,
    holes: float,
    up: tuple[float, float, float],
    seed: int,
) -> Iterator[_Scene]:
    rest = numbered(frames)
    first = next(rest, None)
    if first is None:
        return
    mean_edge = mean_edge_of(first[1], faces)
    k = len(first[1])
    if isinstance(cameras, int):
        cameras = orbit(first[1], cameras, degrees_per_frame=0.0, up=up)
    everywhere = np.ones(k, np.bool_)
    endless = 1 << 62  # frames; only those that exist are asked for
    patches = (
        patch_known(faces, endless, k, holes, patches=_HOLES, seed=seed) if holes else iter(())
    )
    for number, points in chain([first], rest):
        present = cameras(number) if callable(cameras) else cameras
        check_cameras(present, f"frame {number} has none")
        yield _Scene(number, points, present, next(patches, everywhere), mean_edge)


def _sampled(
    scene: _Scene, faces: _Integers, wanted: int, rng: np.random.Generator
) -> tuple[_Floats, _Floats]:
    """Returns (n, 3) points on the surface that cameras see, and their normals."""
    corners = scene.points.astype(np.float64)[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    areas[~np.isfinite(areas)] = 0
    normals = _unit(np.nan_to_num(normals))
    found, sides = [np.zeros((0, 3))], [np.zeros((0, 3))]
    n_found = n_tried = 0
    for _ in range(_ROUNDS if areas.any() else 0):
        share = max(n_found / n_tried, 0.05) if n_tried else 0.3
        n = int(np.clip(1.1 * (wanted - n_found) / share, 1000, _CANDIDATES))
        face = rng.choice(len(faces), n, p=areas / areas.sum())
        weights = _barycentric(rng.random((n, 2)))
        points = np.einsum("nc,ncx->nx", weights, corners[face])
        nearest = faces[face, weights.argmax(axis=1)]
        side = _seen_from(scene, faces, points, normals[face]) * scene.present[nearest]
        seen = side != 0
        found.append(points[seen])
        sides.append(side[seen, None] * normals[face][seen])
        n_found, n_tried = n_found + int(seen.sum()), n_tried + n
        if n_found >= wanted:
            break
    return np.concatenate(found)[:wanted], np.concatenate(sides)[:wanted]


def _seen_from(
    scene: _Scene, faces: _Integers, points: _Floats, normals: _Floats
) -> NDArray[np.float64]:
    """Returns for each point 1 or -1, the side from which it is seen best, or 0 if it is not."""
    best = np.zeros(len(points))
    # Points that belong to no triangle hide nothing; all else is as for vertices.
    everything = np.concatenate([scene.points.astype(np.float64), points])
    vertices = np.zeros(len(scene.points), np.bool_)
    for camera in scene.cameras:
        cosines = np.einsum("nx,nx->n", normals, _unit(np.array(camera.position) - points))
        better = np.abs(cosines) > np.maximum(np.abs(best), _EDGE_ON)
        seen = visible(everything, faces, camera, np.concatenate([vertices, better]))
        best = np.where(seen[len(vertices) :], cosines, best)
    return np.sign(best)


def _barycentric(uniform: _Floats) -> _Floats:
    """Maps uniform numbers in the unit square to uniform weights of the corners of a triangle."""
    root = np.sqrt(uniform[:, 0])
    return np.stack([1 - root, root * (1 - uniform[:, 1]), root * uniform[:, 1]], axis=1)


def _measured(buffer: DepthBuffer, scene: _Scene, camera: Camera, faces: _Integers) -> _Floats:
    """Returns the depths, infinite where nothing is measured."""
    row, column = np.nonzero(buffer.triangle >= 0)
    corners = faces[buffer.triangle[row, column]]
    a, b, c = scene.points.astype(np.float64)[corners.T]
    height, width = buffer.depth.shape
    pixels = np.stack([column, row, np.ones(len(row))], axis=1)
    to_rays = pose_of(camera)[:3, :3] @ np.linalg.inv(intrinsics_of(camera, width, height))
    normals = np.cross(b - a, c - a)
    cosines = (_unit(normals) * _unit(pixels @ to_rays.T)).sum(axis=1)
    nearest = buffer.weights[row, column].argmax(axis=1)
    present = scene.present[corners[np.arange(len(corners)), nearest]]
    seen = present & (np.abs(cosines) > _EDGE_ON)
    depth = buffer.depth.copy()
    depth[row[~seen], column[~seen]] = np.inf
    return depth


def _with_flying(
    depth: _Floats, share: float, mean_edge: float, rng: np.random.Generator
) -> _Floats:
    """Replaces some of the pixels at silhouettes by mixtures with what is behind them."""
    behind = np.full_like(depth, -np.inf)  # the farthest of the neighbours
    for axis in (0, 1):
        for step in (1, -1):
            beside = np.roll(depth, step, axis=axis)
            edge = [slice(None), slice(None)]
            edge[axis] = slice(0, 1) if step == 1 else slice(-1, None)
            beside[tuple(edge)] = -np.inf
            behind = np.maximum(behind, beside)
    measured = np.isfinite(depth)
    places = np.flatnonzero(measured & (behind > np.where(measured, depth, 0) + _JUMP * mean_edge))
    n = min(len(places), round(share * np.count_nonzero(measured)))
    chosen = rng.choice(places, n, replace=False) if n else places[:0]
    mixed = depth.copy()
    near, far = depth.flat[chosen], behind.flat[chosen]
    mixed.flat[chosen] += rng.random(n) * np.minimum(far - near, _FLIGHT * mean_edge)
    return mixed


def _unit(vectors: NDArray[Any]) -> _Floats:
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.where(lengths > 0, lengths, 1))
