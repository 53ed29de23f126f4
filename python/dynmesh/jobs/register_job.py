"""A scan to register a mesh with, or a folder of them, among many files to process."""

from dataclasses import MISSING, dataclass
from pathlib import Path

from .._errors import DynmeshError
from ..files import PathLike
from .fits import Quality
from .option import FILES, given
from .register_options import RegisterOptions
from .registering import RegisteredFile, refuse_failed, register_each, remarks_on


@dataclass(frozen=True)
class RegisterReport:
    """What registering a job has done, as :class:`TrackFileReport` tells of tracking.

    Attributes:
        frames: number of scans.
        quality: the worst of the results.
        reason: why they are not good, in a sentence; empty if they are.
    """

    frames: int
    quality: Quality
    reason: str
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class RegisterJob(RegisterOptions):
    """A mesh and a scan, or several, with the options of :func:`dynmesh.register_file`.

    Attributes:
        input: the scan, or the folder or pattern of scans.
        output: path of the registered mesh, or of the folder of these.
        template: a mesh file whose first frame is registered.

    The other options are attributes of the same name.
    """

    input: Path
    output: Path
    template: PathLike = given(MISSING, "The mesh.", FILES, Path, metavar="FILE")

    def register(self, *, overwrite: bool) -> RegisterReport:
        """Registers the mesh; errors name the scans if they name no other file.

        If some of several scans fail, the results of the others are written before the error.
        """
        try:
            made = [*register_each(self.template, self.input, self.output, self, overwrite)]
        except DynmeshError as error:
            error.file = error.file or Path(self.input)
            raise
        refuse_failed(made, Path(self.input))
        told = "{0.output.name}: {0.reason}" if Path(self.output).is_dir() else "{0.reason}"
        reason = "; ".join(told.format(one) for one in made if one.reason)
        return RegisterReport(len(made), _worst(made), reason, remarks_on(made, self))


def _worst(made: list[RegisteredFile]) -> Quality:
    found = {one.found.quality for one in made if one.found is not None}
    return "ruined" if "ruined" in found else "doubtful" if "doubtful" in found else "good"
