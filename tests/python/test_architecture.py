"""The modules of the package import one another in one direction."""

import ast
import re
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest
from conftest import REPOSITORY

PACKAGE = REPOSITORY / "python" / "dynmesh"

LAYERS = (
    ("_settings", "_core", "_checks", "_errors", "_extras", "polygons", "settings", "attributes"),
    ("sequence", "metrics", "calibration", "matrices", "baselines"),
    ("files",),
    ("scans",),
    ("degrade", "synth", "whole_frames", "registration"),
    ("draw",),
    ("diagnosis",),
    ("jobs",),
    ("cli",),
)
"""The parts of the package from low to high, at its top but for one; above all are `__init__` and
`__main__`. Imports in functions count like all others."""


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


def level_of(name: str) -> int:
    """The number of the layer of a module, by the longest name of a part that it begins with."""
    parts = {f"dynmesh.{part}": number for number, names in enumerate(LAYERS) for part in names}
    parts |= {"dynmesh": len(LAYERS), "dynmesh.__main__": len(LAYERS) + 1}
    return max(
        (len(part), level) for part, level in parts.items() if f"{name}.".startswith(f"{part}.")
    )[1]


def test_no_part_imports_a_higher_one(graph: dict[str, set[str]]) -> None:
    listed = {part for parts in LAYERS for part in parts if "." not in part}
    assert {at_the_top(name) for name in graph} == listed | {"", "__main__"}
    upwards = [
        f"{name} imports {other}"
        for name, others in graph.items()
        for other in others
        if level_of(other) > level_of(name)
    ]
    assert upwards == []


def test_the_compiled_core_imports_errors_and_polygons_alone() -> None:
    sources = (REPOSITORY / "cpp" / "bindings").glob("*.cpp")
    found = [re.findall(r'import\("dynmesh\.(\w+)', source.read_text()) for source in sources]
    assert {module for modules in found for module in modules} == {"_errors", "polygons"}
