"""Known masks, noise and outliers as sensors leave them, made from whole sequences.

Frame 0 is always whole and untouched. Equal seeds give equal results, and what happens in a frame
depends on the seed and on the number of the frame, but not on how many frames there are. Arguments
are refused at the call, and frames when their turn comes.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from enum import IntEnum
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._checks import (
    check_array,
    check_between,
    check_complete,
    check_finite,
    check_integer,
    check_positions,
    check_positive,
)
from .._core import cells
from .._errors import InputError, KindError, locating
from ..sequence import Mask, Positions, check_faces
from .visibility import Camera, visible

_Integers = NDArray[np.integer[Any]]
_Floats = NDArray[np.float64]


def random_known(n_frames: int, n_vertices: int, share: float, *, seed: int = 0) -> Iterator[Mask]:
    """Masks that observe the same number of vertices in every frame, picked anew at random.

    Args:
        n_frames: number of masks; the first is True throughout, as frame 0 must be complete.
        n_vertices: k.
        share: of the vertices that is known, above 0 and below 1; at least one vertex is.
        seed: equal seeds give equal masks. Frame i does not depend on `n_frames`.

    Returns:
        An iterator over (k,) bool.

    Raises:
        TypeError: an argument is of the wrong kind.
        ValueError: an argument is out of range.
    """
    _check_masks(n_frames, n_vertices, share, seed)

    def mask(frame: int) -> Mask:
        chosen = _choose(np.random.default_rng([seed, frame]), n_vertices, share)
        return _mask_of(chosen, n_vertices)

    return _whole_first(mask, n_frames, n_vertices)


def camera_known(
    frames: Iterable[Positions],
    faces: _Integers,
    cameras: Sequence[Camera] | Callable[[int], Sequence[Camera]],
) -> Iterator[Mask]:
    """Masks that observe what at least one camera sees, as a ring of depth cameras does.

    A camera sees the vertices in front of it and inside its image that no triangle hides; both
    sides of a triangle hide what is behind them. Vertices that are not finite are not seen, and
    their triangles hide nothing.

    Args:
        frames: (k, 3) positions each, of which one at a time is held.
        faces: (m, 3) integers.
        cameras: the same ones for all frames, or a function from the number of a frame to its own,
            such as :func:`orbit` returns.

    Returns:
        An iterator over (k,) bool, one for each frame; the first is True throughout.

    Raises:
        TypeError: an argument or a frame is of the wrong kind.
        ValueError: there is no camera; a face refers to a vertex
            that frame 0 does not have; a frame has another shape than frame 0.
    """
    _check_faces(faces)
    if not callable(cameras):
        _check_cameras(cameras, "there is none")

    def masks() -> Iterator[Mask]:
        for frame, points in _numbered(frames):
            if frame == 0:
                cells(faces, len(points))  # refuses faces that do not fit
                yield np.ones(len(points), bool)
                continue
            present = cameras(frame) if callable(cameras) else cameras
            _check_cameras(present, f"frame {frame} has none")
            views = [visible(points, faces, camera) for camera in present]
            yield np.logical_or.reduce(views)

    return masks()


def patch_known(
    faces: _Integers,
    n_frames: int,
    n_vertices: int,
    share: float,
    *,
    patches: int = 4,
    lifetime: int = 15,
    seed: int = 0,
) -> Iterator[Mask]:
    """Masks that miss connected patches, as something in front of the mesh leaves them.

    Each patch is grown ring by ring through the cells, around a vertex picked at random. It stays
    for `lifetime` frames and is then followed by another one elsewhere. The patches do this in
    turn, which is why the first ones have shorter lives. They may overlap: they are equally large,
    such that all of them together hide about `share` on the average over many lives, somewhat less
    where that is more than half, as the middle of a mesh is covered more often than its ends.

    Args:
        faces: (m, 3) integers.
        n_frames: number of masks; the first is True throughout.
        n_vertices: k.
        share: of the vertices that is missing, above 0 and below 1. A patch has at least one
            vertex, and no more than the connected component that it is in.
        patches: how many there are at a time, at least 1.
        lifetime: in frames, at least 1.
        seed: equal seeds give equal masks. Frame i does not depend on `n_frames`.

    Returns:
        An iterator over (k,) bool.

    Raises:
        TypeError: an argument is of the wrong kind.
        ValueError: an argument is out of range, or a face refers to a vertex that is not there.
    """
    _check_masks(n_frames, n_vertices, share, seed)
    check_integer("patches", patches, 1)
    check_integer("lifetime", lifetime, 1)
    offsets, neighbours = cells(faces, n_vertices)
    # A vertex is left out by all patches with the probability (1 - size / k) ** patches.
    size = max(1, round((1 - (1 - share) ** (1 / patches)) * n_vertices))

    @lru_cache(maxsize=patches)
    def grown(patch: int, life: int) -> _Integers:
        start = _rng(_Purpose.PATCH, seed, patch, life).integers(n_vertices)
        return _grow(int(start), size, offsets, neighbours)

    def mask(frame: int) -> Mask:
        ages = [frame - 1 + patch * lifetime // patches for patch in range(patches)]
        hidden = [grown(patch, age // lifetime) for patch, age in enumerate(ages)]
        return ~_mask_of(np.concatenate(hidden), n_vertices)

    return _whole_first(mask, n_frames, n_vertices)


def dropout(n_frames: int, n_vertices: int, share: float, *, seed: int = 0) -> Iterator[Mask]:
    """Masks of whole frames that are lost at random, as on a bad line.

    Args:
        n_frames: number of masks; the first is True throughout.
        n_vertices: k.
        share: probability that a frame is lost, above 0 and below 1.
        seed: equal seeds give equal masks. Frame i does not depend on `n_frames`.

    Returns:
        An iterator over (k,) bool, all False where the frame is lost, all True elsewhere.

    Raises:
        TypeError: an argument is of the wrong kind.
        ValueError: an argument is out of range.
    """
    _check_masks(n_frames, n_vertices, share, seed)

    def mask(frame: int) -> Mask:
        lost = _rng(_Purpose.DROPOUT, seed, frame).random() < share
        return np.full(n_vertices, not lost)

    return _whole_first(mask, n_frames, n_vertices)


def add_noise(
    frames: Iterable[Positions], faces: _Integers, sigma: float, *, seed: int = 0
) -> Iterator[Positions]:
    """Frames with Gaussian noise on every coordinate.

    Args:
        frames: (k, 3) positions each, of which one at a time is held; the first one finite.
        faces: (m, 3) integers.
        sigma: standard deviation in mean edges of frame 0, at least 0.
        seed: equal seeds give equal noise.

    Returns:
        An iterator over (k, 3) positions of the dtype of each frame; the first frame as it came.

    Raises:
        TypeError: an argument or a frame is of the wrong kind.
        ValueError: an argument is out of range; frame 0 is not finite or has no edges longer than
            0; a frame has another shape than frame 0.
    """
    check_finite("sigma", sigma)
    if sigma < 0:
        raise InputError(f"must be at least 0, not {sigma}", argument="sigma")
    _check_faces(faces)
    check_integer("seed", seed, 0)

    def noise(frame: int, n_vertices: int) -> _Floats:
        return sigma * _rng(_Purpose.NOISE, seed, frame).standard_normal((n_vertices, 3))

    return _displaced(frames, faces, noise)


def add_outliers(
    frames: Iterable[Positions],
    faces: _Integers,
    share: float,
    *,
    distance: float = 10.0,
    seed: int = 0,
) -> Iterator[Positions]:
    """Frames in which some vertices, picked anew at random, are far from where they should be.

    Args:
        frames: (k, 3) positions each, of which one at a time is held; the first one finite.
        faces: (m, 3) integers.
        share: of the vertices that is displaced, above 0 and below 1; at least one vertex is.
        distance: how far, in a random direction, in mean edges of frame 0, positive.
        seed: equal seeds give equal outliers.

    Returns:
        An iterator over (k, 3) positions of the dtype of each frame; the first frame as it came.

    Raises:
        TypeError, ValueError: as :func:`add_noise`.
    """
    check_between("share", share, 0, 1)
    check_positive("distance", distance)
    _check_faces(faces)
    check_integer("seed", seed, 0)

    def outliers(frame: int, n_vertices: int) -> _Floats:
        rng = _rng(_Purpose.OUTLIERS, seed, frame)
        chosen = _choose(rng, n_vertices, share)
        directions = rng.standard_normal((len(chosen), 3))
        offsets = np.zeros((n_vertices, 3))
        offsets[chosen] = distance * directions / np.linalg.norm(directions, axis=1, keepdims=True)
        return offsets

    return _displaced(frames, faces, outliers)


class _Purpose(IntEnum):
    """Keeps what is drawn for different purposes from one seed independent."""

    # Not 0, which to numpy's seeds is the same as nothing: that is :func:`random_known`.
    PATCH = 1
    DROPOUT = 2
    NOISE = 3
    OUTLIERS = 4


def _rng(purpose: _Purpose, seed: int, *numbers: int) -> "np.random.Generator":
    return np.random.default_rng([seed, *numbers, purpose])


def _choose(rng: "np.random.Generator", n_vertices: int, share: float) -> _Integers:
    return rng.choice(n_vertices, max(1, round(share * n_vertices)), replace=False)


def _mask_of(vertices: _Integers, n_vertices: int) -> Mask:
    mask = np.zeros(n_vertices, bool)
    mask[vertices] = True
    return mask


def _whole_first(mask: Callable[[int], Mask], n_frames: int, n_vertices: int) -> Iterator[Mask]:
    for frame in range(n_frames):
        yield mask(frame) if frame > 0 else np.ones(n_vertices, bool)


def _grow(start: int, size: int, offsets: _Integers, neighbours: _Integers) -> _Integers:
    """Return `size` vertices around `start`, or its whole component if that is smaller."""
    patch = {start: None}  # a dict keeps its order, unlike a set
    ring = [start]
    while ring and len(patch) < size:
        around = np.concatenate([neighbours[offsets[v] : offsets[v + 1]] for v in ring])
        ring = [v for v in dict.fromkeys(around.tolist()) if v not in patch]
        patch.update(dict.fromkeys(ring))
    return np.array(list(patch)[:size])


def _displaced(
    frames: Iterable[Positions], faces: _Integers, offsets: Callable[[int, int], _Floats]
) -> Iterator[Positions]:
    """Adds offsets(number of the frame, k), in mean edges, to all frames but the first."""
    mean_edge = 0.0
    for frame, points in _numbered(frames):
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


def mean_edge_of(first_frame: Positions, faces: _Integers) -> float:
    """The mean length of the edges, which noise and outliers are measured in.

    Raises:
        ValueError: the frame is not finite, or has no edges longer than 0.
    """
    with locating(frame=0):
        check_complete(None, first_frame)
    offsets, neighbours = cells(faces, len(first_frame))
    vertices = np.repeat(np.arange(len(first_frame)), np.diff(offsets))
    edges = first_frame.astype(np.float64)[vertices] - first_frame[neighbours]
    lengths = np.linalg.norm(edges, axis=1)
    if not lengths.any():
        raise InputError("frame 0 must have edges longer than 0, but has none", argument="frames")
    return float(lengths.mean())


def _numbered(frames: Iterable[Positions]) -> Iterator[tuple[int, Positions]]:
    """Yields frames with their numbers, and refuses those that are not like frame 0."""
    expected: tuple[int, ...] = ()
    for frame, points in enumerate(frames):
        with locating(frame=frame):
            check_positions(None, points)
        expected = expected or points.shape
        if points.shape != expected:
            raise InputError(
                f"must have shape {expected} as frame 0, not {points.shape}", frame=frame
            )
        yield frame, points


def _check_faces(faces: _Integers) -> None:
    check_array("faces", faces)
    check_faces(faces.dtype, faces.shape)


def _check_cameras(cameras: Sequence[Camera], none: str) -> None:
    """Refuses what are no cameras; `none` says where there are none."""
    if not isinstance(cameras, Sequence):
        raise KindError(f"must be a sequence of cameras, not {cameras!r}", argument="cameras")
    if len(cameras) == 0:
        raise InputError(f"must be at least one, but {none}", argument="cameras")
    for number, camera in enumerate(cameras):
        if not isinstance(camera, Camera):
            raise KindError(f"place {number} holds no camera, but {camera!r}", argument="cameras")


def _check_masks(n_frames: int, n_vertices: int, share: float, seed: int) -> None:
    check_integer("n_frames", n_frames, 1)
    check_integer("n_vertices", n_vertices, 1)
    check_between("share", share, 0, 1)
    check_integer("seed", seed, 0)
