"""Pages that play sequences."""

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, Unpack

from .._checks import check_choice, check_integer, check_text, path_of
from .._errors import InputError
from .._options import Input, Method
from ..draw.heatmap import Colour
from ..draw.page import Page, page, require_page
from ..draw.page.pick import pick_page
from ..draw.scales import range_of
from ..formats import OneSequence, PathLike, Source, opened_together
from ..formats.conversion import remarks_of
from ..formats.format import Gaps
from ..header import Axis
from ..scans import ScanReader
from ..scans.memory import InMemory as ScansInMemory
from ..scans.memory import opened_scans
from ..scans.opening import BesideScans
from ..tracking.inputs import open_single


def view(
    sequence: OneSequence,
    *,
    reference: Input[OneSequence | None] = None,
    input: Input[OneSequence | None] = None,
    scans: Input[PathLike | ScansInMemory | None] = None,
    scan_unit: Input[float | str | None] = None,
    quality: Input[PathLike | None] = None,
    pick: Input[PathLike | None] = None,
    source: Source | None = None,
    colour: Method[Colour | None] = None,
    colour_range: Method[str | tuple[float, float] | None] = None,
    title: Method[str | None] = None,
    up: Method[Axis | None] = None,
    azimuth: Method[float] = 60.0,
    max_frames: Method[int] = 120,
    max_vertices: Method[int] = 20_000,
    gaps: Input[Gaps | None] = None,
    progress: bool | None = None,
    **of_scans: Unpack[BesideScans],
) -> Page:
    """Makes a page that plays a sequence in any browser, offline.

    The input and the reference play beside it. In the page, ? lists the keys.

    Args:
        sequence: the sequence.
        reference: the true sequence; colours then show the error.
        input: the sequence that was completed.
        scans: those that the sequence was tracked in; in Python, as dynmesh.track takes them.
        scan_unit: the unit of length of the scans: m, cm, mm, or a number of metres; else, as their
            files state it.
        quality: the table that tracking wrote by `csv`; a line under the slider then shows how good
            each frame is, and leads to those that are clicked.
        pick: instead, show frame 0, the template, beside the first of the scans, a file or several;
            the page pairs vertices and points that are clicked, and saves them under this name, as
            landmarks of a registration.
        source: how to read `input` if it is given, else the sequence; faces and the mesh are those
            of every file that needs them.
        colour: what colours show at first: "error", "generation", "age", "standard_error", "known",
            "mesh", which names several meshes, "distance", from the nearest point of the scans, or
            "plain"; else, the first of them that there is.
        colour_range: the range of the colours of errors and standard errors, such as 0.1:10, in the
            unit in which they are shown; else, both have that of the errors.
        title: the heading; else, the name of the file.
        up: the up axis; else, as a file states it, or a guess.
        azimuth: the viewing angle around the up axis, in degrees.
        max_frames: longer sequences show every second, third, ... frame.
        max_vertices: larger meshes are simplified to about this many vertices.
        gaps: what frames and images are whose file or pose is missing: "refuse" makes them an
            error, "lost" what was not observed; of `scans`, if there are any. Else, scans are lost,
            and frames of a sequence an error.
        progress: whether to show on standard error how far it is.
        of_scans: how the scans are read: `cameras`, `poses`, `subject` and `least_confidence` of
            :func:`dynmesh.scans.open_scans`.

    Returns:
        A page, which shows itself in a notebook; :meth:`dynmesh.draw.page.Page.write` writes it to
        a file.
    """
    check_integer("max_frames", max_frames, 1)
    check_integer("max_vertices", max_vertices, 4)
    if gaps is not None:
        check_choice("gaps", gaps, Gaps)
    if title is not None:
        check_text("title", title)
    require_page(scans=scans is not None)
    shown_range = range_of(colour_range)
    needs_scans: dict[str, Any] = {"scan_unit": scan_unit}
    needs_scans |= of_scans
    for name, value in needs_scans.items():
        if value is not None and scans is None:
            raise InputError("is that of `scans`, which are not given", argument=name)
    if pick is not None:
        others: dict[str, Any] = {"reference": reference, "input": input, "quality": quality}
        others |= {"colour": colour, "colour_range": colour_range}
        pick = path_of("pick", pick)
        _check_pick(pick, scans, {**others, "scan_unit": scan_unit})
    table = None if quality is None else path_of("quality", quality)
    with (
        _opened(scans, gaps, of_scans, is_picked=pick is not None) as measured,
        opened_together(source or {}, sequence=sequence, reference=reference, input=input) as (
            own,
            truth,
            partial,
        ),
    ):
        if pick is not None and measured is not None:
            look = azimuth, max_vertices
            result = pick_page(own, measured, pick.name, *look, title=title, up=up)
        else:
            result = page(
                own,
                reference=truth,
                input=partial,
                scans=measured,
                scan_unit=scan_unit,
                quality=table,
                colour=colour,
                colour_range=shown_range,
                title=title,
                up=up,
                azimuth=azimuth,
                max_frames=max_frames,
                max_vertices=max_vertices,
                progress=progress,
            )
        return replace(result, remarks=(*result.remarks, *remarks_of(own, truth, partial)))


@contextmanager
def _opened(
    scans: PathLike | ScansInMemory | None, gaps: Gaps | None, how: BesideScans, *, is_picked: bool
) -> Iterator[ScanReader | None]:
    if scans is None:
        yield None
        return
    if isinstance(scans, str | os.PathLike):
        path = path_of("scans", scans)
        gaps = gaps or "lost"
        if is_picked and path.is_file():
            yield open_single(path, gaps=gaps, **how)
            return
    given: Any = {} if gaps is None else {"gaps": gaps}
    with opened_scans(scans, **given, **how) as reader:
        yield reader


def _check_pick(pick: Path, scans: object, others: Mapping[str, object]) -> None:
    """Refuses what cannot be picked, or shown beside it."""
    if pick.suffix != ".json":
        raise InputError(f"must end with .json, not {pick}", argument="pick", value=pick)
    if scans is None:
        raise InputError("are needed, to pick points of the first one", argument="scans")
    for name, value in others.items():
        if value is not None:
            raise InputError("cannot be shown where landmarks are picked", argument=name)
