"""What commands write from the reports of verbs, beside or instead of frames."""

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from .._checks import path_of
from .._options import Output
from .._report import Report
from ..draw.page import Page, require_page
from ..formats import PathLike
from ..formats.output import check_output, new_output
from ..scans import write_cameras


@dataclass(frozen=True, kw_only=True)
class Drawn(Report):
    """A picture that was written; Python gets the picture itself."""

    output: Path


class Beside(NamedTuple):
    """A file that a command can write from the report of a verb.

    Attributes:
        key: the name of the option.
        suffix: that the path must have.
        help: says what it is.
        fill: writes a report to a path, and returns what the command reports.
        is_needed: whether the command cannot do without.
        is_ours: whether an existing file is replaced anyway, as it is of an earlier run.
    """

    key: str
    suffix: str
    help: str
    fill: Callable[[Any, Path, bool], Report]
    is_needed: bool = False
    is_ours: Callable[[Path], bool] = lambda _: False

    @property
    def parameter(self) -> inspect.Parameter:
        """The parameter of the command."""
        default = inspect.Parameter.empty if self.is_needed else None
        kind, hint = inspect.Parameter.KEYWORD_ONLY, Annotated[PathLike | None, "output"]
        return inspect.Parameter(self.key, kind, default=default, annotation=hint)


def overwrite(*, overwrite: Output[bool] = False) -> None:
    """Declares the option of commands that write no frames.

    Args:
        overwrite: whether to replace existing files.
    """


def _table(report: Any, path: Path, overwrite: bool) -> Report:
    with new_output(path, overwrite, ".csv") as hidden:
        report.write_csv(hidden)
    result: Report = report
    return result


def _page(report: Any, path: Path, overwrite: bool) -> Report:
    with new_output(path, overwrite, ".html") as hidden:
        report.page(hidden)
    result: Report = report
    return replace(result, remarks=(*result.remarks, f"open {path} in a browser"))


def _itself(page: Page, path: Path, overwrite: bool) -> Report:
    with new_output(path, overwrite, ".html") as hidden:
        page.write(hidden)
    return replace(page, output=path)


def _picture(image: Any, path: Path, overwrite: bool) -> Report:
    with new_output(path, overwrite, ".png") as hidden:
        image.save(hidden)
    pixels = "{} x {} pixels".format(*image.size)
    return Drawn(output=path, remarks=(pixels, *image.info.get("remarks", ())))


def _cameras(report: Any, path: Path, overwrite: bool) -> Report:
    result: Report = report
    if report.rig is None:
        message = f"{path} is not written, as no correction is known"
        return replace(result, remarks=(*result.remarks, message))
    files = [] if report.rig.file is None else [report.rig.file]
    with new_output(path, overwrite, ".json", inputs=files) as hidden:
        write_cameras(hidden, report.rig)
    changed: Report = replace(report, output=path)
    return changed


_OF_SCAN = "a page to write with the scan and the result, coloured by the distance of points."
_OF_RIG = "a page to write that shows the cameras, what they see, and the template."


def _is_of_batch(path: Path) -> bool:
    """Whether a file is a table that a batch has written."""
    if not path.is_file():
        return False
    with path.open(encoding="utf-8", errors="replace") as file:
        return file.readline().startswith(_FIRST_OF_BATCH)


_FIRST_OF_BATCH = "input,output,status,quality,"
_OF_BATCH = "a table to write with the quality of each job; one of an earlier run is replaced."

BESIDE: dict[str, list[Beside]] = {
    "track": [
        Beside("csv", ".csv", "a table to write, with a row for each frame with points.", _table)
    ],
    "registered": [Beside("page", ".html", _OF_SCAN, _page)],
    "evaluate": [Beside("csv", ".csv", "a table to write, with a row for each frame.", _table)],
    "view": [Beside("out", ".html", "the HTML file to write.", _itself, is_needed=True)],
    "picture": [Beside("out", ".png", "the PNG file to write.", _picture, is_needed=True)],
    "batch": [Beside("csv", ".csv", _OF_BATCH, _table, is_ours=_is_of_batch)],
    "rig": [
        Beside("output", ".json", "a file to write with the corrected cameras.", _cameras),
        Beside("page", ".html", _OF_RIG, _page),
    ],
}
"""By the name of the verb."""


def checked(verb: str, values: Mapping[str, Any], overwrite: bool) -> list[tuple[Beside, Path]]:
    """What is to be written, which is refused before any work begins if it cannot be."""
    wanted = []
    for one in BESIDE.get(verb, []):
        if values.get(one.key) is not None:
            path = path_of(one.key, values[one.key])
            check_output(path, overwrite or one.is_ours(path), one.suffix)
            if one.fill is _page:
                require_page(scans=verb == "registered")
            wanted.append((one, path))
    return wanted


def filled(report: Any, wanted: list[tuple[Beside, Path]], overwrite: bool) -> Any:
    """Writes the files; returns what the command reports."""
    for one, path in wanted:
        report = one.fill(report, path, overwrite or one.is_ours(path))
    return report
