"""The modules of the package import one another in one direction."""

import ast
import re
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest
from conftest import REPOSITORY

PACKAGE = REPOSITORY / "python" / "dynmesh"

WITH = {"sequence": ("metrics", "true_surface", "calibration", "matrices", "baselines")}
"""Modules that stand with another one."""


def layers() -> list[list[set[str]]]:
    """The parts of the package from low to high, as CONTRIBUTING.md states them in one line.

    Parts that stand side by side, in braces, are several sets of one layer.
    """
    text = (REPOSITORY / "CONTRIBUTING.md").read_text(encoding="utf-8")
    (line,) = re.findall("^core -> .*$", text, flags=re.MULTILINE)
    stated = [
        [{name, *WITH.get(name, ())} for name in re.findall(r"\w+", part)]
        for part in line.split("->")
    ]
    named = {part for layer in stated for parts in layer for part in parts}
    stated[0] = [{at_the_top(name) for name in modules()} - named - {"", "__main__"}]
    return stated


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
    """What each module imports, apart from itself.

    A sequence shows itself in a notebook as a page, which is drawn from sequences: when it is asked
    to, the one import against the direction.
    """
    files = modules()
    found = {name: set(imported_by(name, files)) - {name} for name in files}
    found["dynmesh.sequence"].remove("dynmesh.draw.notebook")
    return found


def at_the_top(name: str) -> str:
    """The part of the package that a module belongs to; "" for the package itself."""
    return name.split(".")[1] if "." in name else ""


def test_no_module_imports_itself_by_way_of_others(graph: dict[str, set[str]]) -> None:
    TopologicalSorter(graph).prepare()  # or a CycleError names the cycle


def test_no_part_imports_a_higher_one_or_one_beside_it(graph: dict[str, set[str]]) -> None:
    stated = layers()
    place = {
        part: (level, number)
        for level, layer in enumerate(stated)
        for number, parts in enumerate(layer)
        for part in parts
    }
    place |= {"": (len(stated), 0), "__main__": (len(stated) + 1, 0)}
    wrong = []
    for name, others in graph.items():
        level, number = place[at_the_top(name)]
        for other in others:
            other_level, other_number = place[at_the_top(other)]
            if other_level > level or (other_level == level and other_number != number):
                wrong.append(f"{name} imports {other}")
    assert wrong == []


def test_the_compiled_core_imports_errors_and_polygons_alone() -> None:
    sources = (REPOSITORY / "cpp" / "bindings").glob("*.cpp")
    found = [re.findall(r'import\("dynmesh\.(\w+)', source.read_text()) for source in sources]
    assert {module for modules in found for module in modules} == {"_errors", "polygons"}
