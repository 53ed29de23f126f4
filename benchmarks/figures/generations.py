"""The picture of docs/method.md that shows generations."""

from pathlib import Path

import numpy as np

from dynmesh import Completer, synth

from ..style import new_figure, save


def draw(folder: Path) -> None:
    """Draw a small sheet from above: anchors, and satellites by generation."""
    sheet = synth.ocean(2, grid=14)
    known = np.random.default_rng(6).random(14 * 14) < 0.1
    completer = Completer(sheet.faces, sheet.vertices[0], method="motion")
    completer.push(sheet.vertices[1], known)
    x, y = np.indices((14, 14)).reshape(2, -1)
    colours = ["#0072b2", "#fdd49e", "#fc8d59", "#d7301f", "#7f0000", "#000000"]
    with new_figure(6.6, 5) as figure:
        axis = figure.subplots()
        axis.triplot(x, y, sheet.faces, color="#bbbbbb", linewidth=0.7)
        for generation in range(completer.generation.max() + 1):
            chosen = completer.generation == generation
            size, marker, label = 60, "o", f"generation {generation}"
            if generation == 0:
                size, marker, label = 110, "s", "anchor"
            axis.scatter(
                x[chosen], y[chosen], size, colours[generation], marker=marker, label=label
            )
        for dots in axis.collections:
            dots.set(edgecolor="#333333", linewidth=0.6, zorder=3)
        axis.set_aspect("equal")
        axis.set_axis_off()
        figure.legend(loc="outside right center")
        save(figure, folder / "method" / "generations.png", is_chart=True)
