"""What is checked of a rig before a mesh is tracked with it."""

from .._errors import InputError
from ..diagnosis.rig import diagnose_rig
from ..diagnosis.rig_reading import Reading, Units
from ..files import Reader
from ..files.scans import ScanReader
from ..sequence import Positions


class Checked:
    """A rig and how it is read.

    Attributes:
        reading: how scans and template are read.
    """

    def __init__(
        self, scans: ScanReader, mesh: Reader, reading: Reading, units: Units, is_asked: bool
    ) -> None:
        """Checks nothing yet."""
        self.reading = reading
        self._scans = scans
        self._mesh = mesh
        self._units = units
        self._is_asked = is_asked

    def refuse_mistakes(self, template: Positions) -> tuple[str, ...]:
        """Compares the first scan with the template, and returns what is wrong, but not refused.

        Raises:
            ValueError: another reading fits clearly better; the message says which.
        """
        if not self._is_asked:
            return ()
        found = diagnose_rig(
            self._scans, self.reading, self._units, self._mesh.faces, template
        ).findings
        for finding in found:
            if finding.is_refused:
                raise InputError(
                    f"{finding.message}; --no-check (in Python, check=False) tracks as it is",
                    file=self._scans.path,
                )
        return tuple(finding.message for finding in found)
