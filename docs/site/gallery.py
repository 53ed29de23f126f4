"""A page for each built-in subject that plays what was seen, the completed mesh, and the original.

They exist on the site alone, and only if dynmesh was built.
"""

import contextlib
import io
from typing import Any, get_args

import numpy as np
from mkdocs.structure.files import File

dynmesh: Any = None
with contextlib.suppress(ImportError):  # not built
    from PIL import Image

    import dynmesh
    from dynmesh.draw.figures import KNOWN_COLOUR, View, cropped, heatmap, render

PAGE = """# Gallery

Built-in subjects as one camera sees them, and as dynmesh completes them: grey where it is right,
dark red where it is wrong by {worst} of the size or more. Each picture opens a page that plays both
beside the truth.

<div class="gallery" markdown>

{cards}
</div>

These commands make the pages:

```console
dynmesh synth walker walker.npz
dynmesh degrade walker.npz seen.npz --camera 1
dynmesh complete seen.npz completed.npz
dynmesh view completed.npz --input seen.npz --reference walker.npz -o walker.html
```
"""
CARD = """<figure markdown>
[![What a camera sees of {words}, and its completion](gallery/{name}.webp)](gallery/{name}.html)
<figcaption>{words}: off by {error:.2g}&nbsp;% of its size on average</figcaption>
</figure>
"""
WORDS = {
    "ocean": "a sea",
    "walker": "a walking figure",
    "bust": "a bust that speaks",
    "hand": "a hand that counts",
    "cloth": "a cloth that falls over a ball",
    "beetle": "a beetle of 31 rigid parts",
    "heart": "a heart that beats beside a lung",
}
FRAMES = 60
SHOWN = 40  # the frame of the pictures
WORST = 0.05  # of the bounding box's diagonal; the smallest error with a colour is a fiftieth of it


def on_files(files: Any, config: Any) -> Any:
    """Adds the pages and the pictures, and the page that leads to them."""
    cards = ""
    for name in get_args(dynmesh.synth.Name) if dynmesh else ():
        page, picture, error = play(name)
        files.append(File.generated(config, f"gallery/{name}.html", content=page))
        files.append(File.generated(config, f"gallery/{name}.webp", content=picture))
        cards += CARD.format(name=name, words=WORDS[name], error=100 * error) + "\n"
    text = PAGE.format(cards=cards, worst=f"{100 * WORST:g} %")
    files.append(File.generated(config, "gallery.md", content=text))
    return files


def play(name: str) -> tuple[str, bytes, float]:
    """The page of a subject, its picture, and the mean error in diagonals."""
    truth = getattr(dynmesh.synth, name)()[:FRAMES]
    seen = dynmesh.read(dynmesh.degrade(truth, camera=1))
    completed = dynmesh.read(dynmesh.complete(seen))
    page = dynmesh.view(completed, input=seen, reference=truth, title=WORDS[name].capitalize())
    error = dynmesh.evaluate(completed, truth)
    return page.html, picture(seen, completed, truth, error.bounding_box_diagonal), error.mean


def picture(seen: Any, completed: Any, truth: Any, diagonal: float) -> bytes:
    """What was seen in a frame beside its completion, without a ground."""
    points, faces = completed.vertices[SHOWN], completed.faces
    view = View.of(points, truth.up_axis or "z", 60)
    view = View(view.axes, view.box, view.up, (1440, 1440))
    whole = faces[seen.known[SHOWN][faces].all(axis=1)]
    off = np.linalg.norm(points - truth.vertices[SHOWN], axis=1) / diagonal
    places = np.clip(1 + np.log(np.maximum(off, 1e-12) / WORST) / np.log(50), 0, 1)
    dark = np.zeros(len(points))
    drawn = np.concatenate(
        cropped(
            [
                render(whole, truth.vertices[SHOWN], view, dark, (KNOWN_COLOUR,)),
                render(faces, points, view, places, heatmap(256)),
            ]
        ),
        axis=1,
    )
    seen_through = (drawn > 250).all(axis=2)
    for _ in range(2):  # on dark pages, an edge that is blended with white would be a halo
        shifted = [np.roll(seen_through, way, axis) for way in (-1, 1) for axis in (0, 1)]
        seen_through = np.any([seen_through, *shifted], axis=0)
    alpha = np.where(seen_through, 0, 255).astype(np.uint8)
    image = Image.fromarray(np.dstack([drawn, alpha]))
    image.thumbnail((720, 480))
    image.save(file := io.BytesIO(), "webp")
    return file.getvalue()
