"""Arguments of every verb that are of no kind it takes: each is refused by its name."""

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from sequences import sea

import dynmesh
from dynmesh import registration
from dynmesh.scans import open_scans
from dynmesh.verbs.register import registered

_SEA = sea(3, grid=6, share=0.5, whole=[0])
_WHOLE = dynmesh.complete(_SEA)

_CALLS: dict[str, tuple[Callable[..., Any], Callable[..., Any]]] = {
    "complete": (dynmesh.complete, lambda **k: dynmesh.complete(_SEA, **k)),
    "convert": (dynmesh.convert, lambda **k: dynmesh.convert(_SEA, **k)),
    "degrade": (dynmesh.degrade, lambda **k: dynmesh.degrade(_WHOLE, **{"known": 0.5, **k})),
    "scan": (dynmesh.degrade, lambda **k: list(dynmesh.degrade(_WHOLE, **{"scan": True, **k}))),
    "evaluate": (dynmesh.evaluate, lambda **k: dynmesh.evaluate(_SEA, _WHOLE, **k)),
    "info": (dynmesh.info, lambda **k: dynmesh.info(_SEA, **k)),
    "view": (dynmesh.view, lambda **k: dynmesh.view(_SEA, **k)),
    "picture": (dynmesh.picture, lambda **k: dynmesh.picture(_SEA, **k)),
    "track": (dynmesh.track, lambda **k: dynmesh.track("s", **{"template": _WHOLE, **k}).read()),
    "register": (registered, lambda **k: registered("t.npz", "s/frame_00000.ply", **k).read()),
    "of arrays": (
        registration.register,
        lambda **k: registration.register(
            **{"faces": _SEA.faces, "template": _WHOLE.vertices[0], "points": _WHOLE.vertices[1]}
            | k
        ),
    ),
    "open": (dynmesh.open, lambda **k: dynmesh.open(**{"path": "t.npz", **k})),
    "write": (dynmesh.write, lambda **k: dynmesh.write(**{"path": "o.npz", "frames": _SEA, **k})),
    "open_scans": (open_scans, lambda **k: list(open_scans(**{"path": "s", **k}))),
}
_UNCHECKED = {"progress", "faces", "prim"}  # of the terminal; of arrays and files that need them


@pytest.mark.parametrize("call", _CALLS)
def test_what_is_of_no_kind_that_an_argument_takes_is_refused_by_name(
    call: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    dynmesh.write("t.npz", _WHOLE)
    dynmesh.degrade(_WHOLE, scan=True, points=400).write("s")
    function, called = _CALLS[call]
    own = {
        p.name for p in inspect.signature(function).parameters.values() if p.kind == p.KEYWORD_ONLY
    }
    for name in sorted(own - _UNCHECKED):
        for wrong in (object(), b"x", 1j):
            with pytest.raises((TypeError, ValueError), match=rf"\b{name}\b") as caught:
                called(**{name: wrong})
            assert isinstance(caught.value, dynmesh.DynmeshError), (name, wrong)
