"""Wind waves on deep water by Fourier transforms (Tessendorf 2001, Simulating Ocean Water)."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_GRAVITY = 9.81  # m/s^2
_PATCH = 8.0  # metres after which the sea repeats itself
_WIND = np.array([2.6, 1.3])  # m/s
_AGAINST_WIND = 0.1  # relative amplitude of waves that run against the wind
_RIPPLE = 0.1  # metres; waves not much longer than that are damped out
_HEIGHT = 0.11  # metres, root mean square
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
    return np.asarray(drawn * _HEIGHT / np.sqrt(np.sum(np.abs(drawn) ** 2) / 2.0))


def sheet_faces(grid: int) -> NDArray[np.int32]:
    """Return the triangles of a square grid of vertices, anticlockwise seen from above."""
    corners = np.arange(grid * grid, dtype=np.int32).reshape(grid, grid)
    a, b, c, d = corners[:-1, :-1], corners[1:, :-1], corners[1:, 1:], corners[:-1, 1:]
    return np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
