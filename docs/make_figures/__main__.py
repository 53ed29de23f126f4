"""Makes the pictures of docs/method.md and docs/gallery.md, from the built-in sequences alone.

    python docs/make_figures [--page PAGE] [--out FOLDER] [--draft]

writes FOLDER/PAGE/*.png for PAGE method and gallery, or for one of them; FOLDER is docs/figures
unless it is given. Needs the extra `reproduce`; without libigl, one figure of page method is left
out. Takes about a minute; a draft takes seconds, as it shows a small sheet in place of both
sequences.
"""

import argparse
import sys
from pathlib import Path

import gallery
import method
import shape
from completion import completed_by_loss

import dynmesh
from dynmesh.draw.figures import View
from dynmesh.study.subjects import Subject

PAGES = ("method", "gallery")


def draw_method(walker: Subject, ocean: Subject, out: Path) -> None:
    """The figures of docs/method.md."""
    method.draw_generations(out)
    method.draw_two_readings([walker, ocean], out)
    method.draw_drift([walker, ocean], out)
    try:
        shape.draw_hidden_side(walker, 104, 200, out)
    except ImportError as error:
        print(f"hidden_side.png is left out: {error}", file=sys.stderr)


def draw_gallery(walker: Subject, ocean: Subject, out: Path) -> None:
    """The pictures of docs/gallery.md."""
    for subject in (walker, ocean):
        view = View.of(subject.vertices[110], "z", 230)
        by_loss = completed_by_loss(subject, 110)
        gallery.draw_losses(subject, 110, by_loss, view, out)
        if subject is walker:
            gallery.draw_generations_and_ages(subject, 110, by_loss, view, out)
    gallery.draw_strip(walker, [20, 55, 90, 125, 160], 40, out)
    gallery.draw_readings(walker, [15, 30], 40, out)


def main() -> None:
    """Makes the pictures that are asked for."""
    parser = argparse.ArgumentParser(description="Makes the pictures of two pages in docs.")
    parser.add_argument("--page", choices=PAGES, help="of which; without it, of both")
    parser.add_argument("--out", type=Path, default=Path(__file__).parents[1] / "figures")
    parser.add_argument("--draft", action="store_true", help="show a small sheet instead")
    arguments = parser.parse_args()
    if arguments.draft:
        figure = sea = dynmesh.synth.ocean(175, grid=16)
    else:
        figure, sea = dynmesh.synth.walker(), dynmesh.synth.ocean(175)
    walker = Subject.of("walker", figure, "z", 20, None)
    ocean = Subject.of("ocean", sea, "z", 60, None)
    for page, draw in zip(PAGES, (draw_method, draw_gallery), strict=True):
        if arguments.page in (None, page):
            draw(walker, ocean, arguments.out / page)


if __name__ == "__main__":
    main()
