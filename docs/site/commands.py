"""Writes what ``dynmesh COMMAND --help`` prints onto the page of each command."""

import contextlib
from pathlib import PurePosixPath
from typing import Any

from mkdocs.exceptions import PluginError

app: Any = None
with contextlib.suppress(ImportError):  # not built: the pages keep their text
    from dynmesh.cli import VERBS, app

FOLDER = PurePosixPath("reference/commands")


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Writes usage, arguments and options below the title."""
    path = PurePosixPath(page.file.src_uri)
    if app is None or path.parent != FOLDER or path.stem == "index":
        return markdown
    if path.stem not in VERBS:
        raise PluginError(f"{path}: there is no command {path.stem}")
    text = app[path.stem].generate_docs(usage_name=f"dynmesh {path.stem}")
    title, below_the_title = markdown.partition("\n")[0], text.partition("\n")[2]
    return f"{title}\n{below_the_title}"
