"""The types of the settings of a completer, which the stub of the compiled core needs."""

from typing import Literal, TypedDict


class Settings(TypedDict, total=False):
    """Their types, for editors and type checkers."""

    method: Literal["motion", "detail"]
    revisit: bool
    extra_iterations: int
    disconnected: Literal["follow", "hold"]
    noise: float | None
    reject_outliers: bool
    learn: bool
    uncertainty: bool
    threads: int
