"""Shows tables of measurements and programs where pages refer to them.

A paragraph that consists of a link to a CSV file, such as ``[Errors](tables/walker.csv)``, becomes
its text, the table, and a link to the file; one with a link to a program, the link and the program.
GitHub shows the link, and the file behind it.
"""

import csv
import posixpath
import re
from pathlib import Path
from typing import Any

from mkdocs.exceptions import PluginError

DOCS = Path(__file__).parents[1]
REFERENCE = re.compile(r"^\[([^\]]+)\]\(([^)\s]+\.(csv|py|c|cpp))\)$", re.MULTILINE)


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Replaces the links."""
    here = posixpath.dirname(page.file.src_uri)

    def shown(match: re.Match[str]) -> str:
        path = DOCS / here / match[2]
        if not path.is_file():
            raise PluginError(f"{page.file.src_uri}: {match[2]} is no file")
        if match[3] != "csv":
            return f"{match[0]}\n\n``` {{ .{match[3]} }}\n{path.read_text()}```"
        return f"{match[1]} ([CSV]({match[2]})):\n\n{table(path)}"

    return REFERENCE.sub(shown, markdown)


def table(path: Path) -> str:
    """Returns a CSV file as a table in Markdown; its first row is the head."""
    with path.open(newline="") as file:
        head, *rows = csv.reader(file)
    if any(len(row) != len(head) for row in rows):
        raise PluginError(f"{path}: its rows have different numbers of cells")
    lines = [f"| {' | '.join(row)} |" for row in (head, *rows)]
    lines.insert(1, f"|{'---|' * len(head)}")
    return re.sub(r"(?<=\d) (?=ms\b|%|frames\b)", "&nbsp;", "\n".join(lines))
