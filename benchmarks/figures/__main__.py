"""Makes the pictures of four pages of docs and, from recordings, of docs/how_it_works.md.

    python -m benchmarks.figures [--page PAGE] [--data FOLDER] [--out FOLDER] [--draft]

writes OUT/PAGE/* for PAGE method, gallery, training and track, or for one of them, from the
built-in sequences; OUT is docs/figures unless it is given. With --data, it also writes
OUT/how_it_works/* and, for the gallery, OUT/recorded/* of the recordings in that folder. Without
libigl, its columns are left out. Takes about five minutes; a draft takes seconds, as it shows a
small sheet instead.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import dynmesh

from ..harness import DOCS
from ..subjects import Subject, from_file
from . import cloth, error_bars, gallery, how_it_works, method, scans, whole_frame

PAGES = ("how_it_works", "method", "gallery", "training", "track")


def main() -> None:
    """Makes the pictures that are asked for."""
    parser = argparse.ArgumentParser(description="Makes the pictures of four pages in docs.")
    parser.add_argument("--page", choices=PAGES, help="of which; without it, of all")
    parser.add_argument("--data", type=Path, metavar="FOLDER", help="also of these recordings")
    parser.add_argument("--out", type=Path, default=DOCS / "figures")
    parser.add_argument("--draft", action="store_true", help="show a small sheet instead")
    arguments = parser.parse_args()
    if arguments.draft:
        figure = sea = training = dynmesh.synth.ocean(175, grid=16)
    else:
        figure, sea = dynmesh.synth.walker(), dynmesh.synth.ocean(175)
        training = dynmesh.synth.walker(seed=1)
    subjects = {
        "walker": Subject.of("walker", figure, "z", 20, None),
        "ocean": Subject.of("ocean", sea, "z", 60, None),
    }
    pictures = {
        "how_it_works": [],
        "method": [gallery.HIDDEN_SIDE],
        "gallery": [*gallery.BUILT_IN, *(gallery.RECORDED if arguments.data else ())],
        "training": [gallery.training(training.vertices)],
        "track": [],
    }
    for page in [arguments.page] if arguments.page else PAGES:
        if page == "how_it_works" and arguments.data is not None:
            how_it_works.draw(arguments.data, arguments.out)
        if page == "method":
            method.draw_generations(arguments.out)
            whole_frame.draw(whole_frame.PICTURE, subjects["walker"], arguments.out)
        for picture in pictures[page]:
            subject = subjects.get(picture.of) or from_file(arguments.data / f"{picture.of}.npz")
            shown = picture.frames[::20] if arguments.draft else picture.frames
            gallery.draw(replace(picture, frames=shown), subject, arguments.out)
        if page == "track":
            shown = [8] if arguments.draft else scans.WALKER.frames
            scans.draw(replace(scans.WALKER, frames=shown), subjects["walker"], arguments.out)
        if page == "gallery" and arguments.data is not None:
            for picture in error_bars.RECORDED:
                subject = from_file(arguments.data / f"{picture.of}.npz")
                error_bars.draw(picture, subject, arguments.out)
            cloth.draw(arguments.data, arguments.out, every=25 if arguments.draft else 2)


if __name__ == "__main__":
    main()
