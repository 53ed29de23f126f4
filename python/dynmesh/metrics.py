"""Errors of completed frames, as users import them: see :mod:`dynmesh.evaluation.metrics`."""

from .evaluation.metrics import ErrorSummary, bounding_box_diagonal, nmsve, summary, vertex_error

__all__ = ["ErrorSummary", "bounding_box_diagonal", "nmsve", "summary", "vertex_error"]
