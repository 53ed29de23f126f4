"""How much is measured."""

from dataclasses import dataclass

from dynmesh.study.losses import PAPER_SHARES
from dynmesh.study.plan import Plan


@dataclass(frozen=True)
class SpeedPlan(Plan):
    """How much is measured, beyond what every plan of the study says.

    Attributes:
        frames: the number of frames of the mesh that all methods are compared on, frame 0 included.
        shares: the shares of known vertices at which methods are compared.
        slow_frames: the number of frames that the slow methods complete.
        laps: the number of times that the fast methods complete all frames.
        subdivided: the frames after frame 0, slow frames and laps for the subdivided mesh.
        largest: the same for the largest mesh, which the slow methods do not complete.
        largest_grid: the number of vertices along a side of the largest mesh.
        structured_frames: the number of frames of the largest mesh for losses that are not random;
            0 leaves these losses out.
        grids: the numbers of vertices along a side of the meshes over which time is drawn.
        slow_limit: the largest number of vertices for which slow methods are drawn there.
        latency_frames: the number of frames that are pushed one after another.
        call_rounds: the number of measurements of the overhead of Python.
        cpp_repetitions: the number of repetitions of the C++ benchmarks.
        cpp_filter: a regular expression for the names of the C++ benchmarks.
        tiny: whether all meshes are small, for a test.
    """

    frames: int = 100
    shares: tuple[float, ...] = PAPER_SHARES
    slow_frames: int = 99
    laps: int = 8
    subdivided: tuple[int, int, int] = (20, 20, 5)
    largest: tuple[int, int, int] = (6, 0, 2)
    largest_grid: int = 1000
    structured_frames: int = 1
    grids: tuple[int, ...] = (32, 56, 100, 178, 316, 562, 1000)
    slow_limit: int = 32_000
    latency_frames: int = 10_000
    call_rounds: int = 30
    cpp_repetitions: int = 5
    cpp_filter: str = "."
    tiny: bool = False

    @classmethod
    def quick(cls) -> "SpeedPlan":
        """Return a plan that takes about a minute."""
        return cls(
            frames=11,
            slow_frames=2,
            laps=4,
            subdivided=(5, 0, 3),
            largest=(2, 0, 1),
            structured_frames=0,
            grids=(32, 56, 100, 178, 316),
            slow_limit=4_000,
            latency_frames=2_000,
            call_rounds=10,
            cpp_repetitions=3,
            cpp_filter="side:100/",
        )

    @classmethod
    def smallest(cls) -> "SpeedPlan":
        """Return a plan that takes seconds and shows only that everything runs."""
        return cls(
            frames=8,
            slow_frames=2,
            laps=2,
            subdivided=(2, 1, 1),
            largest=(2, 0, 1),
            largest_grid=20,
            structured_frames=1,
            grids=(5, 10, 20),
            slow_limit=100,
            latency_frames=50,
            call_rounds=2,
            cpp_repetitions=1,
            cpp_filter="push_mask/side:100/known:50",
            tiny=True,
        )
