"""Replaces the tables of pages in docs, which are between comments that name them."""

import re
from pathlib import Path

DOCS = Path(__file__).parents[1] / "docs"
PAGE = DOCS / "speed.md"
MEASUREMENTS = DOCS / "reference" / "measurements.md"
"""The page of the tables that are too long for the page of their section."""

# These are on no page, because there are figures or ratios of the same measurements.
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


def rewrite(tables: dict[str, str], *pages: Path) -> None:
    """Replace the tables on pages, except those that are on none.

    Raises:
        ValueError: the pages do not have exactly one place for a table; they are unchanged.
    """
    texts = {page: page.read_text() for page in pages}
    for name, table in tables.items():
        if name in LONG:
            continue
        pattern = re.compile(rf"<!-- {name} -->\n.*?<!-- end -->", re.DOTALL)
        places = [(page, old) for page, text in texts.items() for old in pattern.findall(text)]
        if len(places) != 1:
            names = " and ".join(str(page) for page in pages)
            raise ValueError(f"{names}: must have one place for {name}, not {len(places)}")
        page, old = places[0]
        texts[page] = texts[page].replace(old, f"<!-- {name} -->\n{table}\n<!-- end -->")
    for page, text in texts.items():
        page.write_text(text)
