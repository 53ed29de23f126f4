"""One frame of a sequence in memory, in a plotter of PyVista."""

from typing import TYPE_CHECKING, Any, Literal, cast, get_args

import numpy as np

from .._checks import check_finite, frame_index
from .._errors import InputError, KindError
from ..files.memory import SequenceReader
from ..sequence import Sequence
from . import figures
from .figures import View
from .heatmap import Heatmap, likely_up, stated_up, whole_faces
from .quantities import Colour

if TYPE_CHECKING:
    import pyvista

_ROOM_FOR_THE_BAR = 0.2  # of the width of the picture


def plot(
    sequence: Sequence,
    frame: int | np.integer[Any] = 0,
    *,
    colour: Colour | None = None,
    reference: Sequence | None = None,
    up: Literal["x", "y", "z"] | None = None,
    azimuth: float = 60.0,
    off_screen: bool | None = None,
) -> "pyvista.Plotter":
    """Draws one frame of a sequence with PyVista, which the extra `view` installs.

    Triangles with a missing vertex are left out; remaining vertices without a triangle become
    dots.

    Args:
        sequence: the sequence.
        frame: the number of the frame; negative numbers count from the end.
        colour: what the colour of a vertex shows. None chooses the error if there is a reference,
            otherwise the generation or the known mask if the sequence has them, otherwise nothing.
        reference: the true sequence, for errors, with the same faces and number of frames.
        up: the up axis; None means `up_axis`, of the sequence or the reference, or if that is
            unknown, z for a flat sheet and otherwise y.
        azimuth: the viewing angle around the up axis, in degrees.
        off_screen: True to draw without a window; None leaves the choice to PyVista, which opens
            none in a notebook.

    Returns:
        A plotter to which you can add more. Its method ``show`` opens a window, or shows the
        picture in a notebook; ``screenshot`` writes or returns the picture if `off_screen` is True.

    Raises:
        ImportError: pyvista is not installed.
        IndexError: there is no such frame.
        TypeError, ValueError: the sequence does not hold what `colour` requires, does not match the
            reference, no vertex of the frame is known, or an argument is not valid.
    """
    if not isinstance(sequence, Sequence):
        raise KindError(f"must be a Sequence, not {type(sequence).__name__}", argument="sequence")
    number = frame_index(frame, len(sequence))
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
    library = figures.load_pyvista()
    truth = None if reference is None else SequenceReader(reference, "reference")
    own = SequenceReader(sequence)
    heatmap = Heatmap(own, reference=truth, colour=colour)
    shown = heatmap.frame(number)
    visible = shown.visible
    if not visible.any():
        raise InputError("no vertex of it is known", argument="frame", frame=number)
    scale = heatmap.scale(heatmap.colour)
    places, colours = heatmap.places(shown, scale)
    faces, alone = whole_faces(sequence.faces, visible)
    points = np.where(visible[:, None], shown.points, 0)
    surface = figures.surface_of(faces, points)
    plotter = library.Plotter(off_screen=off_screen, lighting="light kit")
    plotter.set_background("white")
    width, height = plotter.window_size
    labels = {} if scale is None else {tick.position: tick.label for tick in scale.ticks}
    figures.add_places(plotter, surface, places, colours, alone, labels)
    if scale is not None:
        # A title of the bar itself would be cut off at the edge of the picture.
        plotter.add_text(scale.title, position="upper_right", font_size=10, color="black")
        bar = {"position_x": 0.9, "position_y": 0.05, "height": 0.45, "width": 0.05}
        plotter.add_scalar_bar(title="", n_labels=0, vertical=True, color="black", **bar)
        width = round(width * (1 - _ROOM_FOR_THE_BAR))
        plotter.camera.SetWindowCenter(_ROOM_FOR_THE_BAR, 0)  # to the left
    upward = up or likely_up(sequence.vertices[0], stated_up(own, truth))
    figures.aim(plotter, View.of(points[visible], upward, azimuth, (width, height)))
    return cast("pyvista.Plotter", plotter)
