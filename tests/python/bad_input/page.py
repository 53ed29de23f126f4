"""The page docs/robustness/bad_input.md."""

import subprocess
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from . import commands, completer, files, functions
from .case import Case, World, shown

PATH = Path(__file__).parents[3] / "docs" / "robustness" / "bad_input.md"

_INTRODUCTION = """\
# Bad input, and what answers

Everything below was tried, and answered as shown: in Python by an exception, in the shell by a
message and an exit code that is not 0, in C++ by an exception and in C by a status and
`dynmesh_last_message()`. A message names the argument, the place and the value. A refused call
prints nothing else, leaves the completer as it was, to the byte of its `state()`, and leaves no
file behind.

An argument of the wrong kind is a `TypeError`, one of the right kind with a wrong value a
`ValueError` (`SettingError` is one), and what the system refuses an `OSError`. In C++ both of the
former are `std::invalid_argument`. In the shell a setting that a completer refuses ends with exit
code 2, a file that is refused with 1. A call that does not fit its signature at all gets a `TypeError`
in the words of Python itself. Where other libraries are quoted, the words are those of the
versions that `constraints.txt` pins.

Most cases are about a mesh of 49 vertices and 72 faces, `body.npz` of three frames of it, and
`folder.npz`, a folder. `python tests/python/write_bad_input.py` wrote this page, of {count} cases;
`script/test` runs every one of them and compares.
"""


class Row(NamedTuple):
    """A line of a table."""

    call: str
    given: str
    answer: str


def prepared(folder: Path) -> World:
    """A world with all files that the cases read."""
    world = World(folder)
    files.prepare(world)
    commands.prepare(world)
    return world


def python_sections() -> dict[str, list[Case]]:
    """The cases that need nothing compiled beside the package, by the title of their table."""
    return {
        "Python: the completer": completer.cases,
        "Python: streams, topology, measures, baselines, losses": functions.cases,
        "Python: sequences and files": files.cases,
        "The command dynmesh": commands.shell,
    }


def from_native(programs: Path) -> dict[str, list[Row]]:
    """What the program of the C++ tests says that the C++ and the C interface answered."""
    command = [programs / "tests" / "cpp" / "dynmesh-bad-input"]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    rows: dict[str, list[Row]] = {}
    for line in printed.splitlines():
        interface, *row = line.split("\t")
        rows.setdefault(interface, []).append(Row(*row))
    return rows


def table(title: str, rows: Iterable[Row]) -> str:
    """A section of the page."""
    lines = [f"## {title}", "", "| call | what is wrong | answer |", "|---|---|---|"]
    lines += [f"| `{row.call}` | {row.given} | {_quoted(row.answer)} |" for row in rows]
    return "\n".join(lines) + "\n"


def sections(world: World, programs: Path) -> Iterator[str]:
    """The page but for its introduction, one section at a time."""
    cases = python_sections()
    cases["The program dynmesh-complete"] = commands.compiled(programs)
    for title, some in cases.items():
        yield table(title, [Row(c.call, c.given, shown(c.answer(world))) for c in some])
    for interface, rows in from_native(programs).items():
        yield table(interface, rows)


def page(programs: Path) -> str:
    """The whole page."""
    with tempfile.TemporaryDirectory() as folder:
        body = "\n".join(sections(prepared(Path(folder)), programs))
    count = sum(line.startswith("| `") for line in body.splitlines())
    return f"{_INTRODUCTION.format(count=count)}\n{body}"


def _quoted(text: str) -> str:
    fence = "``" if "`" in text else "`"
    return f"{fence}{text}{fence}".replace("|", "\\|")
