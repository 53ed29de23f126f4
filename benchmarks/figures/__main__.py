"""Makes the pictures of docs/method.md, docs/gallery.md and the guides training and track.

    python -m benchmarks.figures [--page PAGE] [--data FOLDER] [--out FOLDER] [--draft]

writes OUT/PAGE/* for PAGE method, gallery, training and track, or for one of them, from the
built-in sequences; OUT is docs/figures unless it is given. With --data, the gallery includes
OUT/recorded/* of the recordings in that folder. Without libigl, its columns are left out. Takes
about five minutes; a draft takes seconds, as it shows a small sheet instead.
"""

import argparse
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import dynmesh
from dynmesh import Sequence
from dynmesh.study.subjects import Subject, from_file

from ..harness import DOCS
from . import error_bars, gallery, method, scans

PAGES = ("method", "gallery", "training", "track")


def draw_method(subjects: dict[str, Subject], out: Path) -> None:
    """The charts of docs/method.md."""
    out.mkdir(parents=True, exist_ok=True)
    method.draw_generations(out)
    method.draw_drift([*subjects.values()], out)


def pictures_of(page: str, training: Sequence, data: Path | None) -> Iterable[gallery.Picture]:
    """The pictures of meshes on a page; `training` is another recording of the walker."""
    if page == "method":
        return [gallery.HIDDEN_SIDE]
    if page == "training":
        return [gallery.training(training.vertices)]
    if page == "track":
        return []
    return gallery.BUILT_IN if data is None else gallery.BUILT_IN + gallery.RECORDED


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
    for page in PAGES:
        if arguments.page not in (None, page):
            continue
        if page == "method":
            draw_method(subjects, arguments.out / page)
        for picture in pictures_of(page, training, arguments.data):
            subject = subjects.get(picture.of) or from_file(arguments.data / f"{picture.of}.npz")
            shown = picture.frames[::20] if arguments.draft else picture.frames
            gallery.draw(replace(picture, frames=shown), subject, arguments.out)
        if page == "track":
            scans.draw(scans.WALKER, subjects["walker"], arguments.out)
        if page == "gallery" and arguments.data is not None:
            for picture in error_bars.RECORDED:
                subject = from_file(arguments.data / f"{picture.of}.npz")
                error_bars.draw(picture, subject, arguments.out)


if __name__ == "__main__":
    main()
