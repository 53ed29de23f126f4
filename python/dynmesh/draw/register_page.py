"""The page of a registration: the template, the scan, and the result."""

from pathlib import Path

import numpy as np

from ..files import Reader
from ..files.memory import SequenceReader
from ..registration import Registration
from ..scans import ScanReader
from ..sequence import Positions, Sequence
from .page import Page, page


def page_of(
    template: Reader, first: Positions, scan: ScanReader, found: Registration, output: Path
) -> Page:
    """Makes a page with the result, coloured by its distance from the scan.

    Args:
        template: of the template.
        first: (k, 3) its positions.
        scan: one frame.
        found: the result.
        output: the path of the result, whose name stands below it.

    Raises:
        ImportError, ValueError: see :func:`dynmesh.draw.page.page`.
    """
    placed = _placed(first, found)[None]
    return page(
        SequenceReader(Sequence(found.vertices[None], template.faces), str(output)),
        template=SequenceReader(Sequence(placed, template.faces), str(template.path)),
        scans=scan,
        colour="distance",
        title=f"{template.path.name} registered with {scan.path.name}: {found.quality}",
        up=template.header.up_axis,
    )


def _placed(first: Positions, found: Registration) -> Positions:
    """The template in the unit of the scan and not turned, in the middle of the result."""
    scale = np.cbrt(np.linalg.det(found.transform[:3, :3]))
    moved = scale * first
    return np.asarray(moved + (_middle(found.vertices) - _middle(moved)), first.dtype)


def _middle(points: Positions) -> Positions:
    return np.asarray((points.min(axis=0) + points.max(axis=0)) / 2)
