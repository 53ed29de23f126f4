"""Cases of simulated losses and noise, and of the built-in sequences."""

from collections.abc import Callable
from typing import Any

import numpy as np
from meshes import sheet

from dynmesh import losses, synth

from .case import Case, World
from .functions import Run, of

_random = of("losses.random_known")
_camera = of("losses.camera_known")
_patch = of("losses.patch_known")
_noise = of("losses.add_noise")
_outliers = of("losses.add_outliers")
_orbit = of("losses.orbit")
_eye = of("losses.Camera")
_synth = of("synth")


def _seen(world: World, frames: Any, cameras: Any = None) -> list[Any]:
    cameras = world.cameras if cameras is None else cameras
    return list(losses.camera_known(frames, world.faces, cameras))


def _cameraof(**changed: Any) -> losses.Camera:
    usual = {"position": (4, 0, 0), "target": (0, 0, 0), "up": (0, 0, 1)}
    return losses.Camera(**(usual | changed))


def _noisy(world: World, frames: Any, sigma: Any = 0.1) -> list[Any]:
    return list(losses.add_noise(frames, world.faces, sigma))


def _mask(name: str, argument: str, value: Any, error: type[Exception]) -> Case:
    """One wrong argument of a function that makes masks."""
    given = {"n_frames": 5, "n_vertices": 49, "share": 0.5, argument: value}
    more = {"faces": sheet(7).faces} if name == "patch_known" else {}
    run = lambda _: getattr(losses, name)(**given, **more)  # noqa: E731
    case = of(f"degrade.{name}")
    return case(f"`{argument}`: {value!r}", run, error, f"{argument}:", f"not {value!r}")


_masks = [
    _mask(name, *wrong)
    for name in ("random_known", "patch_known", "dropout")
    for wrong in (
        ("share", 0, ValueError),
        ("share", 1, ValueError),
        ("share", "x", TypeError),
        ("n_frames", 0, ValueError),
        ("n_frames", 2.5, TypeError),
        ("n_vertices", 0, ValueError),
        ("n_vertices", True, TypeError),
        ("seed", -1, ValueError),
    )
]


def _frames(name: str, given: str, frames: Run, error: type[Exception], *names: str) -> Case:
    """Wrong frames, given to a function that returns others of the same mesh."""
    run = lambda w: list(_changes[name](w, frames(w)))  # noqa: E731
    return Case(f"degrade.{name}", given, run, error, names)


_changes: dict[str, Callable[[World, Any], Any]] = {
    "add_noise": _noisy,
    "add_outliers": lambda w, frames: losses.add_outliers(frames, w.faces, 0.1),
    "camera_known": _seen,
}
_wrong_frames = [
    *[
        _frames(name, given, frames, error, *names)
        for name in _changes
        for given, frames, error, *names in (
            ("frame 2 smaller", lambda w: [w.points, w.points, w.points[:48]], ValueError, "frame 2:", "(49, 3)", "(48, 3)"),
            ("frame 1 with two columns", lambda w: [w.points, w.points[:, :2]], ValueError, "frame 1:", "(49, 2)"),
            ("frame 0 of integers", lambda w: [w.points.astype(int)], TypeError, "frame 0:", "int64"),
            ("frame 0 without its last vertex", lambda w: [w.points[:48]], ValueError, "face 71", "vertex 48"),
        )
    ],
    *[
        _frames(name, given, frames, ValueError, *names)
        for name in ("add_noise", "add_outliers")
        for given, frames, *names in (
            ("NaN in frame 0", lambda w: [w.with_value(np.nan)], "frame 0:", "vertex 4", "nan"),
            ("all vertices in one place", lambda w: [0 * w.points], "frame 0", "edges"),
        )
    ],
]  # fmt: skip

