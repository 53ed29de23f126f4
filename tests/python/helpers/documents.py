"""The pages of the documentation, their blocks of code, and their tables."""

import csv
import os
import re
import subprocess
import sys
from pathlib import Path

from conftest import REPOSITORY

README = (REPOSITORY / "README.md").read_text()
DOCS = REPOSITORY / "docs"
PROGRAMS = DOCS / "programs"
DOCUMENTS = [*sorted(REPOSITORY.glob("*.md")), *sorted(DOCS.rglob("*.md"))]

TABLE = re.compile(r"^\[[^\]]+\]\(([^)\s]+\.csv)\)$", re.MULTILINE)
"""A reference to a table of measurements, in whose place the site shows it."""


def blocks(language: str, document: str = README) -> list[str]:
    """Returns the code blocks of one language in order."""
    return re.findall(rf"^```{language}\n(.*?)^```$", document, flags=re.DOTALL | re.MULTILINE)


def run(*command: str | Path, cwd: Path) -> str:
    environment = os.environ | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
    result = subprocess.run(
        command, cwd=cwd, env=environment, capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


def build(folder: Path, programs: Path) -> Path:
    """Builds the CMake project in `folder` against an installed dynmesh."""
    run("cmake", "--install", programs, "--prefix", folder / "prefix", cwd=folder)
    run("cmake", "-B", "build", f"-DCMAKE_PREFIX_PATH={folder / 'prefix'}", cwd=folder)
    run("cmake", "--build", "build", cwd=folder)
    return folder / "build"


def cells(table: Path) -> list[list[str]]:
    """Returns the rows of a table of measurements, the head first."""
    with table.open(newline="") as file:
        return list(csv.reader(file))


def with_tables(page: Path) -> str:
    """Returns a page as its site shows it, with tables in the place of references to them."""

    def shown(match: re.Match[str]) -> str:
        head, *rows = (f"| {' | '.join(row)} |\n" for row in cells(page.parent / match[1]))
        return "".join([head, f"|{'---|' * (head.count('|') - 1)}\n", *rows])

    return TABLE.sub(shown, page.read_text())
