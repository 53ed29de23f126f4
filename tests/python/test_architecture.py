"""The modules of the package import one another in one direction."""

import ast
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

from conftest import REPOSITORY

PACKAGE = REPOSITORY / "python" / "dynmesh"

LAYERS = (
    ("_settings", "_core", "_checks", "_errors", "_extras", "settings"),
    ("polygons", "sequence", "metrics", "calibration", "matrices", "baselines"),
    ("degrade", "synth", "files", "streaming"),
    ("diagnosis", "draw"),
    ("jobs",),
    ("study",),
    ("cli",),
)
"""What is at the top of the package, from low to high; `__init__` and `__main__` are above all."""

MOST_AT_THE_TOP = 19

SHOWING = {
    ("dynmesh.sequence", "plot"): "dynmesh.draw.plot",
    ("dynmesh.sequence", "_repr_html_"): "dynmesh.draw.notebook",
}
"""Methods that show their object, and the one higher module that each imports when it is called.

Notebooks and users expect these methods in the class itself. Nothing else of a low layer may
depend on drawing: the imports count as imports anywhere else, even in the same module. The
compiled `Completer` asks dynmesh.draw.notebook for its words in the same way.
"""


def modules_in(package: Path) -> dict[str, Path]:
    """The files of all modules by their dotted names."""
    found = {}
    for file in sorted([*package.rglob("*.py"), *package.rglob("*.pyi")]):
        *parts, last = file.relative_to(package.parent).with_suffix("").parts
        found[".".join(parts if last == "__init__" else [*parts, last])] = file
    return found


def by_method(node: ast.AST, method: str = "") -> Iterator[tuple[str, ast.AST]]:
    """All parts of a module, each with the method of a class that contains it, or ""."""
    for child in ast.iter_child_nodes(node):
        inside = isinstance(node, ast.ClassDef) and isinstance(child, ast.FunctionDef)
        within = child.name if inside and isinstance(child, ast.FunctionDef) else method
        yield within, child
        yield from by_method(child, within)


def imported_by(name: str, modules: dict[str, Path]) -> Iterator[str]:
    """The modules of the package that a module imports, wherever in its text."""
    file = modules[name]
    here = name.split(".") if file.stem == "__init__" else name.split(".")[:-1]
    for method, node in by_method(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in modules)
        elif isinstance(node, ast.ImportFrom):
            parents = here[: len(here) - node.level + 1] if node.level else []
            base = ".".join([*parents, *([node.module] if node.module else [])])
            for alias in node.names:
                inner = f"{base}.{alias.name}"
                found = inner if inner in modules else base
                if found in modules and SHOWING.get((name, method)) != found:
                    yield found


def cycle_in(package: Path) -> list[str]:
    """A cycle of imports, or nothing."""
    modules = modules_in(package)
    graph = {name: set(imported_by(name, modules)) - {name} for name in modules}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def at_the_top(name: str) -> str:
    """The part of the package that a module belongs to; "" for the package itself."""
    return name.split(".")[1] if "." in name else ""


def test_no_module_imports_itself_by_way_of_others() -> None:
    assert cycle_in(PACKAGE) == []


def test_a_cycle_would_be_found(tmp_path: Path) -> None:
    package = tmp_path / "dynmesh"
    (package / "inner").mkdir(parents=True)
    (package / "__init__.py").touch()
    (package / "inner" / "__init__.py").write_text("from ..b import x\n")
    (package / "a.py").write_text("def late():\n    from . import inner\n")
    (package / "b.py").write_text("import dynmesh.a\n")
    assert set(cycle_in(package)) == {"dynmesh.a", "dynmesh.b", "dynmesh.inner"}


def test_only_the_methods_that_show_are_excused(tmp_path: Path) -> None:
    package = tmp_path / "dynmesh"
    (package / "draw").mkdir(parents=True)
    for file in ("__init__", "draw/__init__", "draw/plot", "draw/notebook"):
        (package / f"{file}.py").touch()
    text = "class Sequence:\n    def {}(self):\n        from .draw import {}\n"
    for method, module, excused in (
        ("plot", "plot", True),
        ("plot", "notebook", False),
        ("size", "plot", False),
    ):
        (package / "sequence.py").write_text(text.format(method, module))
        found = list(imported_by("dynmesh.sequence", modules_in(package)))
        assert found == ([] if excused else [f"dynmesh.draw.{module}"])
    (package / "sequence.py").write_text("def plot():\n    from .draw import plot\n")
    assert list(imported_by("dynmesh.sequence", modules_in(package))) == ["dynmesh.draw.plot"]


def test_the_methods_that_show_import_what_they_are_excused_for() -> None:
    modules = modules_in(PACKAGE)
    for (name, method), module in SHOWING.items():
        text = modules[name].read_text(encoding="utf-8")
        imports = [
            node.module
            for within, node in by_method(ast.parse(text))
            if within == method and isinstance(node, ast.ImportFrom)
        ]
        assert imports == [module.removeprefix("dynmesh.")]


def test_no_part_imports_a_higher_one() -> None:
    level = {part: number for number, parts in enumerate(LAYERS) for part in parts}
    level |= {"": len(LAYERS), "__main__": len(LAYERS) + 1}
    modules = modules_in(PACKAGE)
    assert {at_the_top(name) for name in modules} == level.keys()
    upwards = [
        f"{name} imports {other}"
        for name in modules
        for other in imported_by(name, modules)
        if level[at_the_top(other)] > level[at_the_top(name)]
    ]
    assert upwards == []


def test_the_top_of_the_package_stays_small() -> None:
    parts = {at_the_top(name) for name in modules_in(PACKAGE)}
    assert len(parts - {"", "__main__", "_core", "_settings"}) <= MOST_AT_THE_TOP
