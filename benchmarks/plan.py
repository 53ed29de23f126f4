"""How much is measured."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Plan:
    """How much is measured.

    Attributes:
        frames: of the mesh that all methods are compared on, frame 0 left out.
        slow_frames: of those, how many the slow methods complete.
        laps: how often the fast ones complete all of them.
        subdivided: the same three for the subdivided mesh.
        largest: the same three for the largest mesh, which the slow ones do not complete.
        largest_grid: vertices along its side.
        structured_frames: of the largest mesh, where many vertices next to each other are missing;
            0 leaves that out.
        grids: vertices along the side of the meshes that time is drawn over.
        slow_limit: vertices of the largest of them that slow methods complete.
        latency_frames: pushed one after another.
        call_rounds: of the calls that Python's part is measured with.
        cpp_repetitions: of the C++ benchmarks.
        cpp_filter: regular expression for their names.
        tiny: whether all meshes are small, for a test.
    """

    frames: int = 99
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
    def quick(cls) -> "Plan":
        """In about a minute."""
        return cls(
            frames=10,
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
    def smallest(cls) -> "Plan":
        """In seconds, to see that everything runs; the figures mean nothing."""
        return cls(
            frames=3,
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
