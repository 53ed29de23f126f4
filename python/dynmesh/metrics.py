"""How far completed frames are from the truth (paper, section 4, "Metrics")."""

from ._core import ErrorSummary, nmsve, summary, vertex_error

__all__ = ["ErrorSummary", "nmsve", "summary", "vertex_error"]
