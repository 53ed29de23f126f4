"""The units of length of a template and of scans, as they are stated."""

from typing import NamedTuple

from .._errors import InputError
from ..formats.conversion import agreed
from ..frame import Frames
from ..scans import ScanReader, unit_of_scans


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
        return Units(theirs, theirs)
    if theirs is not None and own is None:
        raise InputError(
            f"states no unit, but the scans are in units of {theirs:g} m; state it by "
            "`template_unit`, such as m",
            file=template.path,
        )
    return Units(own, theirs)
