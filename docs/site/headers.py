"""Gives the symbols of the public headers headings of their own in the references of C++ and C."""

import re
from pathlib import Path
from typing import Any

REPOSITORY = Path(__file__).parents[2]

INCLUDED = re.compile(r'```(cpp|c)\n--8<-- "(cpp/include/[^"]+)"\n```')
TYPE = re.compile(
    r"(?:class|struct|enum(?: class)?) (?:alignas\(.*?\) |DYNMESH_EXPORT )*(\w+)[^;]*$"
)
POINTER = re.compile(r"typedef .*\(\*(\w+)\)")
FUNCTION = re.compile(r"(?![ #}]|typedef|using|struct|namespace|extern|.*operator).*?(\w+)\(")


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Replaces each header that a page includes by its parts."""
    if page.file.src_uri not in ("reference/cpp.md", "reference/c.md"):
        return markdown
    return INCLUDED.sub(
        lambda match: "\n\n".join(
            (f"### {name}\n\n" if name else "") + f"```{match[1]}\n{text}\n```"
            for name, text in parts((REPOSITORY / match[2]).read_text())
        ),
        markdown,
    )


def parts(header: str) -> list[tuple[str, str]]:
    """Returns the text of each type and function with its name, and what stands before the first.

    They are separated by empty lines and begin at the left margin. Overloads stay together.
    """
    found = [("", "")]
    for block in header.strip().split("\n\n"):
        name = _name(block) or found[-1][0]
        if name == found[-1][0]:
            found[-1] = (name, f"{found[-1][1]}\n\n{block}".lstrip("\n"))
        else:
            found.append((name, block))
    return found


def _name(block: str) -> str:
    for line in block.splitlines():
        if line.startswith(("//", "template", "/*", " *")):
            continue
        for pattern in (TYPE, POINTER, FUNCTION):
            if match := pattern.match(line.removeprefix("typedef ") if pattern is TYPE else line):
                return match[1]
        return ""
    return ""
