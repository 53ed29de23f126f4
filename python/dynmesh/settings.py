"""The settings of a completer: one table from which every interface of the package is made."""

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, dataclass
from typing import Any, Literal, TypeVar, cast

from ._core import setting_table
from ._errors import KindError
from ._settings import Settings as Settings  # also for users of this module

Function = TypeVar("Function", bound=Callable[..., Any])


@dataclass(frozen=True)
class Setting:
    """One setting of :class:`dynmesh.Completer`.

    Attributes:
        name: in Python; command lines have hyphens in it.
        default: the value if none is given.
        help: what it does, in a sentence or two for the command line.
        choices: all values, if there are few.
        method: the only method that has this setting; None if both have it.
        least: the smallest value of an integer.
        most: the largest one.
        metavar: what the command line calls a value.
    """

    name: str
    default: Any
    help: str
    choices: Sequence[str] = ()
    method: Literal["motion", "detail"] | None = None
    least: int | None = None
    most: int | None = None
    metavar: str = ""

    @property
    def kind(self) -> type[Any]:
        """The type of its values; None is a value too if it is the default."""
        return float if self.default is None else type(self.default)


SETTINGS: dict[str, Setting] = {row["name"]: Setting(**row) for row in setting_table()}
"""All settings by name, as the compiled core has them."""


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
    return with_keywords(function, default_settings, Settings.__annotations__)


def with_keywords(
    function: Function, defaults: Mapping[str, Any], types: Mapping[str, Any]
) -> Function:
    """Shows keywords in the place of the last parameter of a function, which takes the rest.

    A keyword with the default `dataclasses.MISSING` must be given.
    """
    signature = inspect.signature(function)
    *others, rest = signature.parameters.values()
    assert rest.kind == rest.VAR_KEYWORD
    keywords = [
        inspect.Parameter(
            name,
            inspect.Parameter.KEYWORD_ONLY,
            default=inspect.Parameter.empty if default is MISSING else default,
            annotation=types[name],
        )
        for name, default in defaults.items()
    ]
    vars(function)["__signature__"] = signature.replace(parameters=[*others, *keywords])
    return function
