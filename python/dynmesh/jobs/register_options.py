"""What can be asked of registration, said once, as in `completion_options.py`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypedDict

from .._checks import check_integer, check_path
from .._errors import InputError, KindError
from ..files import PathLike
from .option import FILES, HOW, OUTPUT, ROOM, given
from .room import Crop, crop_of


@dataclass(frozen=True, kw_only=True)
class RegisterOptions:
    """What can be asked of registration; :func:`dynmesh.register_file` explains the options."""

    landmarks: PathLike | None = given(
        None,
        'Landmarks, a JSON file: [{"vertex": 12, "position": [x, y, z]}, ...], with positions in '
        "the unit of SCAN; or a folder with such files, named like the scan that each is for.",
        FILES,
        Path,
        metavar="FILE|FOLDER",
    )
    cameras: PathLike | None = given(
        None,
        "Where the cameras stand. [cameras.json beside SCAN]",
        FILES,
        Path,
        metavar="FILE",
    )
    align: bool = given(True, "Find the rigid motion that puts the template there.", HOW, bool)
    scale: bool = given(
        False, "The template may have another size than what was scanned.", HOW, bool
    )
    crop: Crop | None = given(
        None,
        "Leave out points outside the box X,Y,Z,X,Y,Z, in the unit of SCAN.",
        ROOM,
        metavar="BOX",
        parse=crop_of,
    )
    remove_planes: bool = given(
        False,
        "Leave out floor and walls: planes in SCAN that are larger than the template.",
        ROOM,
        bool,
    )
    threads: int = given(1, "Number of threads.", HOW, int, metavar="N", least=1)
    report: PathLike | None = given(
        None, "Also write how well each scan fits, as JSON.", OUTPUT, Path, metavar="FILE"
    )
    page: PathLike | None = given(
        None,
        "Also write an HTML page: the template, each scan, and each result coloured by the "
        "distance from the nearest point.",
        OUTPUT,
        Path,
        metavar="FILE",
    )

    def check(self) -> None:
        """Checks the options.

        Raises:
            TypeError, ValueError: an option is refused.
        """
        for name in ("landmarks", "cameras", "report", "page"):
            if getattr(self, name) is not None:
                check_path(name, getattr(self, name))
        for name in ("align", "scale", "remove_planes"):
            value: Any = getattr(self, name)
            if not isinstance(value, bool):
                raise KindError(f"must be True or False, not {value!r}", argument=name)
        if isinstance(crop_of(self.crop), float):
            told = f"must be two corners of a box, x,y,z,x,y,z, not {self.crop!r}"
            raise InputError(told, argument="crop")
        if self.remove_planes and self.scale:
            told = "is not possible with scale, as the size of the template is not known"
            raise InputError(told, argument="remove_planes")
        check_integer("threads", self.threads, 1)


class RegisterKeywords(TypedDict, total=False):
    """The types of :class:`RegisterOptions` as keywords, for editors and type checkers."""

    landmarks: PathLike | None
    cameras: PathLike | None
    align: bool
    scale: bool
    crop: Crop | None
    remove_planes: bool
    threads: int
    report: PathLike | None
    page: PathLike | None
