"""The settings of a completer."""

from typing import Literal, TypedDict


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
