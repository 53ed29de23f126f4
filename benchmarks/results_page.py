"""Puts the results of runs into docs/results.md, and their figures beside it.

    python -m benchmarks.results_page BUILTIN RECORDED METHODS

BUILTIN and RECORDED are folders that ``dynmesh reproduce`` wrote, METHODS is a file with what
``python -m benchmarks.methods_table`` printed. What the page says in words is for its reader to
check.
"""

import argparse
import json
import shutil
from pathlib import Path
from typing import Any

from dynmesh.study.methods import BEYOND, COMPARED, ONCE
from dynmesh.study.plan import PAPER_SHARES, SCENARIOS
from dynmesh.study.style import percent

from . import page
from .markdown import ABSENT, Line, number, table

PAGE = Path(__file__).parents[1] / "docs" / "results.md"

Results = dict[str, Any]


def sequence_table(numbers: Results) -> str:
    """Mean NMSVE times 10 000 and median time of every method on one sequence."""
    shares = [percent(share) for share in PAPER_SHARES]
    lines: list[Line] = [("method", f"{shares[0]} known", *shares[1:], *SCENARIOS)]
    for method in (*COMPARED, *BEYOND):
        if method.key in numbers["missing"]:
            continue
        runs = [numbers["grid"][method.key][str(share)] for share in PAPER_SHARES]
        runs += [numbers["scenarios"][name][method.key] for name in SCENARIOS]
        cells = [f"{_error(run)}; {number(run['milliseconds_median'])} ms" for run in runs]
        lines.append((method.label, *cells))
    once = [_error(numbers["once_only"][str(share)]) for share in PAPER_SHARES]
    lines.append((ONCE.label, *once, *([""] * len(SCENARIOS))))
    return table(lines)


def claims_table(claims: list[Results]) -> str:
    """Claims against sequences."""
    sequences = list(dict.fromkeys(claim["sequence"] for claim in claims))
    holds = {(claim["claim"], claim["sequence"]): claim["holds"] for claim in claims}
    verdicts = {True: "holds", False: "**does not hold**", None: ABSENT}
    lines: list[Line] = [("claim", *sequences)]
    for words in dict.fromkeys(claim["claim"] for claim in claims):
        lines.append((words, *(verdicts[holds.get((words, name))] for name in sequences)))
    return table(lines)


def _error(run: Results) -> str:
    error = run["nmsve_mean"]
    return "diverges" if error > 1 else number(1e4 * error)


def main() -> None:
    """Rewrites the page."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("builtin", type=Path)
    parser.add_argument("recorded", type=Path)
    parser.add_argument("methods", type=Path)
    parser.add_argument("--page", type=Path, default=PAGE)
    arguments = parser.parse_args()
    folders = {"builtin": arguments.builtin, "recorded": arguments.recorded}
    results = [json.loads((path / "results.json").read_text()) for path in folders.values()]
    made = {
        name: sequence_table(numbers)
        for result in results
        for name, numbers in result["sequences"].items()
    }
    for kind in ("claims", "detail_claims"):
        made[kind] = claims_table([claim for result in results for claim in result[kind]])
    made["methods"] = arguments.methods.read_text().split("\n\n")[0].strip()  # errors, not times
    page.rewrite(made, arguments.page)
    for name, folder in folders.items():
        figures = arguments.page.parent / "figures" / name
        figures.mkdir(parents=True, exist_ok=True)
        for picture in folder.glob("*.png"):
            shutil.copy(picture, figures)


if __name__ == "__main__":
    main()
