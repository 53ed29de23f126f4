"""What can be asked of tracking, said once, as in `completion_options.py`."""

from dataclasses import MISSING, dataclass, replace
from pathlib import Path
from typing import Literal, Required, Self, TypedDict

from .._checks import check_integer, check_path
from .._errors import InputError, KindError
from ..diagnosis.rig_reading import Turns
from ..files import PathLike
from ..files.format import Gaps
from ..files.scans import ScanReader, open_scans
from ..files.scans.cameras import Matrices
from ..files.scans.corrections import Axes, Poses
from .option import (
    FILES,
    HOW,
    OUTPUT,
    OUTPUT_FORMAT,
    TRAINING,
    TrainingFiles,
    given,
    offered,
    paths_of,
)
from .rig_options import RigOptions
from .room import Crop

Align = Literal["auto", "never"]
"""Whether a template that does not lie in the first scan is moved there."""


@dataclass(frozen=True, kw_only=True)
class TrackingOptions(RigOptions):
    """What can be asked of tracking; :func:`dynmesh.track_file` explains the options."""

    template: PathLike = given(
        MISSING, "The mesh, best in the pose of the first scan.", FILES, Path, metavar="FILE"
    )
    landmarks: PathLike | None = given(
        None,
        "Landmarks of a template in another pose than the first scan, a JSON file as dynmesh "
        "register takes it.",
        FILES,
        Path,
        metavar="FILE",
    )
    align: Align = "auto"
    check: bool = True
    recover: bool = given(
        True,
        "Register the mesh anew with a scan in which it is lost, at most once in ten frames.",
        HOW,
        bool,
    )
    training: TrainingFiles | None = offered(TRAINING)
    uncertainty: bool = given(
        False,
        "Compute the standard error of the distance of each vertex from the true surface, in "
        "the unit of OUT; --provenance writes it.",
        HOW,
        bool,
    )
    threads: int = given(1, "Number of threads.", HOW, int, metavar="N", least=1)
    report: PathLike | None = given(
        None,
        "Also write how well each frame fits, and what each camera measured of it, as CSV.",
        OUTPUT,
        Path,
        metavar="FILE.csv",
    )
    provenance: bool = given(
        False,
        "Also write how far each vertex is from one that was seen (generation) and the frames "
        "since it was last seen (age); with --uncertainty, its standard error.",
        OUTPUT,
        bool,
    )
    output_format: str | None = offered(OUTPUT_FORMAT)

    def checked(self) -> Self:
        """Returns the options with the training files as paths.

        Raises:
            TypeError, ValueError: an option is refused.
        """
        checked = super().checked()
        check_path("template", self.template)
        for name in ("report", "landmarks"):
            if getattr(self, name) is not None:
                check_path(name, getattr(self, name))
        if self.align not in ("auto", "never"):
            raise InputError(f"must be 'auto' or 'never', not {self.align!r}", argument="align")
        check_integer("threads", self.threads, 1)
        for name in ("uncertainty", "check", "recover"):
            value = getattr(self, name)
            if not isinstance(value, bool):
                raise KindError(f"must be True or False, not {value!r}", argument=name)
        return replace(checked, training=paths_of(self.training) or None)

    def open(self, scans: PathLike) -> ScanReader:
        """Opens those of the scans that are asked for."""
        return open_scans(
            scans,
            cameras=self.cameras,
            gaps=self.gaps,
            corrections=self.corrections,
        )


class TrackingKeywords(TypedDict, total=False):
    """The types of :class:`TrackingOptions` as keywords, for editors and type checkers."""

    template: Required[PathLike]
    landmarks: PathLike | None
    cameras: PathLike | None
    scan_unit: str | float | None
    template_unit: str | float | None
    poses: Poses
    axes: Axes
    matrices: Matrices
    swap_cameras: tuple[str, str] | None
    depth_scale: float | None
    intrinsics_size: tuple[int, int] | None
    turn_template: Turns | None
    align: Align
    check: bool
    recover: bool
    gaps: Gaps
    crop: Crop | None
    remove_planes: bool
    output_format: str | None
    report: PathLike | None
    provenance: bool
    training: TrainingFiles | None
    uncertainty: bool
    threads: int
