"""What can be asked of registration, said once, as in `completion_options.py`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypedDict

from .._checks import check_integer, check_path
from .._errors import KindError
from ..files import PathLike
from .option import FILES, HOW, OUTPUT, given


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
        False, "The template may be in another unit, a power of ten of that of SCAN.", HOW, bool
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
        for name in ("align", "scale"):
            value: Any = getattr(self, name)
            if not isinstance(value, bool):
                raise KindError(f"must be True or False, not {value!r}", argument=name)
        check_integer("threads", self.threads, 1)


class RegisterKeywords(TypedDict, total=False):
    """The types of :class:`RegisterOptions` as keywords, for editors and type checkers."""

    landmarks: PathLike | None
    cameras: PathLike | None
    align: bool
    scale: bool
    threads: int
    report: PathLike | None
    page: PathLike | None
