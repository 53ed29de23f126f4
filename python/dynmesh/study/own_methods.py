"""Methods of a user, which are measured beside those of dynmesh."""

import importlib
import sys
import time
from collections.abc import Callable, Iterable, Mapping
from itertools import count
from operator import attrgetter
from pathlib import Path
from typing import Any, Protocol, TypeAlias

import numpy as np

from .._checks import check_callable, check_complete, check_positions
from .._errors import InputError, KindError, locating
from ..sequence import Mask, Positions
from .completion import Completion, Faces, Method
from .methods import COMPARED

_COLOURS = ("#000000", "#56b4e9", "#882255", "#999933")


class Pushes(Protocol):
    """Completes one sequence, as :class:`dynmesh.Completer` does."""

    def push(self, points: Positions, known: Mask) -> Positions:
        """Returns the next frame, (k, 3), completed; rows that are not `known`, (k,), are NaN."""


Begin: TypeAlias = Callable[[Faces, Positions], Pushes]
"""A function, or a class, of the faces (m, 3) and the first frame (k, 3), which is complete."""


class _Own(Completion):
    """Gives the method copies, so that it neither sees nor changes what it must not."""

    def __init__(self, name: str, begin: Begin, faces: Faces, first_frame: Positions) -> None:
        self._name = name
        self._numbers = count(1)
        self._shape = first_frame.shape
        begun = self._called(begin, faces.copy(), first_frame.copy())
        self._push = getattr(begun, "push", None)
        if not callable(self._push):
            raise KindError(
                f"must return an object with a method push(points, known), not {begun!r}",
                argument=name,
            )

    def complete(self, points: Positions, known: Mask) -> Positions:
        with locating(frame=next(self._numbers)):
            given = np.where(known[:, None], points, points.dtype.type(np.nan))
            start = time.thread_time()
            completed: Positions = self._called(self._push, given, known.copy())
            self.seconds = time.thread_time() - start
            check_positions(self._name, completed)
            if completed.shape != self._shape:
                raise InputError(
                    f"must return shape {self._shape}, not {completed.shape}", argument=self._name
                )
            check_complete(self._name, completed)
        return completed

    def _called(self, function: Any, *arguments: Any) -> Any:
        try:
            return function(*arguments)
        except Exception as error:
            reason = f"raised {type(error).__name__}: {error}"
            raise InputError(reason, argument=self._name) from error


def own_methods(methods: Mapping[str, Begin]) -> tuple[Method, ...]:
    """Returns methods with these names in tables and charts.

    Raises:
        TypeError, ValueError: one cannot be called, or is named as one of dynmesh.
    """
    taken = {name for method in COMPARED for name in (method.key, method.label)}
    made = []
    for index, (name, begin) in enumerate(methods.items()):
        if name in taken:
            raise InputError(f"there is a method '{name}' already", argument="methods")
        if begin is None:
            raise KindError("must be callable, not None", argument=name)
        check_callable(name, begin)

        def started(
            faces: Faces, first: Positions, name: str = name, begin: Begin = begin
        ) -> Completion:
            return _Own(name, begin, faces, first)

        made.append(Method(name, name, _COLOURS[index % len(_COLOURS)], "-.", started))
    return tuple(made)


def imported(names: Iterable[str]) -> dict[str, Begin]:
    """Returns what MODULE:NAME names, from this folder or an installed package, by NAME.

    Raises:
        ValueError: there is none, or two have the same name.
    """
    if (here := str(Path.cwd())) not in sys.path:
        sys.path.insert(0, here)  # for all that the modules import later
    found: dict[str, Begin] = {}
    for text in names:
        module, _, name = text.partition(":")
        if not (module and name):
            raise InputError(
                f"must be MODULE:NAME, such as mine:Method, not '{text}'", argument="method"
            )
        if name in found:
            raise InputError(f"two are called '{name}'", argument="method")
        try:
            found[name] = attrgetter(name)(importlib.import_module(module))
        except Exception as error:
            reason = f"cannot import {text}: {type(error).__name__}: {error}"
            if isinstance(error, ModuleNotFoundError):
                reason += f"; modules are looked for in {here} and among installed packages"
            raise InputError(reason, argument="method") from error
    return found
