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
        "motion",
        "motion is fast; detail keeps the shape of the mesh, is more accurate, and slower.",
        choices=("motion", "detail"),
    ),
    "revisit": Setting(
        bool,
        True,
        "Estimate each missing vertex again in every iteration, or only once.",
        method="motion",
    ),
    "extra_iterations": Setting(
        int,
        0,
        "Further iterations after every missing vertex is reached.",
        method="motion",
        least=0,
        metavar="N",
    ),
    "unseen": Setting(
        str,
        "follow",
        "Parts without a known vertex follow the rest of the mesh, or stay where they are.",
        choices=("follow", "hold"),
    ),
    "noise": Setting(
        float,
        None,
        "Smooth the known positions, whose noise has this standard deviation, in their unit.",
        method="detail",
        metavar="SIGMA",
    ),
    "reject_outliers": Setting(
        bool,
        False,
        "Treat known positions as missing if they do not move like those around them.",
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
        "Estimate how far each filled-in vertex may be off; --provenance writes it.",
        method="detail",
    ),
    "threads": Setting(
        int,
        1,
        "Threads per frame of a large mesh.",
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
    unseen: Literal["follow", "hold"]
    noise: float | None
    reject_outliers: bool
    learn: bool
    uncertainty: bool
    threads: int


default_settings = cast(Settings, {name: setting.default for name, setting in SETTINGS.items()})
"""The settings of a :class:`dynmesh.Completer` that is given none."""

file_settings: Settings = {**default_settings, "method": "detail"}
"""The settings with which files are completed if none are given: nobody waits for the next frame,
so accuracy comes before speed."""


def all_settings(given: Settings, defaults: Settings = default_settings) -> Settings:
    """The given settings, and the defaults of all others.

    Raises:
        TypeError: there is no such setting.
    """
    for name in given:
        if name not in SETTINGS:
            raise KindError(
                f"is not a setting; the settings are {', '.join(SETTINGS)}", argument=name
            )
    return {**defaults, **given}


def takes_settings(defaults: Settings) -> Callable[[Function], Function]:
    """Shows the settings of a function with ``**settings`` as keywords, with these defaults."""

    def show(function: Function) -> Function:
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
            for name, value in defaults.items()
        ]
        vars(function)["__signature__"] = signature.replace(parameters=[*others, *keywords])
        return function

    return show
