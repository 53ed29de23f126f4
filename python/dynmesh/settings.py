"""The settings of a completer."""

from typing import Literal, TypedDict

from ._errors import KindError


class Settings(TypedDict, total=False):
    """The keywords of :class:`dynmesh.Completer`, which explains them."""

    method: Literal["motion", "detail"]
    revisit: bool
    extra_iterations: int
    disconnected: Literal["follow", "hold"]
    noise: float | None
    reject_outliers: bool
    learn: bool
    uncertainty: bool
    threads: int


def check_settings(given: Settings) -> None:
    """Refuses what is no setting, before any work.

    Raises:
        TypeError: there is no such setting.
    """
    for name in given:
        if name not in Settings.__annotations__:
            names = ", ".join(Settings.__annotations__)
            raise KindError(f"is not a setting; the settings are {names}", argument=name)
