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

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from . import alignment as alignment
    from . import baselines as baselines
    from . import errors as errors
    from . import formats as formats
    from . import frames as frames
    from . import losses as losses
    from . import metrics as metrics
    from . import polygons as polygons
    from . import registration as registration
    from . import scans as scans
    from . import sequence as sequence
    from . import synth as synth
    from . import topology as topology
    from . import whole_frames as whole_frames
    from ._core import __version__ as __version__
    from .completer import Completer as Completer
    from .errors import DoubtfulWarning as DoubtfulWarning
    from .errors import DynmeshError as DynmeshError
    from .formats import open as open
    from .formats import write as write
    from .frame import Frame as Frame
    from .frame import Frames as Frames
    from .header import Header as Header
    from .sequence import Sequence as Sequence
    from .sequence import read as read
    from .tracker import Tracker as Tracker
    from .verbs.complete import complete as complete
    from .verbs.convert import convert as convert
    from .verbs.degrade import degrade as degrade
    from .verbs.evaluate import evaluate as evaluate
    from .verbs.info import info as info
    from .verbs.picture import picture as picture
    from .verbs.register import register as register
    from .verbs.track import track as track
    from .verbs.view import view as view

_HOMES = {
    **dict.fromkeys(("DoubtfulWarning", "DynmeshError"), "errors"),
    **dict.fromkeys(("Frame", "Frames", "Header"), "frames"),
    **dict.fromkeys(("Sequence", "read"), "sequence"),
    **dict.fromkeys(("open", "write"), "formats"),
    **{"Completer": "completer", "Tracker": "tracker", "synth": "synth"},
    **{
        verb: f"verbs.{verb}"
        for verb in (
            *("complete", "convert", "degrade", "evaluate", "info", "picture", "register", "track"),
            "view",
        )
    },
}
"""What users import from here, and the module that has it, which is loaded at the first use."""

_MODULES = {
    *("alignment", "baselines", "errors", "formats", "frames", "losses", "metrics"),
    *("polygons", "registration", "scans", "sequence", "topology", "whole_frames"),
}
"""Those that have more."""

__all__ = sorted(_HOMES)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        result: Any = import_module("._core", __name__).__version__
    elif name in _MODULES or _HOMES.get(name) == name:
        return import_module(f".{name}", __name__)
    elif name in _HOMES:
        result = getattr(import_module(f".{_HOMES[name]}", __name__), name)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = result
    return result


def __dir__() -> list[str]:
    return [*__all__, *_MODULES]
