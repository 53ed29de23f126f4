"""What can be asked of tracking, said once, as in `completion_options.py`."""

from dataclasses import MISSING, dataclass, replace
from pathlib import Path
from typing import Literal, Required, Self, TypedDict

from .._checks import check_integer, check_path
from .._errors import InputError, KindError
from ..files import PathLike
from ..files.format import Gaps
from ..scans import ScanReader, open_scans
from .option import (
    FILES,
    HOW,
    OUTPUT,
    OUTPUT_FORMAT,
    ROOM,
    SOURCE,
    TRAINING,
    TrainingFiles,
    given,
    offered,
    paths_of,
)
from .room import Crop, Room, crop_of
from .scan_options import ScanOptions

Align = Literal["auto", "never"]
"""Whether a template that does not lie in the first scan is moved there."""


@dataclass(frozen=True, kw_only=True)
class TrackingOptions(ScanOptions):
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
    gaps: Gaps = offered(SOURCE["gaps"])
    crop: Crop | None = given(
        None,
        "Leave out points farther than this from the box of the mesh in the last frame, or outside "
        "the box X,Y,Z,X,Y,Z, in the unit of the template.",
        ROOM,
        metavar="DISTANCE|BOX",
        parse=crop_of,
    )
    remove_planes: bool = given(
        False,
        "Leave out floor and walls: planes in the first scan that are larger than the template.",
        ROOM,
        bool,
    )
    align: Align = "auto"
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
        check_path("template", self.template)
        for name in ("cameras", "report", "landmarks"):
            if getattr(self, name) is not None:
                check_path(name, getattr(self, name))
        if self.align not in ("auto", "never"):
            raise InputError(f"must be 'auto' or 'never', not {self.align!r}", argument="align")
        check_integer("threads", self.threads, 1)
        for name in ("uncertainty", "recover", "remove_planes"):
            value = getattr(self, name)
            if not isinstance(value, bool):
                raise KindError(f"must be True or False, not {value!r}", argument=name)
        return replace(self, crop=crop_of(self.crop), training=paths_of(self.training) or None)

    @property
    def room(self) -> Room:
        """What is taken away from the scans."""
        return Room(self.crop, self.remove_planes)

    def open(self, scans: PathLike) -> ScanReader:
        """Opens those of the scans that are asked for."""
        return open_scans(scans, cameras=self.cameras, gaps=self.gaps)


class TrackingKeywords(TypedDict, total=False):
    """The types of :class:`TrackingOptions` as keywords, for editors and type checkers."""

    template: Required[PathLike]
    landmarks: PathLike | None
    cameras: PathLike | None
    scan_unit: str | float | None
    template_unit: str | float | None
    align: Align
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
