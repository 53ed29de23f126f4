"""Pictures and pages of sequences. They require the extra `view`."""

from .plotting import plot

__all__ = ["plot"]
