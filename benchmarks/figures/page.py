"""Photographs the page of docs/tutorial.md, which `dynmesh view` writes, in Chromium.

    python -m benchmarks.figures.page [--out docs/figures/page.png]

The sequences are those of the tutorial. Needs the extra `view`, playwright, and Chromium, which
DYNMESH_CHROMIUM may name.
"""

import argparse
import io
import os
import shutil
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image
from playwright.sync_api import sync_playwright

import dynmesh
from dynmesh import view

from ..harness import DOCS

WIDTH, HEIGHT = 1200, 560
FRAME = 60  # a multiple of 2, as the page shows every second
WITHOUT_A_GRAPHICS_CARD = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


def write_page(folder: Path) -> Path:
    """Completes the walker as the tutorial does, and writes its page."""
    walker = dynmesh.synth.walker()
    n_frames, n_vertices, _ = walker.vertices.shape
    masks = dynmesh.degrade.patch_known(walker.faces, n_frames, n_vertices, 0.3)
    partial = replace(walker, known=np.stack(list(masks)))
    for name, sequence in (("walker", walker), ("partial", partial)):
        dynmesh.write(folder / f"{name}.npz", sequence)
    completed = folder / "completed.npz"
    dynmesh.complete_file(folder / "partial.npz", completed, method="detail", provenance=True)
    with (
        dynmesh.open(completed) as reader,
        dynmesh.open(folder / "walker.npz") as reference,
        dynmesh.open(folder / "partial.npz") as input,
    ):
        view(reader, folder / "page.html", reference=reference, input=input)
    return folder / "page.html"


def photograph(page: Path) -> Image.Image:
    """Opens a page, stops it at one frame and takes its picture."""
    chromium = os.environ.get("DYNMESH_CHROMIUM") or shutil.which("chromium")
    with sync_playwright() as driver:
        browser = driver.chromium.launch(
            executable_path=chromium, args=["--no-sandbox", *WITHOUT_A_GRAPHICS_CARD]
        )
        tab = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        tab.goto(page.as_uri())
        tab.wait_for_selector("#dynmesh-counter:not(:empty)")
        tab.fill("#dynmesh-frame", str(FRAME // 2))
        tab.locator("#dynmesh-frame").blur()
        tab.wait_for_timeout(3000)  # until it is drawn
        shot = tab.screenshot()
        browser.close()
    return Image.open(io.BytesIO(shot)).convert("RGB")


def main() -> None:
    """Writes the picture."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--out", type=Path, default=DOCS / "figures" / "page.png")
    out = parser.parse_args().out
    with tempfile.TemporaryDirectory() as folder:
        image = photograph(write_page(Path(folder)))
    image.quantize(256, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(
        out, optimize=True
    )


if __name__ == "__main__":
    main()
