"""Writes the fixed values of the methods onto their page, from the C++ files that define them."""

import re
from collections.abc import Iterator
from html import escape
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

from mkdocs.exceptions import PluginError

SOURCES = Path(__file__).parents[2] / "cpp" / "src"
PAGE = "reference/constants.md"
STRUCTS = {
    "Method detail": ("detail/constants.hpp", "DetailConstants"),
    "Training": ("detail/constants.hpp", "TrainingConstants"),
    "First-order step": ("detail/constants.hpp", "FirstOrderConstants"),
    "Error bars": ("detail/constants.hpp", "UncertaintyConstants"),
    "Whole frames": ("whole_frame/constants.hpp", "WholeFrameConstants"),
    "Registration": ("registration/constants.hpp", "RegistrationConstants"),
    "Rigid starts": ("registration/constants.hpp", "RigidStartConstants"),
    "Tips of limbs": ("registration/constants.hpp", "TipConstants"),
    "Tracking": ("tracking/constants.hpp", "TrackingConstants"),
}
OTHERS = {
    "detail/intrinsic_delaunay.cpp": ("slack", "tolerance"),
    "detail/blend.cpp": ("rounding",),
    "kernels/best_rotation.cpp": ("pull_to_last", "rounding"),
    "factor/masked_factor.cpp": ("singular",),
    "kernels/mode_kernels.hpp": ("modes_of_part", "most_learned_shapes"),
    "detail/shape_library.cpp": ("largest_in_edges", "interval"),
    "detail/learned_modes.cpp": ("remade_after",),
    "support/rigid_motion.cpp": ("collinear",),
}
"""Constants that belong to one file."""

MEMBER = re.compile(r"^ *(?:constexpr )?(?:double|int|Index|[\w:]+_t) (\w+) = ([^;]+);")


class Constant(NamedTuple):
    """A name, its value as the source has it, and the comment above it."""

    name: str
    value: str
    reason: str


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Inserts the tables above the second heading of the page."""
    if page.file.src_uri != PAGE:
        return markdown
    above, heading, below = markdown.partition("\n## ")
    return f"{above}\n{''.join(sections())}{heading}{below}"


def sections() -> Iterator[str]:
    """Yields a heading and a table for each group of constants."""
    for title, (path, name) in STRUCTS.items():
        text = (SOURCES / path).read_text()
        body = re.search(rf"^struct {name} {{\n(.*?)^}};", text, re.DOTALL | re.MULTILINE)
        if body is None:
            raise PluginError(f"{path}: has no struct {name}")
        yield f"\n## {title}\n\n`cpp/src/{path}`\n\n{table(constants(body[1]))}"
    found = []
    for path, names in OTHERS.items():
        of_file = {one.name: one for one in constants((SOURCES / path).read_text())}
        for name in names:
            if name not in of_file or not of_file[name].reason:
                raise PluginError(f"{path}: has no constant {name} with a comment")
            found.append(of_file[name]._replace(name=f"{name}` in `{path}"))
    yield f"\n## Values used in one file\n\n{table(found)}"


def constants(text: str) -> list[Constant]:
    """Returns the constants of a piece of C++; a comment holds until the next one or a gap."""
    found, comment, is_open = [], "", False
    for line in text.splitlines():
        stripped = line.strip()
        if stripped.startswith("///"):
            comment = f"{comment if is_open else ''} {stripped.removeprefix('///').strip()}".strip()
            is_open = True
            continue
        is_open = False
        if not stripped:
            comment = ""
        elif member := MEMBER.match(line):
            found.append(Constant(member[1], member[2], comment))
    return found


def table(rows: list[Constant]) -> str:
    """Returns a table in Markdown, with a row for the constants that share a comment."""
    lines = ["| constant | value | meaning |", "|---|---|---|"]
    for reason, sharing in groupby(rows, lambda row: row.reason):
        some = list(sharing)
        names = ", ".join(f"`{row.name}`" for row in some)
        values = ", ".join(row.value for row in some)
        lines.append(f"| {names} | {values} | {escape(reason).replace('|', '&#124;')} |")
    return "\n".join(lines) + "\n"
