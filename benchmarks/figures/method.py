"""The pictures of docs/method.md: generations, and a whole frame that is put together."""

from pathlib import Path

import numpy as np

import dynmesh
from dynmesh import Completer, synth

from ..runner import vertex_error
from ..style import new_figure
from ..style import save as save_chart
from ..subjects import Subject
from .completions import Picture, view_of
from .strip import Panel, draw_observed, draw_surface, save


def draw_generations(folder: Path) -> None:
    """Draw a small sheet from above: anchors, and satellites by generation."""
    sheet = synth.ocean(2, grid=14)
    known = np.random.default_rng(6).random(14 * 14) < 0.1
    completer = Completer(sheet.faces, sheet.vertices[0], method="motion")
    completer.push(sheet.vertices[1], known)
    x, y = np.meshgrid(np.arange(14), np.arange(14), indexing="ij")
    colours = ["#0072b2", "#fdd49e", "#fc8d59", "#d7301f", "#7f0000", "#000000"]
    with new_figure(6.6, 5) as figure:
        axis = figure.subplots()
        axis.triplot(x.ravel(), y.ravel(), sheet.faces, color="#bbbbbb", linewidth=0.7)
        for generation in range(completer.generation.max() + 1):
            chosen = completer.generation == generation
            label = "anchor" if generation == 0 else f"generation {generation}"
            size = 110 if generation == 0 else 60
            axis.scatter(
                x.ravel()[chosen],
                y.ravel()[chosen],
                size,
                colours[generation],
                marker="s" if generation == 0 else "o",
                label=label,
                edgecolor="#333333",
                linewidth=0.6,
                zorder=3,
            )
        axis.set_aspect("equal")
        axis.set_axis_off()
        figure.legend(loc="outside right center")
        save_chart(figure, folder / "method" / "generations.png", is_chart=True)


PICTURE = Picture("method/whole_frame.png", [25], 0, (), (460, 616))
_FRAMES = 50
_OTHER = 12  # frames away


def draw_whole_frame(picture: Picture, subject: Subject, folder: Path) -> None:
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