cases = [
    *_masks,
    *_wrong_frames,
    _random("`share`: NaN", lambda _: losses.random_known(5, 49, np.nan), ValueError, "share:", "nan"),
    _camera("no camera for frame 2", lambda w: _seen(w, [w.points] * 4, lambda frame: w.cameras(frame) if frame < 2 else []), ValueError, "cameras:", "frame 2"),
    _camera("no camera", lambda w: _seen(w, [w.points], []), ValueError, "cameras:", "none"),
    _camera("something else for a camera", lambda w: _seen(w, [w.points], [3]), TypeError, "cameras: item 0", "3"),
    _camera("`frames`: dicts", lambda w: _seen(w, [{}]), TypeError, "frame 0:", "object"),
    _patch("`patches`: 0", lambda w: losses.patch_known(w.faces, 5, 49, 0.5, patches=0), ValueError, "patches:", "not 0"),
    _patch("`lifetime`: 0", lambda w: losses.patch_known(w.faces, 5, 49, 0.5, lifetime=0), ValueError, "lifetime:", "not 0"),
    _patch("`n_vertices`: too few", lambda w: losses.patch_known(w.faces, 5, 40, 0.5), ValueError, "faces: face 29", "vertex 40"),
    _noise("`sigma`: -1", lambda w: _noisy(w, [w.points], -1), ValueError, "sigma:", "-1"),
    _noise("`sigma`: 1e300, for float32", lambda w: _noisy(w, [w.points.astype(np.float32)] * 2, 1e300), ValueError, "frame 1: vertex 0", "float32"),
    _outliers("`share`: 1.1", lambda w: losses.add_outliers([], w.faces, 1.1), ValueError, "share:", "1.1"),
    _outliers("`faces`: (m, 2)", lambda w: losses.add_outliers([], w.faces[:, :2], 0.1), ValueError, "faces: polygon 0", "2 corners"),
    _outliers("`distance`: 0", lambda w: losses.add_outliers([], w.faces, 0.1, distance=0), ValueError, "distance:", "not 0"),
    _orbit("`n_cameras`: 0", lambda w: losses.orbit(w.points, 0), ValueError, "n_cameras:", "not 0"),
    _orbit("`degrees_per_frame`: infinity", lambda w: losses.orbit(w.points, degrees_per_frame=np.inf), ValueError, "degrees_per_frame:", "inf"),
    _orbit("`first_frame`: NaN in it", lambda w: losses.orbit(w.with_value(np.nan)), ValueError, "first_frame:", "vertex 4"),
    _orbit("`up`: zero", lambda w: losses.orbit(w.points, 1, up=(0, 0, 0)), ValueError, "up:", "(0, 0, 0)"),
    _orbit("`elevation`: 90", lambda w: losses.orbit(w.points, 1, elevation=90), ValueError, "elevation:", "not 90"),
    _orbit("all vertices in one place", lambda w: losses.orbit(0 * w.points, 1), ValueError, "first_frame:"),
    _eye("`target` is `position`", lambda _: losses.Camera((1, 2, 3), (1, 2, 3), (0, 0, 1)), ValueError, "target:", "(1, 2, 3)"),
    _eye("`target`: two numbers", lambda _: _cameraof(target=(1, 2)), ValueError, "target:", "(1, 2)"),
    _eye("`up`: text", lambda _: _cameraof(up=(0, 0, "x")), TypeError, "up:", "'x'"),
    _eye("`up`: parallel to the view", lambda _: _cameraof(up=(2, 0, 0)), ValueError, "up:", "parallel"),
    _eye("`field_of_view`: 0", lambda _: _cameraof(field_of_view=0), ValueError, "field_of_view:", "not 0"),
    _eye("`field_of_view`: NaN", lambda _: _cameraof(field_of_view=np.nan), ValueError, "field_of_view:", "nan"),
    _synth("`ocean(1, grid=1)`", lambda _: synth.ocean(1, grid=1), ValueError, "grid:", "not 1"),
    _synth("`ocean(5, fps='x')`", lambda _: synth.ocean(5, fps="x"), TypeError, "fps:", "'x'"),  # type: ignore[arg-type]
    _synth("`walker(5, seed=-1)`", lambda _: synth.walker(5, seed=-1), ValueError, "seed:", "-1"),
]  # fmt: skip
