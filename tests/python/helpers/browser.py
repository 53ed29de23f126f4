"""Pages that dynmesh writes, opened in a browser."""

import io
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import Array

from dynmesh import Sequence, view, write
from dynmesh import open as open_sequence

IS_DRAWN = """() => {
  const [panes, frame, colour] = ["panes", "frame", "colour"].map(
    (name) => document.getElementById(`dynmesh-${name}`)
  );
  return panes.dataset.drawn === `${frame.value} ${colour.value}`;
}"""


NEXT_FRAMES = """async () => {
  for (let i = 0; i < 5; ++i) await new Promise(requestAnimationFrame);
}"""


class Page:
    """A page in a browser, with its requests and error messages."""

    def __init__(
        self, browser: Any, path: Path, made: str = "#dynmesh-counter:not(:empty)"
    ) -> None:
        """Waits until something is on the page that scripts have made."""
        self.page = browser.new_page()
        self.has_clocks = True
        self.requests: list[str] = []
        self.complaints: list[str] = []
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on(
            "console",
            lambda said: self.complaints.append(said.text) if said.type == "error" else None,
        )
        self.page.goto(path.as_uri())
        self.page.wait_for_selector(made, state="attached")

    def text(self, name: str) -> str:
        """Returns the visible text of a part of the page."""
        return str(self.page.inner_text(f"#dynmesh-{name}"))

    def press(self, *keys: str) -> None:
        for key in keys:
            self.page.keyboard.press(key)

    def choose(self, name: str, value: str) -> None:
        self.page.select_option(f"#dynmesh-{name}", value)

    def scrub(self, to: int) -> None:
        """Moves the slider like a user."""
        self.page.fill("#dynmesh-frame", str(to))

    def stop_clocks(self) -> None:
        """From now on, time passes only by `page.clock.run_for`, however slow the machine is."""
        self.page.clock.install()
        self.page.clock.pause_at(self.page.evaluate("Date.now() / 1000 + 60"))
        self.has_clocks = False

    def visible(self, name: str) -> bool:
        return bool(self.page.is_visible(f"#dynmesh-{name}"))

    def captions(self) -> list[str]:
        return [str(text) for text in self.page.locator(".dynmesh-caption").all_inner_texts()]

    def drag(self, pane: int, right: int, down: int, button: str = "left") -> None:
        """Drags with the mouse from the middle of a pane."""
        box = self.page.locator(".dynmesh-canvas").nth(pane).bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        self.page.mouse.move(x, y)
        self.page.mouse.down(button=button)
        self.page.mouse.move(x + right, y + down, steps=4)
        self.page.mouse.up(button=button)

    def picture(self, pane: int = 0) -> Array:
        """Returns the pixels of a pane, (height, width, 3)."""
        return self.pictures(pane)[0]

    def pictures(self, *panes: int) -> list[Array]:
        """Returns the pixels of several panes at the same time."""
        self.page.wait_for_function(IS_DRAWN)
        if self.has_clocks:
            self.page.evaluate(NEXT_FRAMES)  # a turn of the camera is not part of what is drawn
        images = pytest.importorskip("PIL.Image")
        pixels = []
        for pane in panes:
            shot = self.page.locator(".dynmesh-canvas").nth(pane).screenshot()
            with images.open(io.BytesIO(shot)) as image:
                pixels.append(np.asarray(image.convert("RGB")).astype(int))
        return pixels


def in_colour(picture: Array) -> Array:
    """Which pixels are not white."""
    return np.asarray((picture < 240).any(axis=2))


def reddish(image: Array) -> Array:
    """Which pixels are red, shaded or not."""
    return np.asarray(image[..., 0] > image[..., 2] + 60)


def bluish(image: Array) -> Array:
    """Which pixels are blue, shaded or not."""
    return np.asarray(image[..., 2] > image[..., 0] + 60)


def middle(mask: Array) -> float:
    """Returns the mean column of marked pixels."""
    return float(np.nonzero(mask)[1].mean())


def page_of(
    sequence: Sequence,
    folder: Path,
    browser: Any,
    beside: dict[str, Sequence] | None = None,
    **options: Any,
) -> Page:
    """Writes a sequence, those beside it by their names, and the page, and opens the page."""
    with ExitStack() as stack:
        for name, other in (beside or {}).items():
            write(folder / f"{name}.npz", other)
            options[name] = stack.enter_context(open_sequence(folder / f"{name}.npz"))
        write(folder / "sheet.npz", sequence)
        reader = stack.enter_context(open_sequence(folder / "sheet.npz"))
        view(reader, up="z", azimuth=-90, **options).write(folder / "page.html")
    return Page(browser, folder / "page.html")
