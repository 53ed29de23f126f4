"""Makes the pictures of README and of three pages of docs.

    python -m benchmarks.figures [--page PAGE] [--out FOLDER] [--draft]

writes OUT/PAGE/* for PAGE readme, method, training and track, or for one of them, from the
built-in sequences, and for speed from docs/tables; OUT is docs/figures unless it is given.
Without libigl, its columns are left out. Takes about five minutes; a draft takes seconds, as it
shows a small sheet instead.
"""

import argparse
from pathlib import Path

import dynmesh

from ..harness import DOCS
from ..rivals import TRACKED, subjects
from ..subjects import Subject
from . import charts, walker

PAGES = ("readme", "method", "training", "track", "speed")


def main() -> None:
    """Makes the pictures that are asked for."""
    parser = argparse.ArgumentParser(description="Makes the pictures of README and docs.")
    parser.add_argument("--page", choices=PAGES, help="of which; without it, of all")
    parser.add_argument("--out", type=Path, default=DOCS / "figures")
    parser.add_argument("--draft", action="store_true", help="show a small sheet instead")
    arguments = parser.parse_args()
    if arguments.draft:
        figure = other = dynmesh.synth.ocean(20, grid=16)
    else:
        figure, other = dynmesh.synth.walker(), dynmesh.synth.walker(seed=1)
    subject, out = Subject("walker", figure.vertices, figure.faces, "z", 20), arguments.out
    for page in [arguments.page] if arguments.page else PAGES:
        if page == "readme":
            walker.readme(subject, out)
        elif page == "method":
            charts.generations(out)
            walker.hidden_side(subject, out)
            walker.whole_frame(subject, out)
        elif page == "training":
            walker.training(subject, out, other.vertices)
        elif page == "track":
            (hand,) = [subject] if arguments.draft else subjects(TRACKED, ["hand"])
            walker.track(hand, out)
        elif page == "speed":
            charts.latency(out)


if __name__ == "__main__":
    main()
