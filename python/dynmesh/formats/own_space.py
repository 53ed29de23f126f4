"""The own space of a mesh: the unit of length and the up axis of its points, and their extent.

A scene states those of its space, in which transforms place the mesh, as when a cache in
centimetres stands in a shot in metres, under a scale of 0.01. What is read and written are points
in the own space of the mesh.
"""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from ..frame import Frame

_TOLERANCE = 1e-5
"""How far from a uniform scale and from right angles transforms may be, as programs round them."""


def of_points(
    up: str | None, metres: float | None, transforms: Iterable[NDArray[np.float64]]
) -> tuple[str | None, float | None, str]:
    """Returns the up axis and the metres per unit of points, and a remark if one is unknown.

    Args:
        up: the up axis of the scene, or None.
        metres: the metres in a unit of the scene, or None.
        transforms: (3, 3) matrices that take directions, which are rows, from the space of the mesh
            to that of the scene: one for each moment that matters.
    """
    if up is None and metres is None:
        return None, None, ""
    axes, scales = set[str | None](), list[float]()
    for matrix in transforms:
        scale = float(np.cbrt(abs(np.linalg.det(matrix))))
        turn = matrix / (scale or 1.0)
        if not np.allclose(turn @ turn.T, np.eye(3), rtol=0, atol=_TOLERANCE):
            return None, None, _unknown(up, metres, "stretch the mesh unevenly")
        axes.add(None if up is None else _upwards(turn, up))
        scales.append(scale)
    is_one_size = np.allclose(scales, scales[0], rtol=_TOLERANCE, atol=0)
    axis = axes.pop() if len(axes) == 1 else None
    remark = _unknown(None if axis else up, None, "tilt the mesh")
    if is_one_size or metres is None:
        unit = None if metres is None else _scaled(metres, scales[0])
        return axis, unit, remark
    return axis, None, _unknown(None if axis else up, metres, "change the size of the mesh")


def extent_of(frame: Frame) -> NDArray[np.float32]:
    """Returns the two corners of the bounding box; without points, those of an empty range."""
    points, most = frame.points[frame.present], np.finfo(np.float32).max
    corners = points.min(axis=0, initial=most), points.max(axis=0, initial=-most)
    return np.stack(corners).astype(np.float32)


def _upwards(turn: NDArray[np.float64], up: str) -> str | None:
    """The axis of a mesh that points upwards in the scene; None if it is none."""
    direction = turn @ np.eye(3)["xyz".index(up)]
    highest = int(direction.argmax())
    return "xyz"[highest] if direction[highest] > 1 - _TOLERANCE else None


def _scaled(metres: float, scale: float) -> float:
    """A scaled unit with the fewest digits that the rounding of the transforms allows."""
    if np.isclose(scale, 1, rtol=1e-9, atol=0):
        return metres
    every = (float(f"{metres * scale:.{digits}g}") for digits in range(1, 18))
    return next(one for one in every if np.isclose(one, metres * scale, rtol=1e-7, atol=0))


def _unknown(up: str | None, metres: float | None, why: str) -> str:
    """Says what of what a scene states is not known of the points; empty if that is nothing."""
    stated = {"up axis": up, "unit of length": metres}
    lost = [name for name, value in stated.items() if value is not None]
    if not lost:
        return ""
    verb = "is" if len(lost) == 1 else "are"
    return f"transforms {why}, so the {' and '.join(lost)} of its points {verb} unknown"
