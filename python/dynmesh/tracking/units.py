"""The units of length of a template and of scans, and which ones explain how their sizes differ."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._arrays import Positions
from .._errors import InputError
from ..formats.units import UNITS, agreed, explaining
from ..frame import Frames
from ..geometry import mean_edge_of, size_of
from ..scans import Scan, ScanReader, unit_of_scans
from .background import extent_of, without_planes

_ALIKE = _core.other_size
"""Sizes that differ by less than this factor need no other unit."""

_EXPLAINED = 1.15
"""Units explain a ratio of sizes up to this factor, as a scan shows a part or other things, too."""

_EXAMINED = 4000
"""So many points of a camera are measured."""

_LARGEST_ROOM = 20.0
"""A scan is at most so many times as large as the subject."""

_SUBJECTS = (1e-3, 100.0)
"""Metres between which the size of a subject lies."""


class Units(NamedTuple):
    """The metres in a unit of a template and of scans; None if they are unknown.

    If `is_assumed`, nothing states that of the template.
    """

    template: float | None
    scans: float | None
    is_assumed: bool = False

    @property
    def factor(self) -> float:
        """The unit of the scans in that of the template; 1 if one of them is unknown."""
        if self.template is None or self.scans is None:
            return 1.0
        return self.scans / self.template

    def told(self, ratio: float, size: float) -> str:
        """Says which units explain that a scan is not as large as the template.

        Args:
            ratio: how many times as large the scan is, in the unit of the template.
            size: of the template, in its unit.

        Returns:
            A sentence; empty if the sizes are alike.
        """
        if is_alike(ratio):
            return ""
        message = f"the scan is {ratio:.3g} times as large as the template"
        if is_alike(ratio / self.factor):
            return f"{message}, as if both were in the same unit: if so, what is stated is wrong"
        low, high = _SUBJECTS
        pairs = [
            (ours, theirs)
            for ours, theirs in explaining(ratio / self.factor, _EXPLAINED)
            if low <= size * UNITS[ours] <= high
        ]
        if not pairs:
            return message
        # What is stated is believed, unless nothing explains the ratio then.
        ours, theirs = max(pairs, key=lambda pair: sum(map(_is, self, pair)))
        of_template = None if self.is_assumed else self.template
        stated = {"`template_unit`": of_template, "`scan_unit`": self.scans}
        unstated = " and ".join(name for name, unit in stated.items() if unit is None)
        advice = f"if so, say it by {unstated}" if unstated else "if so, what is stated is wrong"
        return f"{message}, as if the template were in {ours} and the scan in {theirs}: {advice}"


def _is(stated: float | None, unit: str) -> bool:
    return stated is not None and math.isclose(stated, UNITS[unit])


def ratio_of(scan: Scan, template: Positions, faces: NDArray[np.integer[Any]]) -> float:
    """How many times as large as a template a scan is, of which no camera sees more.

    The cloud of one camera is as large wherever the camera is taken to stand. Floor and walls do
    not count: planes that are larger than the template or, if what is left is of another size, as
    in another unit, than a template of that size.
    """
    size, edge = size_of(template[np.unique(faces)]), mean_edge_of(template, faces)
    own = extent_of(_places_on(template, faces)) or size
    clouds = [cloud[:: 1 + len(cloud) // _EXAMINED] for cloud in scan.clouds]
    whole = max(map(extent_of, clouds)) / own

    def without_room(factor: float) -> float:
        """The same without the planes that are larger than a template of another size."""
        room = {"thickness": factor * edge, "size": factor * size}
        left = [without_planes(cloud, **room) for cloud in clouds]
        return max(map(extent_of, left)) / own or whole

    ratio = without_room(1)
    steps = range(math.ceil(math.log(_LARGEST_ROOM, _ALIKE)), -1, -1)
    for factor in (whole / _ALIKE**step for step in steps):
        if is_alike(ratio):
            return ratio
        other = without_room(factor)
        if is_alike(other / factor):
            return without_room(other)
    return ratio


def _places_on(template: Positions, faces: NDArray[np.integer[Any]]) -> Positions:
    """Returns places that are spread evenly over the surface."""
    corners = template[faces].astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1).cumsum()
    chosen = np.searchsorted(areas, np.linspace(0, areas[-1], _EXAMINED, endpoint=False))
    shares = np.random.default_rng(0).dirichlet([1, 1, 1], _EXAMINED)
    return np.asarray((shares[:, :, None] * corners[chosen]).sum(axis=1))


def is_alike(ratio: float, tolerance: float = _ALIKE) -> bool:
    """Whether a ratio of sizes needs no explanation."""
    return 1 / tolerance < ratio < tolerance


def units_of(
    scans: ScanReader,
    template: Frames,
    scan_unit: float | str | None,
    template_unit: float | str | None = None,
    *,
    assumes: bool = False,
) -> Units:
    """Returns the units of scans and a template, as their files state them or as they are given.

    With `assumes`, a template without a unit is in that which the file of the scan states.
    """
    stated = template.header.metres_per_unit
    own = agreed(stated, template_unit, "template_unit", template.path)
    theirs = unit_of_scans(scans, scan_unit)
    if assumes and scan_unit is None and own is None:
        return Units(theirs, theirs, is_assumed=True)
    if theirs is not None and own is None:
        raise InputError(
            f"states no unit, but the scans are in units of {theirs:g} m; state it by "
            "`template_unit`, such as m",
            file=template.path,
        )
    return Units(own, theirs)
