"""One folder of scans to track, among many files to process."""

from dataclasses import dataclass
from pathlib import Path

from .._errors import DynmeshError
from ..files import PathLike
from ..files.format import Gaps
from .track_report import TrackFileReport
from .tracking import track_file
from .training import TrainingFiles


@dataclass(frozen=True)
class TrackingJob:
    """Scans in which a mesh is tracked, with the arguments of :func:`dynmesh.track_file`.

    Attributes:
        input: the scans.
        output: path of the tracked sequence; its folder is created if it does not exist.
        template: a mesh file whose first frame has about the pose of the first scan.
        cameras: a file with the cameras; None means `cameras.json` beside the scans, if it exists.
        scan_unit: of the scans; None means as their files state it, or else that of the template.
        template_unit: of the template; None means as its file states it.
        gaps: "lost" if frames and images whose file is missing were not observed.
        output_format: None means the format of the suffix of `output`.
        fps: frames per second of the output.
        provenance: whether to write the generation and the age of every vertex.
        training: files with complete frames of the same mesh, or None.
        uncertainty: whether to estimate how far each vertex may be from the true surface.
        threads: of the tracker, at least 1.
    """

    input: Path
    output: Path
    template: PathLike
    cameras: PathLike | None = None
    scan_unit: str | float | None = None
    template_unit: str | float | None = None
    gaps: Gaps = "refuse"
    output_format: str | None = None
    fps: float | None = None
    provenance: bool = False
    training: TrainingFiles | None = None
    uncertainty: bool = False
    threads: int = 1

    def track(self, *, overwrite: bool, resume: bool) -> TrackFileReport:
        """Tracks the mesh; errors name the scans if they name no other file."""
        options = {name: value for name, value in vars(self).items() if name != "input"}
        try:
            return track_file(self.input, **options, overwrite=overwrite, resume=resume)
        except DynmeshError as error:
            error.file = error.file or Path(self.input)
            raise
