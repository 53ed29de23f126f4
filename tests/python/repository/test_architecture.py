"""The parts of the package and of the C++ code use one another in one direction.

docs/architecture.md lists them.
"""

import ast
import re
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path
from typing import NamedTuple

import pytest
from conftest import REPOSITORY

PACKAGE = REPOSITORY / "python" / "dynmesh"
CPP = REPOSITORY / "cpp"


class Place(NamedTuple):
    """Where a part stands in the list; divided rows that follow one another are a block."""

    row: int
    block: int
    column: int

    def may_use(self, other: "Place") -> bool:
        """Whether what stands here may use what stands there: itself, or below and not beside."""
        is_beside = self.block == other.block and self.column != other.column
        return self == other or (other.row > self.row and not is_beside)


def places(root: str) -> dict[str, Place]:
    """The place of each part below a folder."""
    text = (REPOSITORY / "docs" / "architecture.md").read_text(encoding="utf-8")
    (layers,) = re.findall(rf"^\*\*`{root}`\*\*.*\n\n((?:- .*\n)+)", text, re.MULTILINE)
    found, block = dict[str, Place](), 0
    rows = [row.split("|") for row in re.findall(r"^- `(.*?)`", layers, re.MULTILINE)]
    for row, cells in enumerate(rows):
        block += len(cells) == 1 or len(rows[row - 1]) == 1
        for column, cell in enumerate(cells):
            for part in re.findall(r"\w+", cell):
                assert part not in found, part
                found[part] = Place(row, block, column)
    return found


def misplaced(graph: dict[str, set[str]], place: dict[str, Place]) -> list[str]:
    """What uses a part that the list does not let it use."""
    return [
        f"{name} uses {other}"
        for name, others in graph.items()
        for other in others
        if not place[name].may_use(place[other])
    ]


def modules() -> dict[str, Path]:
    """The files of all modules by their dotted names."""
    found = {}
    for file in sorted([*PACKAGE.rglob("*.py"), *PACKAGE.rglob("*.pyi")]):
        *parts, last = file.relative_to(PACKAGE.parent).with_suffix("").parts
        found[".".join(parts if last == "__init__" else [*parts, last])] = file
    return found


def imported_by(name: str, modules: dict[str, Path]) -> Iterator[str]:
    """The modules of the package that a module imports, wherever in its text."""
    file = modules[name]
    here = name.split(".") if file.stem == "__init__" else name.split(".")[:-1]
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in modules)
        elif isinstance(node, ast.ImportFrom):
            parents = here[: len(here) - node.level + 1] if node.level else []
            base = ".".join([*parents, *([node.module] if node.module else [])])
            for alias in node.names:
                inner = f"{base}.{alias.name}"
                found = inner if inner in modules else base
                if found in modules:
                    yield found


@pytest.fixture(scope="module")
def graph() -> dict[str, set[str]]:
    """What each module imports, apart from itself."""
    files = modules()
    return {name: set(imported_by(name, files)) - {name} for name in files}


def at_the_top(name: str) -> str:
    """The part of the package that a module belongs to; "" for the package itself."""
    return name.split(".")[1] if "." in name else ""


def test_no_module_imports_itself_by_way_of_others(graph: dict[str, set[str]]) -> None:
    TopologicalSorter(graph).prepare()  # or a CycleError names the cycle


def test_no_part_of_the_package_imports_a_higher_one_or_one_beside_it(
    graph: dict[str, set[str]],
) -> None:
    place = places("python/dynmesh")
    core = place.pop("core")
    parts = {at_the_top(name) for name in graph}
    assert place.keys() <= parts
    place = dict.fromkeys(parts, core) | place
    place |= {"": Place(-1, -1, 0), "__main__": Place(-2, -2, 0)}
    by_module = {name: place[at_the_top(name)] for name in graph}
    assert misplaced(graph, by_module) == []


def test_no_folder_of_cpp_includes_a_higher_one_or_one_beside_it() -> None:
    folders = {path.name: path for path in (CPP / "src").iterdir()}
    folders |= {name: CPP / name for name in ("apps", "bindings")}
    place = places("cpp/src")
    assert folders.keys() == place.keys()
    includes = {}
    for name, folder in folders.items():
        texts = [file.read_text() for file in folder.glob("*.[ch]pp")]
        assert texts, name
        found = {one for text in texts for one in re.findall(r'^#include "(\w+)/', text, re.M)}
        includes[name] = found - {name}
    assert misplaced(includes, place) == []
    TopologicalSorter(includes).prepare()


@pytest.mark.parametrize(
    ("header", "folder"), [("<OpenMesh/", "mesh"), ("<dynmesh/dynmesh.h>", "c")]
)
def test_one_folder_alone_includes_openmesh_or_the_c_interface(header: str, folder: str) -> None:
    including = {path.parent.name for path in CPP.rglob("*.?pp") if header in path.read_text()}
    assert including == {folder}
