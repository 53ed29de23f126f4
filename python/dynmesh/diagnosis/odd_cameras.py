"""Cameras that disagree with the others or, if there is one, with the template; and how."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from .rig_reading import RigFinding
from .rig_trial import LEAST_POINTS, RigTrial

_Floats = NDArray[np.float64]

_AGREE = 0.7
_LEAST_ODD = 0.1
_LEAST_MOVED = 0.5
"""Units of the surface: a camera is odd if its points are `_LEAST_ODD` more than twice as far from
the template as those of the camera that fits best, if these are at most `_AGREE` away, and if its
own are less than half as far with another focal length; or with another pose, from `_LEAST_MOVED`
on, as a motion fits points to a shape without features whatever they are."""

_ALMOST = 0.25
"""Then they are at most so much more than twice as far."""

SCALES = np.linspace(0.8, 1.25, 19)
"""Focal lengths that are tried, relative to those of the file."""


def odd_cameras(trial: RigTrial) -> Iterator[RigFinding]:
    """Yields the cameras with a wrong pose or focal length, the worst one first."""
    left = [n for n, points in enumerate(trial.fit.points) if len(points) >= LEAST_POINTS]
    while left:
        found = {n: odd for n in left if (odd := _odd(trial, n, left)) is not None}
        if not found:
            return
        worst = max(found, key=lambda n: found[n][0])
        yield found[worst][1]
        left.remove(worst)


def _odd(trial: RigTrial, number: int, among: list[int]) -> tuple[float, RigFinding] | None:
    """Returns how odd a camera is, judged by the others among these, and what is wrong; or None."""
    reading, fit = trial.reading, trial.fit
    surface = trial.surface(reading)
    clouds, view = trial.clouds(reading), trial.views(reading)[number]
    others = [n for n in among if n != number]
    # Without what this camera says of where the template is.
    known = others or [number]
    after = surface.drawn(np.concatenate([fit.points[n] for n in known]))
    rotation, shift = _motion_between(np.concatenate([clouds[n] for n in known]), after)
    own = clouds[number] @ rotation.T + shift
    now = surface.typical(own)
    rest = min((surface.typical(clouds[n] @ rotation.T + shift) for n in others), default=0.0)
    if rest > _AGREE or now < _LEAST_ODD + 2 * rest:
        return None
    moved = surface.drawn(surface.drawn(own))
    off = float(np.linalg.norm((moved - own).mean(axis=0)))
    ways = {}
    if now >= _LEAST_MOVED + 2 * rest:
        ways[f"when moved by {off:.2g}: check its pose"] = surface.typical(moved)
    for scale in SCALES if view.camera is not None else ():
        points = view.cloud(view.camera, scale) * reading.factor @ rotation.T + shift
        points = points if others else surface.drawn(points)
        ways[longer(scale)] = surface.typical(points)
    best = min(ways, key=lambda words: ways[words], default="")
    if not best or ways[best] > 0.5 * now or ways[best] > 2 * rest + _ALMOST:
        return None
    unit = surface.unit
    seen = f"what camera {view.name!r} sees is {now * unit:.2g} from the template"
    if others:
        seen += f" (of another camera: {rest * unit:.2g})"
    message = f"{seen}, but {ways[best] * unit:.2g} {best}"
    return now - ways[best], RigFinding(message, {}, view.name)


def longer(scale: float) -> str:
    """Says that another focal length fits."""
    return f"with a focal length {scale:.3g} times that of its file: check its intrinsics"


def _motion_between(before: _Floats, after: _Floats) -> tuple[_Floats, _Floats]:
    """Returns the rotation and the shift that lead from one to the other (Kabsch 1976)."""
    start, end = before.mean(axis=0), after.mean(axis=0)
    u, _, v = np.linalg.svd((before - start).T @ (after - end))
    rotation = v.T @ np.diag([1, 1, np.sign(np.linalg.det(v.T @ u.T))]) @ u.T
    return rotation, end - rotation @ start
