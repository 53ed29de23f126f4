"""How much is measured."""

from dataclasses import dataclass


@dataclass(frozen=True)
class SpeedPlan:
    """How much is measured. The defaults are those of the pages in docs.

    Attributes:
        frames: the number of frames of the smallest mesh, frame 0 included. The subdivided mesh has
            at most 21 of them, the largest one 7.
        slow_frames: the number of frames that the slow methods complete.
        laps: the number of times that the fast methods complete all frames.
        largest_grid: the number of vertices along a side of the largest mesh.
        grids: the numbers of vertices along a side of the meshes over which time is drawn.
        slow_limit: the largest number of vertices for which slow methods are drawn there.
        latency_frames: the number of frames that are pushed one after another.
        call_rounds: the number of measurements of the overhead of Python.
        tiny: whether all meshes are small, for a test.
    """

    frames: int = 100
    slow_frames: int = 99
    laps: int = 8
    largest_grid: int = 1000
    grids: tuple[int, ...] = (32, 56, 100, 178, 316, 562, 1000)
    slow_limit: int = 32_000
    latency_frames: int = 10_000
    call_rounds: int = 30
    tiny: bool = False

    @classmethod
    def quick(cls) -> "SpeedPlan":
        """Return a plan that takes about a minute."""
        return cls(11, 2, 3, 500, (32, 56, 100, 178, 316), 4_000, 2_000, 10)

    @classmethod
    def smallest(cls) -> "SpeedPlan":
        """Return a plan that takes seconds and shows only that everything runs."""
        return cls(8, 2, 2, 20, (5, 10, 20), 100, 50, 2, tiny=True)
