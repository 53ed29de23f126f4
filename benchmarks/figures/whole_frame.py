"""The picture of a whole frame in docs/method.md, put together from frames with patches missing."""

from pathlib import Path

import numpy as np

import dynmesh

from ..runner import vertex_error
from ..subjects import Subject
from .completions import Picture, view_of
from .strip import Panel, draw_observed, draw_surface, save

PICTURE = Picture("method/whole_frame.png", [25], 0, (), (460, 616))
_FRAMES = 50
_OTHER = 12  # frames away


def draw(picture: Picture, subject: Subject, folder: Path) -> None:
    """Puts a whole frame together, and draws what two frames saw, the result and its error."""
    (shown,) = picture.frames
    n = min(_FRAMES, subject.n_frames)
    vertices = subject.vertices[:n]
    masks = dynmesh.degrade.patch_known(subject.faces, n + 1, subject.n_vertices, 0.4, lifetime=10)
    known = np.array(list(masks))[1:]
    shown = min(shown, n - 1)
    whole = dynmesh.whole_frame(subject.faces, vertices, known, frame=shown)
    error = vertex_error(subject, shown, whole.positions)
    view = view_of(picture, subject)
    panels = []
    for number in (max(shown - _OTHER, 0), shown):
        around = view.around(vertices[number])
        panels.append(
            Panel(
                f"frame {number}",
                f"{100 * known[number].mean():.0f} % of the vertices",
                [draw_observed(subject.faces, vertices[number], known[number], around)],
            )
        )
    view = view.around(vertices[shown])
    put_together = draw_surface(subject.faces, whole.positions, view, error)
    truth = draw_surface(subject.faces, vertices[shown], view)
    panels += [
        Panel(f"frame {shown}, put together", f"from {n} frames; error in colour", [put_together]),
        Panel("truth", "", [truth]),
    ]
    save(panels, folder / picture.file)
