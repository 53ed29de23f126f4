"""One frame of a sequence in memory, in a plotter of PyVista."""

from typing import Any, get_args

import numpy as np

from .._checks import check_finite
from .._errors import InputError, KindError
from ..files.memory import SequenceReader
from ..sequence import Sequence
from . import figures
from .figures import SURFACE_COLOUR, View
from .heatmap import Heatmap, likely_up, stated_up, whole_faces
from .quantities import Colour

_ROOM_FOR_THE_BAR = 0.2  # of the width of the picture


def plot(
    sequence: Sequence,
    number: int,
    *,
    colour: Colour | None,
    reference: Sequence | None,
    up: str | None,
    azimuth: float,
    off_screen: bool | None,
) -> Any:
    """Draws a frame that exists; see :meth:`dynmesh.Sequence.plot`."""
    if not isinstance(reference, Sequence | None):
        raise KindError(f"must be a Sequence, not {type(reference).__name__}", argument="reference")
    if colour not in (None, *get_args(Colour)):
        raise InputError(
            f"must be None or one of {get_args(Colour)}, not {colour!r}", argument="colour"
        )
    if not isinstance(off_screen, bool | None):
        raise KindError(f"must be True, False or None, not {off_screen!r}", argument="off_screen")
    if reference is not None and colour not in (None, "error", "standard_error"):
        raise InputError(
            f"requires the colour error or standard_error, not {colour}", argument="reference"
        )
    check_finite("azimuth", azimuth)
    pyvista = figures.load_pyvista()
    truth = None if reference is None else SequenceReader(reference, "reference")
    own = SequenceReader(sequence)
    heatmap = Heatmap(own, reference=truth, colour=colour)
    (frame,) = heatmap.frames(range(number, number + 1))
    visible = frame.visible
    if not visible.any():
        raise InputError("no vertex of it is known", argument="frame", frame=number)
    scale, values = heatmap.scale(heatmap.colour, [frame]), frame.values.get(heatmap.colour)
    places = np.zeros(len(visible), np.float32)
    if scale is not None and values is not None:
        places[visible] = scale.position(values[visible])
    faces, alone = whole_faces(sequence.faces, visible)
    points = np.where(visible[:, None], frame.points, 0).astype(np.float32)
    surface = pyvista.PolyData.from_regular_faces(points, np.asarray(faces, np.int64))
    plotter = pyvista.Plotter(off_screen=off_screen, lighting="light kit")
    plotter.set_background("white")
    width, height = plotter.window_size
    if scale is None:
        figures.add_places(plotter, surface, places, (SURFACE_COLOUR,), alone)
    else:
        labels = {tick.position: tick.label for tick in scale.ticks}
        figures.add_places(plotter, surface, places, scale.colours, alone, labels)
        # A title of the bar itself would be cut off at the edge of the picture.
        plotter.add_text(scale.title, position="upper_right", font_size=10, color="black")
        bar = {"position_x": 0.9, "position_y": 0.05, "height": 0.45, "width": 0.05}
        plotter.add_scalar_bar(title="", n_labels=0, vertical=True, color="black", **bar)
        width = round(width * (1 - _ROOM_FOR_THE_BAR))
        plotter.camera.SetWindowCenter(_ROOM_FOR_THE_BAR, 0)  # to the left
    shown = up or likely_up(sequence.vertices[0], stated_up(own, truth))
    figures.aim(plotter, View.of(points[visible], shown, azimuth, (width, height)))
    return plotter
