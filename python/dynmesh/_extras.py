"""Optional libraries, which only some calls need."""

from importlib import import_module
from types import ModuleType


class MissingLibraryError(ImportError):
    """An optional library is not installed."""


def require_all(*modules: str, extra: str) -> None:
    """Imports modules early, so that a missing one is reported before any work begins."""
    for module in modules:
        require(module, extra=extra)


def require(module: str, *, extra: str) -> ModuleType:
    """Imports `module`, or raises an error that names the extra which installs it."""
    try:
        return import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        message = f"this needs {package}: pip install 'dynmesh[{extra}]'"
        raise MissingLibraryError(message) from error
