"""Calls that a tracker must refuse, with the expected errors."""

from typing import Any

import numpy as np
from bad_calls import Array, BadCall

import dynmesh

_IMAGE = np.ones((30, 40))
_CAMERA = np.array([[30.0, 0, 20], [0, 30, 15], [0, 0, 1]])
_SHEARED = np.eye(4) + 0.2 * np.eye(4, k=1)


def _with(points: Array, value: float) -> Array:
    """Returns the points with one coordinate replaced."""
    changed = points.copy()
    changed[-1, 1] = value
    return changed


def _image(
    tracker: dynmesh.Tracker, *, depth: Any = _IMAGE, camera: Any = _CAMERA, pose: Any = None
) -> None:
    tracker.push_depth(depth, camera, np.eye(4) if pose is None else pose)


def _read_only(tracker: dynmesh.Tracker, points: Array, normals: Array) -> None:
    out = np.empty((tracker.n_vertices, 3), tracker.dtype)
    out.flags.writeable = False
    tracker.push(points, normals, out=out)


def _damaged(tracker: dynmesh.Tracker) -> bytes:
    state = bytearray(tracker.state())
    state[len(state) // 2] ^= 1
    return bytes(state)


BAD_SCANS: dict[str, BadCall[dynmesh.Tracker]] = {
    "NaN in a point": BadCall(lambda t, p, n: t.push(_with(p, np.nan), n), ValueError, "points:"),
    "infinite point": BadCall(lambda t, p, n: t.push(_with(p, np.inf), n), ValueError, "points:"),
    "NaN in a normal": BadCall(lambda t, p, n: t.push(p, _with(n, np.nan)), ValueError, "normals:"),
    "two coordinates": BadCall(lambda t, p, n: t.push(p[:, :2], n), ValueError, "points:"),
    "points of integers": BadCall(
        lambda t, p, n: t.push(p.astype(np.int64), n), TypeError, "points:"
    ),
    "a normal too few": BadCall(lambda t, p, n: t.push(p, n[1:]), ValueError, "normals:"),
    "NaN in a viewpoint": BadCall(
        lambda t, p, n: t.push(p, n, viewpoints=_with(np.ones((2, 3)), np.nan)),
        ValueError,
        "viewpoints:",
    ),
    "out read-only": BadCall(_read_only, ValueError, "out:"),
    "an image of one row of pixels": BadCall(
        lambda t, *_: _image(t, depth=_IMAGE[0]), ValueError, "depth:"
    ),
    "an image of counts": BadCall(
        lambda t, *_: _image(t, depth=_IMAGE.astype(np.uint16)), TypeError, "depth:"
    ),
    "more images than cameras": BadCall(
        lambda t, *_: t.push_depth([_IMAGE] * 2, [_CAMERA], [np.eye(4)]), ValueError, ""
    ),
    "intrinsics without focus": BadCall(
        lambda t, *_: _image(t, camera=0 * _CAMERA), ValueError, "intrinsics:"
    ),
    "a pose of three rows": BadCall(
        lambda t, *_: _image(t, pose=np.eye(4)[:3]), ValueError, "pose:"
    ),
    "a pose that is no rotation": BadCall(
        lambda t, *_: _image(t, pose=_SHEARED), ValueError, "pose:"
    ),
    "state cut off": BadCall(lambda t, *_: t.restore(t.state()[:-9]), ValueError, "state:"),
    "state damaged": BadCall(lambda t, *_: t.restore(_damaged(t)), ValueError, "state:"),
    "template with holes": BadCall(
        lambda t, *_: t.reset(np.full((t.n_vertices, 3), np.nan, t.dtype)), ValueError, "frame:"
    ),
    "state empty": BadCall(lambda t, *_: t.restore(b""), ValueError, "state:"),
}
