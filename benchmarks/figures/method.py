"""The picture of generations in docs/method.md."""

from pathlib import Path

import numpy as np

from dynmesh import Completer, synth

from ..style import new_figure, save


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
        save(figure, folder / "method" / "generations.png", is_chart=True)
