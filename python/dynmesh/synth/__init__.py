"""Built-in animated meshes, which are generated from a seed and need no download.

All have z up and are in metres. Each function takes the number of `frames`, at least 1, a `seed`,
of which equal ones give equal sequences, and the frames per second, `fps`: a higher rate samples
the same motion more finely. Those with a `grid` have so many vertices along either side, at least
2, and 2 (grid - 1)^2 triangles.
"""

from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .._checks import check_integer, check_positive
from .._options import Input
from ..sequence import Sequence
from ._beetle import march
from ._bust import speak
from ._choreography import walk
from ._hand import count
from ._heart import beat
from ._sheets import fall, waves

__all__ = ["Name", "beetle", "bust", "cloth", "hand", "heart", "ocean", "sequence", "walker"]


def ocean(frames: int = 1500, *, grid: int = 50, seed: int = 0, fps: float = 30.0) -> Sequence:
    """Return a choppy sea (Tessendorf 2001) of `grid` by `grid` vertices.

    The `seed` selects the waves.
    """
    _check(frames, seed, fps)
    check_integer("grid", grid, 2)
    return _sequence(*waves(frames, grid, seed, fps), fps)


def walker(frames: int = 175, *, seed: int = 0, fps: float = 30.0) -> Sequence:
    """Return a human figure that walks, turns round, does a handstand and stands up again.

    It is a closed surface of genus 0 with 10002 vertices and 20000 triangles, skinned with dual
    quaternions (Kavan et al. 2007). The connectivity is the same for all seeds. The choreography is
    spread over the frames, so that the poses do not depend on `fps`; the `seed` varies the gait and
    the build.
    """
    _check(frames, seed, fps)
    return _sequence(*walk(frames, seed), fps)


def bust(frames: int = 150, *, seed: int = 0, fps: float = 30.0) -> Sequence:
    """Return a head with neck and shoulders, which looks about and speaks.

    It is a closed surface, skinned with dual quaternions; the lips part as the jaw goes down.
    The `seed` varies where it looks and what it says.
    """
    _check(frames, seed, fps)
    return _sequence(*speak(frames, seed, fps), fps)


def hand(frames: int = 97, *, seed: int = 0, fps: float = 30.0) -> Sequence:
    """Return a hand that closes and counts to five on its fingers.

    It is a closed surface with 16 bones, skinned with dual quaternions.
    The `seed` varies how fast and how far the fingers bend.
    """
    _check(frames, seed, fps)
    return _sequence(*count(frames, seed, fps), fps)


def cloth(frames: int = 90, *, grid: int = 50, seed: int = 0, fps: float = 30.0) -> Sequence:
    """Return a square of cloth of 1.2 m that falls over a ball and hangs there.

    The ball, of a radius of 0.25 m around (0, 0, 0.5), is not part of the mesh.
    The `seed` varies how the cloth lies over the ball.
    """
    _check(frames, seed, fps)
    check_integer("grid", grid, 2)
    return _sequence(*fall(frames, grid, seed, fps), fps)


def beetle(frames: int = 90, *, seed: int = 0, fps: float = 30.0) -> Sequence:
    """Return a stag beetle that walks and opens its jaws and wings.

    Each of its 31 parts is a closed surface of its own, of equally many vertices, which follow each
    other, and moves as a rigid body.
    The `seed` varies stride and pace.
    """
    _check(frames, seed, fps)
    return _sequence(*march(frames, seed, fps), fps)


def heart(frames: int = 81, *, seed: int = 0, fps: float = 30.0) -> Sequence:
    """Return a heart that beats beside a lung that breathes.

    Either is a closed surface, of equally many vertices, the heart first; they never touch.
    The `seed` varies the rates of the heart and of the breath.
    """
    _check(frames, seed, fps)
    return _sequence(*beat(frames, seed, fps), fps)


def _check(frames: int, seed: int, fps: float) -> None:
    check_integer("frames", frames, 1)
    check_integer("seed", seed, 0)
    check_positive("fps", fps)


def _sequence(vertices: NDArray[np.float32], faces: NDArray[np.int32], fps: float) -> Sequence:
    return Sequence(vertices, faces, fps=float(fps), up_axis="z", metres_per_unit=1.0)


Name = Literal["ocean", "walker", "bust", "hand", "cloth", "beetle", "heart"]


def sequence(name: Name, *, frames: Input[int | None] = None, seed: Input[int] = 0) -> Sequence:
    """Makes a built-in sequence.

    Args:
        name: which one: ocean, a sea; walker, a figure that walks and does a handstand; bust, a
            head that turns and speaks; hand, which counts on its fingers; cloth, which falls over
            a ball; beetle, of 31 rigid parts; or heart, which beats beside a lung.
        frames: number of frames; with fewer, the walker moves faster.
        seed: equal seeds give equal results.
    """
    make: Callable[..., Sequence] = globals()[name]
    return make(seed=seed) if frames is None else make(frames, seed=seed)
