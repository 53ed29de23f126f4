"""Sheets of a square grid: a sea, and a cloth that falls over a ball.

The waves are those of wind on deep water, by Fourier transforms (Tessendorf 2001, Simulating Ocean
Water). The cloth moves by extended position-based dynamics (Macklin 2016).
"""

import numpy as np
from numpy.typing import NDArray

from ._skin import Floats

_PATCH = 8.0  # metres after which the sea repeats itself
_WIND = np.array([2.6, 1.3])  # m/s
_AGAINST_WIND = 0.1  # relative amplitude of waves that run against the wind
_RIPPLE = 0.1  # metres; waves not much longer than that are damped out
_WAVE_HEIGHT = 0.11  # metres, root mean square
_CHOP = 0.7  # horizontal displacement; crests fold over from about 1.2 on


def waves(
    frames: int, grid: int, seed: int, fps: float
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Return the vertices (frames, grid^2, 3) in metres and the faces (2 (grid - 1)^2, 3) of a sea.

    The mesh spans the patch once, without the row that would repeat the first.
    """
    spacing = _PATCH / grid
    wavenumbers = 2.0 * np.pi * np.fft.fftfreq(grid, spacing)
    k = np.stack(np.meshgrid(wavenumbers, wavenumbers, indexing="ij"))
    length = np.hypot(*k)
    length[0, 0] = np.inf  # the mean level is no wave
    spectra = _amplitudes(k, length, seed) * np.stack(
        [-1j * _CHOP * k[0] / length, -1j * _CHOP * k[1] / length, np.ones_like(length)]
    )
    # Deep water: the angular frequency is the root of gravity times wavenumber.
    frequencies = np.sqrt(_GRAVITY * np.hypot(*k))
    rest = np.zeros((3, grid, grid))
    rest[:2] = spacing * np.indices((grid, grid))
    vertices = np.empty((frames, grid * grid, 3), dtype=np.float32)
    for number in range(frames):
        phases = np.exp(-1j * (number / fps) * frequencies)
        points = rest + np.fft.ifft2(spectra * phases, norm="forward").real
        vertices[number] = points.reshape(3, -1).T
    return vertices, sheet_faces(grid)


def _amplitudes(k: Floats, length: Floats, seed: int) -> NDArray[np.complex128]:
    """Return random complex amplitudes (grid, grid) of the Phillips spectrum, in metres."""
    speed = np.hypot(*_WIND)
    longest = speed**2 / _GRAVITY
    along = np.tensordot(_WIND / speed, k, axes=1) / length
    cutoffs = np.exp(-1.0 / (length * longest) ** 2 - (np.hypot(*k) * _RIPPLE) ** 2)
    power = cutoffs * along**2 / length**4
    power[along < 0.0] *= _AGAINST_WIND**2
    real, imaginary = np.random.default_rng(seed).standard_normal((2, *length.shape))
    drawn = np.sqrt(power) * (real + 1j * imaginary)
    # Half the power of a complex wave is in its real part, the surface.
    return np.asarray(drawn * _WAVE_HEIGHT / np.sqrt(np.sum(np.abs(drawn) ** 2) / 2.0))


def sheet_faces(grid: int) -> NDArray[np.int32]:
    """Return the triangles of a square grid of vertices, anticlockwise seen from above."""
    corners = np.arange(grid * grid, dtype=np.int32).reshape(grid, grid)
    a, b, c, d = corners[:-1, :-1], corners[1:, :-1], corners[1:, 1:], corners[:-1, 1:]
    return np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)


BALL_CENTRE, BALL_RADIUS = np.array([0.0, 0.0, 0.5]), 0.25  # metres
_SIDE = 1.2  # metres
_HEIGHT = 0.80  # metres, before it falls
_GRAVITY, _AIR = 9.81, 3.0  # m/s^2, and the share of the speed lost in a second
_GAP = 0.004  # metres between ball and cloth
_GRIP = 0.2  # the share of its way along the ball that a vertex in contact loses in a step
_STEP = 1.0 / 1200.0  # seconds
# Rows and columns between the ends of a spring, and its stiffness: threads, diagonals, bends.
# Those along rows are also along columns.
_SPRINGS = ((1, 0, 1.0), (1, 1, 0.2), (1, -1, 0.2), (2, 0, 0.02))

_ALL = slice(None)
Ends = tuple[slice, slice, slice]
Spring = tuple[Ends, Ends, float, float]
"""The vertices at both ends of springs that share none, their length, and their stiffness."""


def fall(
    frames: int, grid: int, seed: int, fps: float
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Return the vertices (frames, grid^2, 3) in metres and the faces of a cloth that falls."""
    draw = np.random.default_rng(seed)
    angle, shift = draw.uniform(0.0, 0.5 * np.pi), draw.uniform(-0.06, 0.06, (2, 1, 1))
    along, across = _SIDE * (np.indices((grid, grid)) / (grid - 1) - 0.5)
    cosine, sine = np.cos(angle), np.sin(angle)
    flat = np.stack([cosine * along - sine * across, sine * along + cosine * across]) + shift
    heights = _HEIGHT + 0.0005 * draw.standard_normal((1, grid, grid))
    points = np.concatenate([flat, heights])
    springs = _springs(grid)
    before, vertices = points.copy(), np.empty((frames, grid * grid, 3), dtype=np.float32)
    steps = 0
    for number, frame in enumerate(vertices):
        while (steps + 0.5) * _STEP < number / fps:
            speed = (points - before) * (1.0 - _AIR * _STEP)
            before, points = points, points + speed
            points[2] -= _GRAVITY * _STEP**2
            for spring in springs:
                _pull(points, *spring)
            _keep_out(points, before)
            steps += 1
        frame[:] = points.reshape(3, -1).T
    return vertices, sheet_faces(grid)


def _springs(grid: int) -> list[Spring]:
    springs: list[Spring] = []
    for down, right, share in _SPRINGS:
        length = _SIDE / (grid - 1) * float(np.hypot(down, right))
        left, more = max(0, -right), max(0, right)
        columns = slice(left, grid - more), slice(more, grid - left)
        for start in range(2 * down):
            rows = (slice(start + end, grid - down + end, 2 * down) for end in (0, down))
            (a, b), (c, d) = zip(rows, columns, strict=True)
            springs.append(((_ALL, a, b), (_ALL, c, d), length, share))
            if right == 0:
                springs.append(((_ALL, b, a), (_ALL, d, c), length, share))
    return springs


def _pull(points: Floats, first: Ends, second: Ends, length: float, share: float) -> None:
    """Move the ends of springs towards their length, by a share of what is missing."""
    span = points[second] - points[first]
    size = np.sqrt(np.sum(span * span, axis=0))
    span *= 0.5 * share * (1.0 - length / size)
    points[first] += span
    points[second] -= span


def _keep_out(points: Floats, before: Floats) -> None:
    """Move vertices in the ball to its surface, and slow them along it."""
    outward = points - BALL_CENTRE[:, None, None]
    inside = np.sum(outward**2, axis=0) < (BALL_RADIUS + _GAP) ** 2
    normal = outward[:, inside] / np.linalg.norm(outward[:, inside], axis=0)
    touching = BALL_CENTRE[:, None] + (BALL_RADIUS + _GAP) * normal
    motion = touching - before[:, inside]
    along = motion - np.sum(motion * normal, axis=0) * normal
    points[:, inside] = touching - _GRIP * along
