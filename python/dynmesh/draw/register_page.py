"""The page of registrations: the template, each scan, and each result."""

from collections.abc import Sequence as SequenceOf
from pathlib import Path

import numpy as np

from ..files import Reader
from ..files.memory import SequenceReader
from ..registration import Registration
from ..scans import ScanReader
from ..sequence import Positions, Sequence
from .page import Page, page

_FPS = 0.5
"""Scans of a folder have nothing to do with each other, so each is shown for two seconds."""


def page_of(
    template: Reader,
    first: Positions,
    scans: ScanReader,
    found: SequenceOf[Registration],
    names: SequenceOf[str],
    output: Path,
) -> Page:
    """Makes a page with a frame for each scan, the results coloured by their distance from it.

    Args:
        template: of the template.
        first: (k, 3) its positions.
        scans: as many as there are results.
        found: the results.
        names: of the scans.
        output: the path of the results, whose name stands below them.

    Raises:
        ImportError, ValueError: see :func:`dynmesh.draw.page.page`.
    """
    results = np.stack([one.vertices for one in found])
    placed = np.stack([_placed(first, one) for one in found])
    return page(
        SequenceReader(Sequence(results, template.faces, fps=_FPS), str(output)),
        template=SequenceReader(Sequence(placed, template.faces), str(template.path)),
        scans=scans,
        colour="distance",
        title=f"{template.path.name} registered with {scans.path.name}",
        names=[f"{name}: {one.quality}" for name, one in zip(names, found, strict=True)],
        up=template.header.up_axis,
    )


def _placed(first: Positions, found: Registration) -> Positions:
    """The template in the unit of the scan and not turned, in the middle of the result."""
    scale = np.cbrt(np.linalg.det(found.transform[:3, :3]))
    moved = scale * first
    return np.asarray(moved + (_middle(found.vertices) - _middle(moved)), first.dtype)


def _middle(points: Positions) -> Positions:
    return np.asarray((points.min(axis=0) + points.max(axis=0)) / 2)
