"""Makes the figures and tables of the documentation: ``script/reproduce``."""

import argparse
import sys
from collections.abc import Callable
from typing import Any

from . import calibration, cases, files, paper, rivals, tracking
from .harness import Table, add_arguments, show

OPTIONS: dict[str, dict[str, Any]] = {
    "--azimuth": {"type": float, "help": "of the pictures, in degrees around up"},
    "--cameras": {"type": int, "nargs": "+", "default": [4, 1], "help": "numbers of cameras"},
    "--known": {"type": float, "nargs": "+", "metavar": "SHARE", "help": "known at random"},
    "--quick": {"action": "store_true", "help": "at most 30 frames, and fewer shares"},
}
"""Arguments that some tables have."""

TABLES: dict[str, tuple[Callable[[argparse.Namespace], list[Table]], tuple[str, ...]]] = {
    "paper": (paper.tables, ("--azimuth", "--quick")),
    "rivals": (rivals.tables, ()),
    "drift": (cases.drift, ("--known",)),
    "methods": (cases.relative_to_motion, ("--known",)),
    "training": (cases.training, ("--known",)),
    "learning": (cases.learning, ("--known",)),
    "both-sides": (files.both_sides, ()),
    "calibration": (calibration.tables, ()),
    "tracking": (tracking.baselines, ("--cameras",)),
    "tracking-errors": (tracking.standard_errors, ("--cameras",)),
    "tracking-resolutions": (tracking.resolutions, ("--cameras",)),
    "whole-frame": (files.whole_frame, ()),
}


def main() -> None:
    """Make what the first argument names, without one the figures and tables of the paper."""
    parser = argparse.ArgumentParser("script/reproduce", description="Makes tables and figures.")
    commands = parser.add_subparsers(dest="name", metavar="TABLE", help="paper if there is none")
    for name, (tables, options) in TABLES.items():
        words = (tables.__doc__ or "").partition("\n")[0]
        command = commands.add_parser(name, help=words, description=words)
        add_arguments(command, folder=name != "rivals")
        for option in options:
            command.add_argument(option, **OPTIONS[option])
    first = [*sys.argv, "--"][1]
    if first.startswith("-") and first not in ("-h", "--help"):
        sys.argv.insert(1, "paper")
    arguments = parser.parse_args()
    show(arguments, *TABLES[arguments.name][0](arguments))


if __name__ == "__main__":
    main()
