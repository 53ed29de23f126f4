"""Known masks, noise and outliers like those of real sensors, made from complete sequences."""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from enum import IntEnum
from functools import lru_cache

import numpy as np

from .. import _arrays
from .._arrays import Floats, Integers, Mask, Positions
from .._checks import check_array, check_between, check_integer, check_not_negative, check_positive
from .._errors import InputError, KindError, locating
from ..header import check_faces
from ..polygons import Faces, split_faces
from ..topology import cells, mean_edge_of
from .visibility import Camera, visible


class Purpose(IntEnum):
    """What random numbers are for; different purposes get independent ones from the same seed."""

    # Starts at 1, since NumPy treats a trailing 0 in a seed as absent: :func:`random_known` has
    # none.
    PATCH = 1
    DROPOUT = 2
    NOISE = 3
    OUTLIERS = 4
    SCAN = 5
    DEPTH = 6


def rng_of(purpose: Purpose, seed: int, *numbers: int) -> "np.random.Generator":
    """Returns the random numbers for one purpose and, for example, one frame."""
    return np.random.default_rng([seed, *numbers, purpose])


def numbered(frames: Iterable[Positions]) -> Iterator[tuple[int, Positions]]:
    """Yields frames with their numbers; raises an error for those that do not match frame 0."""
    expected: tuple[int, ...] = ()
    for frame, points in enumerate(_arrays.frames("frames", frames)):
        with locating(frame=frame):
            points = _arrays.first_frame("points", points)
        expected = expected or points.shape
        if points.shape != expected:
            raise InputError(
                f"must have shape {expected} as frame 0, not {points.shape}", frame=frame
            )
        yield frame, points


def round_up(value: float) -> float:
    """Returns the next of 1, 2 or 5 times a power of ten, for positive values."""
    power = math.floor(math.log10(value))
    steps = (float(f"{digit}e{power}") for digit in (1, 2, 5, 10))
    return next(step for step in steps if step >= value * (1 - 1e-9))


def triangles_of(faces: Faces) -> Integers:
    """Returns the triangles, or raises an error; that all corners are vertices is not checked."""
    triangles, _ = split_faces(faces)
    check_array("faces", triangles)
    check_faces(triangles.dtype, triangles.shape)
    return triangles


def check_cameras(cameras: Sequence[Camera], none: str) -> None:
    """Raises an error unless these are cameras; `none` describes an empty sequence."""
    if not isinstance(cameras, Sequence):
        raise KindError(f"must be a sequence of cameras, not {cameras!r}", argument="cameras")
    if len(cameras) == 0:
        raise InputError(f"must be at least one, but {none}", argument="cameras")
    for number, camera in enumerate(cameras):
        if not isinstance(camera, Camera):
            raise KindError(f"item {number} must be a Camera, not {camera!r}", argument="cameras")


def random_known(n_frames: int, n_vertices: int, share: float, *, seed: int = 0) -> Iterator[Mask]:
    """Masks with the same number of known vertices in every frame, chosen at random each time.

    The `share` is that of the vertices that are known, above 0 and below 1; at least one is known.
    """
    _check_masks(n_frames, n_vertices, share, seed)

    def mask(frame: int) -> Mask:
        chosen = _choose(np.random.default_rng([seed, frame]), n_vertices, share)
        return _mask_of(chosen, n_vertices)

    return _whole_first(mask, n_frames, n_vertices)


def camera_known(
    frames: Iterable[Positions],
    faces: Faces,
    cameras: Sequence[Camera] | Callable[[int], Sequence[Camera]],
) -> Iterator[Mask]:
    """Masks of what at least one camera sees, for example of a ring of depth cameras.

    A camera sees the vertices in front of it and inside its image that no triangle hides; both
    sides of a triangle hide what is behind them. Vertices that are not finite are not seen, and
    triangles that contain them hide nothing.

    The cameras are the same for all frames, or a function that returns those of the frame with this
    number, such as the result of :func:`orbit`.
    """
    triangles = triangles_of(faces)
    if not callable(cameras):
        check_cameras(cameras, "there are none")

    def masks() -> Iterator[Mask]:
        for frame, points in numbered(frames):
            if frame == 0:
                cells(faces, len(points))  # raises an error if a face refers to no vertex
                yield np.ones(len(points), bool)
                continue
            present = cameras(frame) if callable(cameras) else cameras
            check_cameras(present, f"frame {frame} has none")
            views = [visible(points, triangles, camera) for camera in present]
            yield np.logical_or.reduce(views)

    return masks()


