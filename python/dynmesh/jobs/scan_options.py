"""Where cameras stand and what the units are, for tracking and for `dynmesh rig`."""

import shlex
from dataclasses import dataclass, fields
from pathlib import Path

from .._errors import InputError
from ..files import PathLike, Reader
from ..files.units import metres_of
from ..scans import ScanReader, unit_of_scans
from .option import FILES, UNIT_NAMES, given, unit_of


@dataclass(frozen=True, kw_only=True)
class ScanOptions:
    """What can be said about them; :func:`dynmesh.track_file` explains the options."""

    cameras: PathLike | None = given(
        None,
        "Poses and intrinsics of the cameras, required for depth images. [cameras.json beside "
        "SCANS]",
        FILES,
        Path,
        metavar="FILE",
    )
    scan_unit: str | float | None = given(
        None,
        f"Unit of length of SCANS: {UNIT_NAMES}. [as their files state, else as the mesh]",
        FILES,
        metavar="UNIT",
        parse=unit_of,
    )
    template_unit: str | float | None = given(
        None,
        f"Unit of length of the template: {UNIT_NAMES}. [as its file states]",
        FILES,
        metavar="UNIT",
        parse=unit_of,
    )

    def rig_command(self, scans: Path, template: Path) -> str:
        """Returns the command that judges the cameras as they are read with these options."""
        words = ["dynmesh", "rig", str(scans), "--template", str(template)]
        for option in fields(ScanOptions):
            if (value := getattr(self, option.name)) is not None:
                words += ["--" + option.name.replace("_", "-"), str(value)]
        return shlex.join(words)

    def units(self, scans: ScanReader, template: Reader) -> tuple[float | None, float]:
        """Returns the metres in the unit of the template, and the unit of the scans in it.

        Raises:
            ValueError: an option contradicts the file of the cameras; or the unit of the scans is
                known, and that of the template is not.
        """
        own = template.header.metres_per_unit
        if self.template_unit is not None:
            own = metres_of(self.template_unit, "template_unit")
        theirs = unit_of_scans(scans, self.scan_unit)
        if theirs is None:
            return own, 1.0
        if own is None:
            raise InputError(
                f"states no unit, but the scans are in units of {theirs:g} m: --template-unit m, "
                "cm or mm (in Python, template_unit=) says what it is",
                file=template.path,
            )
        return own, theirs / own
