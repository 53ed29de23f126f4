"""The units of length of a template and of scans, and which ones explain how their sizes differ."""

import math
from typing import NamedTuple

import numpy as np

from .._errors import InputError
from ..files import Reader
from ..files.units import UNITS, agreed, explaining
from ..scans import Scan, ScanReader, unit_of_scans
from ..sequence import Positions

_ALIKE = 1.5
"""Sizes that differ by less than this factor need no other unit."""

_EXPLAINED = 1.15
"""Units explain a ratio of sizes up to this factor, as a scan shows a part or other things, too."""

_SUBJECTS = (1e-3, 100.0)
"""Metres between which the size of a subject lies."""


class Units(NamedTuple):
    """The metres in a unit of a template and of scans; None if they are unknown."""

    template: float | None
    scans: float | None

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
        if 1 / _ALIKE < ratio < _ALIKE:
            return ""
        told = f"the scan is {ratio:.3g} times as large as the template"
        if 1 / _ALIKE < ratio / self.factor < _ALIKE:
            return f"{told}, as if both were in the same unit: if so, what is stated is wrong"
        low, high = _SUBJECTS
        pairs = [
            (ours, theirs)
            for ours, theirs in explaining(ratio / self.factor, _EXPLAINED)
            if low <= size * UNITS[ours] <= high
        ]
        if not pairs:
            return told
        # What is stated is believed, unless nothing explains the ratio then.
        ours, theirs = max(pairs, key=lambda pair: sum(map(_is, self, pair)))
        stated = {"`template_unit`": self.template, "`scan_unit`": self.scans}
        unstated = " and ".join(name for name, unit in stated.items() if unit is None)
        advice = f"if so, say it by {unstated}" if unstated else "if so, what is stated is wrong"
        return f"{told}, as if the template were in {ours} and the scan in {theirs}: {advice}"


def _is(stated: float | None, unit: str) -> bool:
    return stated is not None and math.isclose(stated, UNITS[unit])


def ratio_of(scan: Scan, template: Positions) -> float:
    """How many times as large as a template a scan is, of which no camera sees more.

    The cloud of one camera is as large wherever the camera is taken to stand.
    """
    return max(map(size_of, scan.clouds)) / size_of(template)


def size_of(points: Positions) -> float:
    """The diagonal of the bounding box; 1 if there is none."""
    return float(np.linalg.norm(np.ptp(points, axis=0))) or 1.0 if len(points) else 1.0


def units_of(
    scans: ScanReader,
    template: Reader,
    scan_unit: float | str | None,
    template_unit: float | str | None = None,
    *,
    assumes: bool = False,
) -> Units:
    """Returns the units of scans and a template, as their files state them or as they are given.

    With `assumes`, a template without a unit is in that which the file of the scan states.

    Raises:
        ValueError: a unit contradicts a file; or that of the scans is known, and that of the
            template is not.
    """
    stated = template.header.metres_per_unit
    own = agreed(stated, template_unit, "template_unit", template.path)
    theirs = unit_of_scans(scans, scan_unit)
    if assumes and scan_unit is None and own is None:
        return Units(theirs, theirs)
    if theirs is not None and own is None:
        raise InputError(
            f"states no unit, but the scans are in units of {theirs:g} m; state it by "
            "`template_unit`",
            file=template.path,
        )
    return Units(own, theirs)
