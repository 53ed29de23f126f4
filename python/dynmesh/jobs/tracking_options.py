"""What can be asked of tracking, said once, as in `completion_options.py`."""

from dataclasses import MISSING, dataclass, replace
from pathlib import Path
from typing import Any, Literal, Required, Self, TypedDict

from .._checks import check_integer, check_path
from .._errors import InputError, KindError
from ..files import PathLike
from ..files.format import Gaps
from .option import (
    FILES,
    HOW,
    OUTPUT,
    OUTPUT_FORMAT,
    SOURCE,
    TRAINING,
    TrainingFiles,
    given,
    offered,
    paths_of,
    unit_of,
)

Align = Literal["auto", "never"]
"""Whether a template that does not lie in the first scan is moved there."""

_UNIT = "m, cm, mm, or a number of metres"


@dataclass(frozen=True, kw_only=True)
class TrackingOptions:
    """What can be asked of tracking; :func:`dynmesh.track_file` explains the options."""

    template: PathLike = given(
        MISSING, "The mesh, in about the pose of the first scan.", FILES, Path, metavar="FILE"
    )
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
        f"Unit of length of SCANS: {_UNIT}. [as their files state, else as the mesh]",
        FILES,
        metavar="UNIT",
        parse=unit_of,
    )
    template_unit: str | float | None = given(
        None,
        f"Unit of length of the template: {_UNIT}. [as its file states]",
        FILES,
        metavar="UNIT",
        parse=unit_of,
    )
    gaps: Gaps = offered(SOURCE["gaps"])
    align: Align = "auto"
    training: TrainingFiles | None = offered(TRAINING)
    uncertainty: bool = given(
        False,
        "Compute the standard error of the distance of each vertex from the true surface, in "
        "the unit of OUT; --provenance writes it.",
        HOW,
        bool,
    )
    threads: int = given(1, "Number of threads.", HOW, int, metavar="N", least=1)
    provenance: bool = given(
        False,
        "Also write how far each vertex is from one that was seen (generation) and the frames "
        "since it was last seen (age); with --uncertainty, its standard error.",
        OUTPUT,
        bool,
    )
    output_format: str | None = offered(OUTPUT_FORMAT)
    fps: float | None = given(
        None, "Frames per second of OUT. [not stated]", OUTPUT, float, metavar="RATE"
    )

    def checked(self) -> Self:
        """Returns the options with the training files as paths.

        Raises:
            TypeError, ValueError: an option is refused.
        """
        check_path("template", self.template)
        if self.align not in ("auto", "never"):
            raise InputError(f"must be 'auto' or 'never', not {self.align!r}", argument="align")
        check_integer("threads", self.threads, 1)
        if not isinstance(self.uncertainty, bool):
            raise KindError(
                f"must be True or False, not {self.uncertainty!r}", argument="uncertainty"
            )
        return replace(self, training=paths_of(self.training) or None)

    def described(self) -> dict[str, Any]:
        """What a checkpoint remembers of them, besides files and units."""
        return {"gaps": self.gaps, "align": self.align, "uncertainty": self.uncertainty}


class TrackingKeywords(TypedDict, total=False):
    """The types of :class:`TrackingOptions` as keywords, for editors and type checkers."""

    template: Required[PathLike]
    cameras: PathLike | None
    scan_unit: str | float | None
    template_unit: str | float | None
    align: Align
    gaps: Gaps
    output_format: str | None
    fps: float | None
    provenance: bool
    training: TrainingFiles | None
    uncertainty: bool
    threads: int
