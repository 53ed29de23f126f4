"""Gives the stubs of the compiled module, if it is built, the docstrings that it has."""

import contextlib
import inspect
from importlib import import_module
from typing import Any

import griffe

core: Any = None
with contextlib.suppress(ImportError):  # not built
    core = import_module("dynmesh._core")


class CompiledDocstrings(griffe.Extension):
    """Reads them at run time, as a stub holds signatures alone."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Called for each object that was read from the sources."""
        module, found, names = obj.path.partition("dynmesh._core.")
        if module or not found or obj.docstring is not None:
            return
        compiled: Any = core
        for name in names.split("."):
            compiled = getattr(compiled, name, None)
        text = inspect.getdoc(compiled)
        if not text:
            return
        if text.startswith(f"{obj.name}("):  # the signature, which the stub has
            text = text.partition("\n\n")[2]
        obj.docstring = griffe.Docstring(text, parent=obj, parser="google")
