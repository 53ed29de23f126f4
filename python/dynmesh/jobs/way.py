"""One way through the frames of a sequence, from a frame that is whole."""

import numpy as np

from .._core import Completer
from ..files import Frame


class Way:
    """A completer that has left a whole frame.

    Attributes:
        completer: which completes the frames.
    """

    def __init__(self, completer: Completer, origin: Frame) -> None:
        """Leaves a frame, from whose points the completer has started.

        The standard errors and ages of `origin` are those of its estimates; they go on until a
        vertex is observed.
        """
        self.completer = completer
        self._origin = origin

    def push(self, frame: Frame) -> Frame:
        """Completes a frame. The result has provenance, and standard errors with `uncertainty`.

        Raises:
            ValueError: the errors of :meth:`dynmesh.Completer.push`.
        """
        completer, origin = self.completer, self._origin
        points = completer.push(frame.points, frame.known)
        since = completer.age >= completer.n_frames  # not observed since
        errors = None
        if completer.settings["uncertainty"]:
            assert origin.standard_error is not None
            errors = np.hypot(completer.standard_error, np.where(since, origin.standard_error, 0))
        assert origin.age is not None
        return Frame(
            points,
            generation=completer.generation,
            age=completer.age + np.where(since, origin.age, 0),
            standard_error=errors,
        )
