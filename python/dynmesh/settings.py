"""The settings of a completer: one table from which every interface of the package is made."""

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, TypedDict, TypeVar, cast

from ._errors import KindError

Function = TypeVar("Function", bound=Callable[..., Any])


@dataclass(frozen=True)
class Setting:
    """One setting of :class:`dynmesh.Completer`.

    Attributes:
        kind: the type of its values; None is a value too if it is the default.
        default: the value if none is given.
        help: what it does, in a sentence for the command line.
        choices: all values, if there are few.
        method: the only method that has this setting; None if both have it.
        least: the smallest value of an integer.
        metavar: what the command line calls a value.
        changes_results: whether the completed frames depend on it.
    """

    kind: type[Any]
    default: Any
    help: str
    choices: tuple[str, ...] = ()
    method: Literal["motion", "detail"] | None = None
    least: int | None = None
    metavar: str | None = None
    changes_results: bool = True


SETTINGS: dict[str, Setting] = {
    "method": Setting(
        str,
        "detail",
        "detail keeps the shape of the mesh; motion is less accurate, but fast.",
        choices=("motion", "detail"),
    ),
    "revisit": Setting(
        bool,
        True,
        "Estimate each unknown vertex again in every iteration, or only once.",
        method="motion",
    ),
    "extra_iterations": Setting(
        int,
        0,
        "Further iterations after every unknown vertex is reached.",
        method="motion",
        least=0,
        metavar="N",
    ),
    "disconnected": Setting(
        str,
        "follow",
        "Parts without a known vertex follow the nearest surface, or stay where they are.",
        choices=("follow", "hold"),
    ),
    "noise": Setting(
        float,
        None,
        "Smooth known positions with noise of this standard deviation, in the unit of positions.",
        method="detail",
        metavar="SIGMA",
    ),
    "reject_outliers": Setting(
        bool,
        False,
        "Treat known vertices as unknown if they do not move like those around them.",
        method="detail",
    ),
    "learn": Setting(
        bool,
        False,
        "Learn from the completed frames; more accurate if motions recur, and slower.",
        method="detail",
    ),
    "uncertainty": Setting(
        bool,
        False,
        "Compute the standard error of each estimated vertex; --provenance writes it.",
        method="detail",
    ),
    "threads": Setting(
        int,
        1,
        "Threads per frame of a large mesh, 256 at most.",
        least=1,
        metavar="N",
        changes_results=False,
    ),
}
"""All settings by name. `tests/python/test_settings.py` compares them with the compiled core."""


class Settings(TypedDict, total=False):
    """The table as a type, for editors and type checkers."""

    method: Literal["motion", "detail"]
    revisit: bool
    extra_iterations: int
    disconnected: Literal["follow", "hold"]
    noise: float | None
    reject_outliers: bool
    learn: bool
    uncertainty: bool
    threads: int


default_settings = cast(Settings, {name: setting.default for name, setting in SETTINGS.items()})
"""The settings of a :class:`dynmesh.Completer` that is given none."""


def all_settings(given: Settings) -> Settings:
    """The given settings, and the defaults of all others.

    Raises:
        TypeError: there is no such setting.
    """
    for name in given:
        if name not in SETTINGS:
            raise KindError(
                f"is not a setting; the settings are {', '.join(SETTINGS)}", argument=name
            )
    return {**default_settings, **given}


def takes_settings(function: Function) -> Function:
    """Shows the settings of a function with ``**settings`` as keywords, with their defaults."""
    signature = inspect.signature(function)
    *others, rest = signature.parameters.values()
    assert rest.kind == rest.VAR_KEYWORD
    keywords = [
        inspect.Parameter(
            name,
            inspect.Parameter.KEYWORD_ONLY,
            default=value,
            annotation=Settings.__annotations__[name],
        )
        for name, value in default_settings.items()
    ]
    vars(function)["__signature__"] = signature.replace(parameters=[*others, *keywords])
    return function
