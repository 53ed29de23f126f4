"""Replaces the tables of docs/speed.md, which are between comments that name them."""

import re
from pathlib import Path

PAGE = Path(__file__).parents[1] / "docs" / "speed.md"

# These are too long for the page, which has figures or ratios of the same measurements.
LONG = frozenset(
    {
        "low-resolution",
        "subdivided",
        "subdivided-detail",
        "subdivided-errors",
        "largest",
        "numbering",
        "overhead",
        "sizes",
        "unknown",
        "cpp",
        "instructions",
    }
)


def rewrite(tables: dict[str, str], page: Path = PAGE) -> None:
    """Replace the tables on a page, except those that are too long for it.

    Raises:
        ValueError: the page does not have exactly one place for a table.
    """
    text = page.read_text()
    for name, table in tables.items():
        if name in LONG:
            continue
        places = re.findall(rf"<!-- {name} -->\n.*?<!-- end -->", text, re.DOTALL)
        if len(places) != 1:
            raise ValueError(f"{page}: must have one place for the table {name}, not {len(places)}")
        text = text.replace(places[0], f"<!-- {name} -->\n{table}\n<!-- end -->")
    page.write_text(text)
