"""Keywords that a function does not have."""

import inspect
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

from ._errors import KindError

P = ParamSpec("P")
R = TypeVar("R")


def suggesting(function: Callable[P, R]) -> Callable[P, R]:
    """Makes a function refuse a keyword that it does not have with the most similar one."""
    keywords = [
        name
        for name, parameter in inspect.signature(function).parameters.items()
        if parameter.kind != parameter.POSITIONAL_ONLY
    ]

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        if unknown := [name for name in kwargs if name not in keywords]:
            from difflib import get_close_matches  # takes a while

            near = get_close_matches(unknown[0], keywords, 1)
            hint = f"; did you mean '{near[0]}'?" if near else ""
            raise KindError(f"{function.__qualname__}() has no argument '{unknown[0]}'{hint}")
        return function(*args, **kwargs)

    return call
