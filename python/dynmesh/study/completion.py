"""The interface that all compared methods have in common."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..sequence import Mask, Positions

Faces = NDArray[np.integer[Any]]


class Completion(Protocol):
    """A method that completes one sequence, frame by frame.

    Attributes:
        seconds: the time of the last frame if the method measures it itself, else None.
    """

    seconds: float | None = None

    @property
    def iterations(self) -> int:
        """The number of iterations of the last frame, or 0 if the method does not iterate."""
        return 0

    @property
    def prior_weight(self) -> float:
        """How far the last frame used a training sequence, from 0 to 1."""
        return 0.0

    def complete(self, points: Positions, known: Mask) -> Positions:
        """Complete the next frame. The next call may overwrite the returned array.

        Raises:
            RuntimeError: the method cannot complete this frame.
        """


@dataclass(frozen=True)
class Method:
    """A method and how it is shown.

    Attributes:
        key: the name in JSON files.
        label: the name in tables and figures.
        colour: the colour in figures, chosen so that colour-blind readers can tell it from others.
        dash: "--" for methods of other libraries and variants that the paper does not have, "-."
            for those of a user, else "-".
        begin: a function of the faces and frame 0 that returns a new completion. It raises
            ImportError if a library is missing, and ValueError if the method cannot run here.
        completes: False if the method only shows how long a part of the work takes, so that its
            error means nothing.
    """

    key: str
    label: str
    colour: str
    dash: str
    begin: Callable[[Faces, Positions], Completion]
    completes: bool = True
