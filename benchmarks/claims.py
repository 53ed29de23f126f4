"""Prints on which sequences the claims of the paper, and those about detail, hold, as tables.

    python -m benchmarks.claims OUT ...

Each OUT is a folder that ``dynmesh reproduce``, benchmarks.beyond or both wrote.
"""

import json
from pathlib import Path

from dynmesh.study.claims import Verdict
from dynmesh.study.result_tables import claims_table

from .harness import Table, parser, show


def read(folders: list[Path]) -> dict[str, list[Verdict]]:
    """Return the claims in some folders, by the name of their table."""
    found: dict[str, list[Verdict]] = {"claims": [], "detail_claims": []}
    for folder in folders:
        if (of_paper := folder / "results.json").exists():
            claims = json.loads(of_paper.read_text(encoding="utf-8"))["claims"]
            found["claims"] += [Verdict(**claim) for claim in claims]
        if (beyond := folder / "claims.json").exists():
            claims = json.loads(beyond.read_text(encoding="utf-8"))
            found["detail_claims"] += [Verdict(**claim) for claim in claims]
    return found


def main() -> None:
    """Print the tables."""
    made = parser(__doc__, folder=False)
    made.add_argument("folders", type=Path, nargs="+", metavar="OUT")
    arguments = made.parse_args()
    claims = read(arguments.folders)
    show(arguments, *(Table(name, claims_table(found)) for name, found in claims.items() if found))


if __name__ == "__main__":
    main()
