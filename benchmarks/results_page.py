"""Replaces the tables and figures of docs/results.md and docs/reference/measurements.md.

    python -m benchmarks.results_page BUILTIN RECORDED METHODS TRAINING WHOLE

BUILTIN and RECORDED are folders that ``dynmesh reproduce`` wrote. METHODS is a file with the output
of ``python -m benchmarks.methods_table``, TRAINING and WHOLE are files with that of ``python -m
benchmarks.training_table``, without and with ``--whole``. The sentences of the pages have to be
checked by hand.
"""

import argparse
import json
import shutil
from pathlib import Path

from dynmesh.study.result_tables import claims_table, sequence_table
from dynmesh.study.tables import markdown

from . import page

PAGE = page.DOCS / "results.md"


def main() -> None:
    """Rewrite the pages."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("builtin", type=Path)
    parser.add_argument("recorded", type=Path)
    for name in ("methods", "training", "whole"):
        parser.add_argument(name, type=Path)
    parser.add_argument("--pages", type=Path, nargs="+", default=[PAGE, page.MEASUREMENTS])
    arguments = parser.parse_args()
    folders = {"builtin": arguments.builtin, "recorded": arguments.recorded}
    results = [json.loads((path / "results.json").read_text()) for path in folders.values()]
    made = {
        name: markdown(sequence_table(numbers))
        for result in results
        for name, numbers in result["sequences"].items()
    }
    for kind in ("claims", "detail_claims"):
        made[kind] = markdown(claims_table([claim for result in results for claim in result[kind]]))
    made["methods"] = arguments.methods.read_text().split("\n\n")[0].strip()  # errors, not times
    summary, whole_table = arguments.training.read_text().split("\n\n")
    made |= {"training-summary": summary.strip(), "training": whole_table.strip()}
    made["whole"] = arguments.whole.read_text().split("\n\n")[1].strip()
    page.rewrite(made, *arguments.pages)
    for name, folder in folders.items():
        figures = arguments.pages[0].parent / "figures" / name
        figures.mkdir(parents=True, exist_ok=True)
        for picture in folder.glob("*.png"):
            shutil.copy(picture, figures)


if __name__ == "__main__":
    main()
