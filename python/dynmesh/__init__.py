"""dynmesh completes dynamic meshes in real time.

The connectivity is fixed, the first frame is complete, and of every later frame only some vertices
were observed. dynmesh estimates the others, frame by frame, from that frame and earlier ones only:

    completer = dynmesh.Completer(faces, first_frame)
    for points, known in sensor:
        frame = completer.push(points, known)

In raw scans and depth images, whose points belong to no vertex, a tracker finds the mesh:

    tracker = dynmesh.Tracker(faces, first_frame)
    for points, normals in scanner:
        frame = tracker.push(points, normals)

The method "motion" is that of Arvanitis, Lalos, Moustakas and Fakotakis, "Fast and Effective
Dynamic Mesh Completion" (WSCG 2017); "detail", the default, starts from it.
"""

import ast
from importlib import import_module
from pathlib import Path
from typing import Any

_STUB = ast.parse(Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8"))

_HOMES = {
    alias.asname or alias.name: (node.module, alias.name)
    for node in _STUB.body
    if isinstance(node, ast.ImportFrom)
    for alias in node.names
}
"""What users import from here, and the module that has it under a name; no module of a module."""

__all__ = sorted(_HOMES)


def __getattr__(name: str) -> Any:
    """Loads what is used for the first time."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home, own = _HOMES[name]
    module = import_module(f".{home or own}", __name__)
    result = module if home is None else getattr(module, own)
    globals()[name] = result
    return result


def __dir__() -> list[str]:
    """Lists what users import."""
    return __all__
