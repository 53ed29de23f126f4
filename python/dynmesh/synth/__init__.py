"""Built-in animated meshes, which are generated from a seed and need no download."""

from typing import Literal

from .._checks import check_integer, check_positive
from .._options import Input
from ..sequence import Sequence
from ._choreography import walk
from ._waves import waves


def ocean(frames: int = 1500, *, grid: int = 50, seed: int = 0, fps: float = 30.0) -> Sequence:
    """Return a choppy sea (Tessendorf 2001) of `grid` by `grid` vertices, z up, in metres.

    Args:
        frames: number of frames, at least 1.
        grid: vertices along either side, at least 2; there are 2 (grid - 1)^2 triangles.
        seed: selects the waves; equal seeds give equal seas.
        fps: frames per second; a higher rate samples the same motion more finely.

    Raises:
        TypeError: an argument has the wrong kind.
        ValueError: an argument is out of range.
    """
    check_integer("frames", frames, 1)
    check_integer("grid", grid, 2)
    check_integer("seed", seed, 0)
    check_positive("fps", fps)
    vertices, faces = waves(frames, grid, seed, fps)
    return Sequence(vertices, faces, fps=float(fps), up_axis="z")


def walker(frames: int = 175, *, seed: int = 0, fps: float = 30.0) -> Sequence:
    """Return a human figure that walks, turns round, does a handstand and stands up again.

    It is a closed surface of genus 0 with 10002 vertices and 20000 triangles, z up, in metres,
    skinned with dual quaternions (Kavan et al. 2007). The connectivity is the same for all seeds.

    Args:
        frames: number of frames, at least 1; the choreography is spread over them.
        seed: varies the gait and the build; equal seeds give equal figures.
        fps: frames per second stored in the sequence; the poses do not depend on it.

    Raises:
        TypeError: an argument has the wrong kind.
        ValueError: an argument is out of range.
    """
    check_integer("frames", frames, 1)
    check_integer("seed", seed, 0)
    check_positive("fps", fps)
    vertices, faces = walk(frames, seed)
    return Sequence(vertices, faces, fps=float(fps), up_axis="z")


def sequence(
    name: Literal["ocean", "walker"], *, frames: Input[int | None] = None, seed: Input[int] = 0
) -> Sequence:
    """Makes a built-in sequence: an ocean, or a figure that walks and does a handstand.

    Args:
        name: which sequence: ocean or walker.
        frames: number of frames; with fewer, the walker moves faster.
        seed: equal seeds give equal results.

    Raises:
        TypeError, ValueError: an argument is refused.
    """
    make = {"ocean": ocean, "walker": walker}[name]
    return make(seed=seed) if frames is None else make(frames, seed=seed)
