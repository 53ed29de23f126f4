"""Keywords that a function does not have, and which one may be meant."""

import difflib
import functools
import inspect
from collections.abc import Callable, Iterable
from typing import Any, ParamSpec, TypeVar, get_args, is_typeddict

from ._errors import KindError

P = ParamSpec("P")
R = TypeVar("R")

_SAME = {"mask": "known", "masks": "known", "input": "partial", "output": "out", "out": "output"}
"""Names that users give, and those of arguments that may be meant."""


def with_known_keywords(function: Callable[P, R]) -> Callable[P, R]:
    """Makes a function say what may be meant by a keyword that it does not have.

    The function then raises KindError, a TypeError, with the keyword as its argument. All functions
    that users import from the package do so.
    """

    @functools.wraps(function)
    def call(*arguments: P.args, **keywords: P.kwargs) -> R:
        if unknown := keywords.keys() - _names(function).keys():
            raise _refusal(function, min(unknown), keywords)
        return function(*arguments, **keywords)

    return call


@functools.cache
def _names(function: Callable[..., Any]) -> dict[str, Iterable[str]]:
    """The keywords of a function, and the keys of those that are dictionaries."""
    names: dict[str, Iterable[str]] = {}
    for name, one in inspect.signature(function).parameters.items():
        kinds = [kind for kind in get_args(one.annotation) if is_typeddict(kind)]
        keys = kinds[0].__annotations__ if kinds else ()
        names |= dict.fromkeys(keys, ()) if one.kind == one.VAR_KEYWORD else {name: keys}
    return names


def _refusal(function: Callable[..., Any], keyword: str, given: dict[str, Any]) -> KindError:
    """Names the keyword that is probably meant, or else all."""
    names = _names(function)
    within = {key: f"{name}={{{key!r}: ...}}" for name, keys in names.items() for key in keys}
    spelt = {**within, **dict.fromkeys(names)}
    free = [name for name in spelt if name not in given]
    like = [_SAME[keyword]] if _SAME.get(keyword) in free else []
    like += [keyword] if keyword in within else difflib.get_close_matches(keyword, free, 1)
    told = f"did you mean {spelt[like[0]] or like[0]}?" if like else f"there are {', '.join(names)}"
    return KindError(f"is not an argument; {told}", argument=keyword)
