"""One folder of scans to track, among many files to process."""

from dataclasses import dataclass
from pathlib import Path

from .._errors import DynmeshError
from .track_report import TrackFileReport
from .tracking import track_into
from .tracking_options import TrackingOptions


@dataclass(frozen=True)
class TrackingJob(TrackingOptions):
    """Scans in which a mesh is tracked, with the options of :func:`dynmesh.track_file`.

    Attributes:
        input: the scans.
        output: path of the tracked sequence; its folder is created if it does not exist.
        template: a mesh file whose first frame has about the pose of the first scan.

    The other options are attributes of the same name.
    """

    input: Path
    output: Path

    def track(self, *, overwrite: bool) -> TrackFileReport:
        """Tracks the mesh; errors name the scans if they name no other file."""
        try:
            return track_into(self.input, self.output, self, overwrite)
        except DynmeshError as error:
            error.file = error.file or Path(self.input)
            raise
