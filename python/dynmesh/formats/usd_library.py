"""The library of USD: its modules, its errors and its arrays."""

import contextlib
from collections.abc import Iterator
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._errors import InputError, of_library
from .._extras import require


def library_array(kind: str, array: NDArray[Any]) -> Any:
    """Returns a copy as an array of the library, of integers, bools or else float32."""
    dtype = {"BoolArray": np.bool_, "IntArray": np.int32}.get(kind, np.float32)
    return getattr(pxr("Vt"), kind).FromNumpy(np.ascontiguousarray(array, dtype))


def pxr(name: str) -> ModuleType:
    """Imports a module of the library."""
    return require(f"pxr.{name}", extra="usd")


@contextlib.contextmanager
def of_usd(tried: str, kind: type[Exception] = InputError) -> Iterator[None]:
    """Raises the library's errors as :func:`of_library` does, and keeps it from printing."""
    delegate = pxr("UsdUtils").CoalescingDiagnosticDelegate()  # suppresses printing while it exists
    try:
        with of_library(tried, kind):
            yield
    finally:
        del delegate
