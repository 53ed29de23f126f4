"""What the site needs beyond MkDocs: sources behind links, and formulas.

The pages are plain Markdown that GitHub shows as well. Two things are different there and here:

- Links to files outside of docs lead to copies of them, as plain text, so that the site is whole
  without any other host.
- Formulas between dollar signs become MathML, which browsers show without scripts or fonts.
"""

import html
import posixpath
import re
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File

REPOSITORY = Path(__file__).parents[2]

LINK = re.compile(r"\]\(((?:\.\./)+[^)\s#]+)(#[^)\s]*)?\)")
FORMULA = re.compile(r'<(span|div) class="arithmatex">(.*?)</\1>', re.DOTALL)
ROLE = re.compile(r":(?:class|func|meth|mod):(?=<code)")


def on_page_markdown(markdown: str, page: Any, config: Any, files: Any) -> str:
    """Resolves links that leave the folder of the pages."""
    here = posixpath.dirname(page.file.src_uri)

    def resolved(match: re.Match[str]) -> str:
        target = posixpath.normpath(posixpath.join("docs", here, match[1]))
        if target.startswith("docs/"):
            return match[0]
        source = REPOSITORY / target
        if not source.is_file():
            raise PluginError(f"{page.file.src_uri}: {match[1]} is no file")
        copy = f"sources/{target}.txt"
        if files.get_file_from_path(copy) is None:
            files.append(File.generated(config, copy, content=source.read_bytes()))
        return f"]({posixpath.relpath(copy, here)})"

    return LINK.sub(resolved, markdown)


def on_page_content(html: str, **_: Any) -> str:
    """Sets the formulas, and takes the roles away that docstrings have for Sphinx."""
    return ROLE.sub("", FORMULA.sub(_mathml, html))


def _mathml(match: re.Match[str]) -> str:
    source = html.unescape(match[2]).strip()
    if match[1] == "span":
        return str(convert(source.removeprefix(r"\(").removesuffix(r"\)")))
    formula = convert(source.removeprefix(r"\[").removesuffix(r"\]"), display="block")
    return f'<div class="formula">{formula}</div>'
