"""Draws the animation of the README: holes in the built-in walker, and the completed mesh.

    python docs/make_figures/animation.py [--out docs/figures/completion.gif]

Left is what was observed, right what `method="detail"` makes of it. Needs the extra `view`.
"""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

import dynmesh
from dynmesh.draw import figures
from dynmesh.draw.figures import View

FRAMES = 175
EVERY = 3  # frames of the sequence to one of the animation
SIZE = (300, 360)
CAPTIONS = ("observed", "completed")
COLOURS = 48


def observed_faces(faces: NDArray[Any], known: NDArray[np.bool_]) -> NDArray[Any]:
    """The triangles of which all three vertices were observed."""
    return np.asarray(faces[known[faces].all(axis=1)])


def panels() -> list[NDArray[np.uint8]]:
    """Both pictures of every frame, side by side."""
    walker = dynmesh.synth.walker(FRAMES)
    faces, frames = walker.faces, walker.vertices
    masks = dynmesh.degrade.patch_known(faces, len(frames), frames.shape[1], 0.35, patches=7)
    completer = dynmesh.Completer(faces, frames[0], method="detail")
    # One scale for the whole sequence; the camera follows the figure.
    half = np.max([np.ptp(points, axis=0) / 2 for points in frames], axis=0)
    widest = replace(View.of(frames[0], "z", 40, SIZE), box=np.stack([-half, half]))
    made = []
    for number, (points, known) in enumerate(zip(frames, masks, strict=True)):
        completed = points if number == 0 else completer.push(points, known)
        if number % EVERY == 0:
            view = widest.around(points)
            left = figures.render(observed_faces(faces, known), points, view)
            made.append(np.hstack([left, figures.render(faces, completed, view)]))
    return made


def main() -> None:
    """Writes the animation."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    default = Path(__file__).parents[1] / "figures" / "completion.gif"
    parser.add_argument("--out", type=Path, default=default)
    out = parser.parse_args().out
    font = ImageFont.load_default(15)
    images = []
    for panel in figures.cropped(panels()):
        image = Image.fromarray(np.pad(panel, ((24, 0), (0, 0), (0, 0)), constant_values=255))
        draw = ImageDraw.Draw(image)
        for place, caption in zip((0.25, 0.75), CAPTIONS, strict=True):
            draw.text((place * image.width, 14), caption, "#333333", font, "mm")
        images.append(image)
    # One palette for all frames, without dithering: neighbouring frames then differ in little.
    palette = images[len(images) // 2].quantize(COLOURS)
    first, *rest = (image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images)
    first.save(out, save_all=True, append_images=rest, duration=100, loop=0, optimize=True)


if __name__ == "__main__":
    main()
