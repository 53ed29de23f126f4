"""How much is measured."""

from dataclasses import dataclass

from .losses import PAPER_SHARES, SCENARIOS

SWEEP = tuple(round(0.05 * step, 2) for step in range(1, 20))
"""Shares of known vertices at which the time of method motion is measured, 5 % to 95 %."""


@dataclass(frozen=True)
class Plan:
    """How much is measured. The defaults are the whole evaluation.

    Attributes:
        frames: the largest number of frames of each sequence, frame 0 included; None means all.
        shares: the shares of known vertices at which the methods of the paper are compared. Other
            methods are compared at those of the paper.
        sweep: the shares of known vertices at which the time of motion is measured.
        second_half: the shares of known vertices at which the second half of each sequence is
            completed, after training and by offline methods.
        second_scenarios: the names of the other losses there.
    """

    frames: int | None = None
    shares: tuple[float, ...] = tuple(round(0.1 * step, 1) for step in range(1, 10))
    sweep: tuple[float, ...] = SWEEP
    second_half: tuple[float, ...] = (0.1, 0.3)
    second_scenarios: tuple[str, ...] = tuple(SCENARIOS)

    @classmethod
    def quick(cls) -> "Plan":
        """Return a plan for the same figures from fewer frames and shares."""
        sweep = (0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 0.95)
        return cls(30, PAPER_SHARES, sweep, (0.1,), ("camera",))