def patch_known(
    faces: Faces,
    n_frames: int,
    n_vertices: int,
    share: float,
    *,
    patches: int = 4,
    lifetime: int = 15,
    seed: int = 0,
) -> Iterator[Mask]:
    """Masks that lack connected patches, as if objects in front of the mesh hid them.

    Each patch is grown ring by ring around a random vertex. It stays for `lifetime` frames and is
    then replaced by another one. The patches are replaced in turn, so the first ones have shorter
    lifetimes. They may overlap and are equally large. Their size is such that together they hide
    about `share` on average over many lifetimes; somewhat less if `share` is more than a half, as
    the middle of a mesh is covered more often than its ends.

    Args:
        faces: (m, 3) integers, or other polygons.
        n_frames: number of masks.
        n_vertices: k.
        share: share of the vertices that is missing, above 0 and below 1. A patch has at least one
            vertex, and no more than its connected component.
        patches: number of patches at a time, at least 1.
        lifetime: in frames, at least 1.
        seed: as of all.
    """
    _check_masks(n_frames, n_vertices, share, seed)
    check_integer("patches", patches, 1)
    check_integer("lifetime", lifetime, 1)
    offsets, neighbours = cells(faces, n_vertices)
    # The probability that no patch covers a vertex is (1 - size / k) ** patches.
    size = max(1, round((1 - (1 - share) ** (1 / patches)) * n_vertices))

    @lru_cache(maxsize=patches)
    def grown(patch: int, life: int) -> Integers:
        start = rng_of(Purpose.PATCH, seed, patch, life).integers(n_vertices)
        return _grow(int(start), size, offsets, neighbours)

    def mask(frame: int) -> Mask:
        ages = [frame - 1 + patch * lifetime // patches for patch in range(patches)]
        hidden = [grown(patch, age // lifetime) for patch, age in enumerate(ages)]
        return ~_mask_of(np.concatenate(hidden), n_vertices)

    return _whole_first(mask, n_frames, n_vertices)


def dropout(n_frames: int, n_vertices: int, share: float, *, seed: int = 0) -> Iterator[Mask]:
    """Masks in which whole frames are lost at random, as on an unreliable connection.

    The `share` is the probability that a frame is lost, above 0 and below 1.
    """
    _check_masks(n_frames, n_vertices, share, seed)

    def mask(frame: int) -> Mask:
        lost = rng_of(Purpose.DROPOUT, seed, frame).random() < share
        return np.full(n_vertices, not lost)

    return _whole_first(mask, n_frames, n_vertices)


def add_noise(
    frames: Iterable[Positions], faces: Faces, sigma: float, *, seed: int = 0
) -> Iterator[Positions]:
    """Adds Gaussian noise to every coordinate.

    Its standard deviation `sigma`, at least 0, is in mean edges of frame 0, which must be finite.
    Positions keep their dtype.
    """
    check_not_negative("sigma", sigma)
    triangles_of(faces)
    check_integer("seed", seed, 0)

    def noise(frame: int, n_vertices: int) -> Floats:
        return sigma * rng_of(Purpose.NOISE, seed, frame).standard_normal((n_vertices, 3))

    return _displaced(frames, faces, noise)


def add_outliers(
    frames: Iterable[Positions],
    faces: Faces,
    share: float,
    *,
    distance: float = 10.0,
    seed: int = 0,
) -> Iterator[Positions]:
    """Moves some vertices, chosen at random in every frame, far from their positions.

    A `share` of the vertices, above 0 and below 1 and at least one, is moved by a `distance` in
    mean edges of frame 0, which must be finite, in a random direction. Positions keep their dtype.
    """
    check_between("share", share, 0, 1)
    check_positive("distance", distance)
    triangles_of(faces)
    check_integer("seed", seed, 0)

    def outliers(frame: int, n_vertices: int) -> Floats:
        rng = rng_of(Purpose.OUTLIERS, seed, frame)
        chosen = _choose(rng, n_vertices, share)
        directions = rng.standard_normal((len(chosen), 3))
        offsets = np.zeros((n_vertices, 3))
        offsets[chosen] = distance * directions / np.linalg.norm(directions, axis=1, keepdims=True)
        return offsets

    return _displaced(frames, faces, outliers)


def _choose(rng: "np.random.Generator", n_vertices: int, share: float) -> Integers:
    return rng.choice(n_vertices, max(1, round(share * n_vertices)), replace=False)


def _mask_of(vertices: Integers, n_vertices: int) -> Mask:
    return np.asarray(np.bincount(vertices, minlength=n_vertices) > 0)


def _whole_first(mask: Callable[[int], Mask], n_frames: int, n_vertices: int) -> Iterator[Mask]:
    for frame in range(n_frames):
        yield mask(frame) if frame > 0 else np.ones(n_vertices, bool)


def _grow(start: int, size: int, offsets: Integers, neighbours: Integers) -> Integers:
    """Returns `size` vertices around `start`, or its whole component if that is smaller."""
    patch = {start: None}  # a dict keeps the order, unlike a set
    ring = [start]
    while ring and len(patch) < size:
        around = np.concatenate([neighbours[offsets[v] : offsets[v + 1]] for v in ring])
        ring = [v for v in dict.fromkeys(around.tolist()) if v not in patch]
        patch.update(dict.fromkeys(ring))
    return np.array(list(patch)[:size])


def _displaced(
    frames: Iterable[Positions], faces: Faces, offsets: Callable[[int, int], Floats]
) -> Iterator[Positions]:
    """Adds offsets(number of the frame, k), in mean edges, to all frames but the first."""
    mean_edge = 0.0
    for frame, points in numbered(frames):
        if frame == 0:
            mean_edge = mean_edge_of(points, faces)
            yield points
        else:
            moved = points + mean_edge * offsets(frame, len(points))
            with np.errstate(over="ignore"):
                displaced = moved.astype(points.dtype)
            lost = (np.isinf(displaced) & np.isfinite(points)).any(axis=1)
            if lost.any():
                raise InputError(
                    f"vertex {int(lost.argmax())} would be moved out of the range of "
                    f"{points.dtype}",
                    frame=frame,
                )
            yield displaced


def _check_masks(n_frames: int, n_vertices: int, share: float, seed: int) -> None:
    check_integer("n_frames", n_frames, 1)
    check_integer("n_vertices", n_vertices, 1)
    check_between("share", share, 0, 1)
    check_integer("seed", seed, 0)
