"""Writes what ``dynmesh COMMAND --help`` prints onto the page of each command."""

import contextlib
from pathlib import PurePosixPath
from typing import Any

from mkdocs.exceptions import PluginError

app: Any = None
with contextlib.suppress(ImportError):  # not built: the pages keep their text
    import typer
    from typer.cli import get_docs_for_click

    from dynmesh.cli import app

FOLDER = PurePosixPath("reference/commands")


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Writes usage, arguments and options below the title."""
    path = PurePosixPath(page.file.src_uri)
    if app is None or path.parent != FOLDER or path.stem == "index":
        return markdown
    group: Any = typer.main.get_command(app)
    if path.stem not in group.commands:
        raise PluginError(f"{path}: there is no command {path.stem}")
    context = typer.Context(group, info_name="dynmesh")
    name = f"dynmesh {path.stem}"
    text = get_docs_for_click(obj=group.commands[path.stem], ctx=context, name=name)
    title, below_the_title = markdown.partition("\n")[0], text.partition("\n")[2]
    return f"{title}\n{below_the_title}"
