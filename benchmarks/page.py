"""Puts tables into docs/speed.md, between comments that name them."""

import re
from pathlib import Path

PAGE = Path(__file__).parents[1] / "docs" / "speed.md"


def rewrite(tables: dict[str, str], page: Path = PAGE) -> None:
    """Replaces the tables that were made; the others stay.

    Raises:
        ValueError: the page has no place for a table.
    """
    text = page.read_text()
    for name, table in tables.items():
        places = re.findall(rf"<!-- {name} -->\n.*?<!-- end -->", text, re.DOTALL)
        if len(places) != 1:
            raise ValueError(f"{page}: must have one place for the table {name}")
        text = text.replace(places[0], f"<!-- {name} -->\n{table}\n<!-- end -->")
    page.write_text(text)
