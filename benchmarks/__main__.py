"""Makes the figures and tables of the documentation: ``script/reproduce``."""

import argparse
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from . import calibration, cases, files, paper, rivals, tracking
from .harness import DOCS, Table, add_arguments, show

MODULES = {"script/reproduce": "benchmarks", "script/dev/bench": "benchmarks.speed"}
"""What scripts run after they have built dynmesh."""


def commands(folder: Path | None) -> list[list[str]]:
    """The words of the measurements on the pages; without a folder, of those that need none."""
    text = "".join(page.read_text(encoding="utf-8") for page in sorted(DOCS.rglob("*.md")))
    lines = dict.fromkeys(re.findall(rf"^(?:{'|'.join(MODULES)}) .*", text, re.MULTILINE))
    chosen = [line for line in lines if "--quick" not in line and (folder or "FOLDER" not in line)]
    given = {"FOLDER": str(folder)}
    return [[given.get(word, word) for word in line.split()] for line in chosen]


def everything(arguments: argparse.Namespace) -> list[Table]:
    """All tables and pictures, by the commands of the pages, whose numbers are then compared."""
    pictures = DOCS / "figures" if arguments.docs else arguments.out
    for program, *words in commands(arguments.folder):
        given = [word for word in words if word != "--docs"]
        if "--out" in given:
            given[given.index("--out") + 1] = str(pictures / given[given.index("--out") + 1])
        else:
            given += ["--out", str(arguments.out)]
        run(MODULES[program], *given, *(["--docs"] if arguments.docs else []))
    run("benchmarks.figures", "--out", str(pictures))
    pages = "tables_of_pages or readme or tutorial"
    run("pytest", "-m", "", "-k", pages, str(DOCS.parent / "tests" / "python" / "repository"))
    return []


def run(module: str, *words: str) -> None:
    """Run a module in a process of its own, as another one measures best."""
    print("python -m", module, *words, flush=True)
    subprocess.run([sys.executable, "-m", module, *words], check=True)


OPTIONS: dict[str, dict[str, Any]] = {
    "folder": {
        "type": Path,
        "nargs": "?",
        "help": "of the recordings; what needs them is left out without it",
    },
    "--azimuth": {"type": float, "help": "of the pictures, in degrees around up"},
    "--cameras": {"type": int, "nargs": "+", "default": [4, 1], "help": "numbers of cameras"},
    "--known": {"type": float, "nargs": "+", "metavar": "SHARE", "help": "known at random"},
    "--quick": {"action": "store_true", "help": "at most 30 frames, and fewer shares"},
}
"""Arguments that some tables have."""

TABLES: dict[str, tuple[Callable[[argparse.Namespace], list[Table]], tuple[str, ...]]] = {
    "all": (everything, ("folder",)),
    "paper": (paper.tables, ("--azimuth", "--quick")),
    "rivals": (rivals.tables, ()),
    "drift": (cases.drift, ("--known",)),
    "methods": (cases.relative_to_motion, ("--known",)),
    "training": (cases.training, ("--known",)),
    "learning": (cases.learning, ("--known",)),
    "both-sides": (files.both_sides, ()),
    "calibration": (calibration.tables, ()),
    "tracking": (tracking.baselines, ("--cameras",)),
    "tracking-resolutions": (tracking.resolutions, ("--cameras",)),
    "tracking-colours": (tracking.colours, ("--cameras",)),
    "whole-frame": (files.whole_frame, ()),
}


def main() -> None:
    """Make what the first argument names, without one the figures and tables of the paper."""
    parser = argparse.ArgumentParser("script/reproduce", description="Makes tables and figures.")
    commands = parser.add_subparsers(dest="name", metavar="TABLE", help="paper if there is none")
    for name, (tables, options) in TABLES.items():
        words = (tables.__doc__ or "").partition("\n")[0]
        command = commands.add_parser(name, help=words, description=words)
        add_arguments(command, folder=name not in ("all", "rivals"))
        for option in options:
            command.add_argument(option, **OPTIONS[option])
    first = [*sys.argv, "--"][1]
    if first.startswith("-") and first not in ("-h", "--help"):
        sys.argv.insert(1, "paper")
    arguments = parser.parse_args()
    show(arguments, *TABLES[arguments.name][0](arguments))


if __name__ == "__main__":
    main()
