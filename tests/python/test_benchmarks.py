"""The benchmarks run and their tables are complete; the measurements are not tested."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from conftest import REPOSITORY

PAGE = REPOSITORY / "docs" / "speed.md"
OTHERS = {"ocean", "crane", "ocean_sim_50x50", "methods", "claims", "training", "whole"}
"""The tables of docs/reference/measurements.md that docs/results.md refers to."""
SECTIONS = (
    "low-resolution",
    "subdivided",
    "largest",
    "training",
    "sizes",
    "unknown",
    "overhead",
    "latency",
)


def benchmarks(
    programs: Path, *arguments: str | Path, module: str = "benchmarks"
) -> subprocess.CompletedProcess[str]:
    """Runs them as script/bench does."""
    parts = programs / "benchmarks" / "cpp"
    if not (parts / "dynmesh-subjects.so").exists():
        pytest.skip("the C++ part is not built: cmake --preset develop; cmake --build ...")
    command = [sys.executable, "-m", module, *map(str, arguments)]
    environment = os.environ | {"DYNMESH_BENCHMARKS": str(parts)}
    return subprocess.run(
        command, cwd=REPOSITORY, env=environment, capture_output=True, text=True, check=False
    )


@pytest.fixture(scope="module")
def measured(programs: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run on small meshes."""
    folder = tmp_path_factory.mktemp("measured")
    result = benchmarks(programs, "--tiny", "--out", folder, "--only", *SECTIONS)
    assert result.returncode == 0, result.stderr
    return folder


def named_tables(text: str) -> dict[str, list[list[str]]]:
    """Returns the cells of each table, starting with the header."""
    parts = re.split(r"^\*\*(.*)\*\*$", text, flags=re.MULTILINE)[1:]
    named = zip(parts[::2], parts[1::2], strict=True)
    return {
        name: [[cell.strip() for cell in row.split("|")[1:-1]] for row in rows if "---" not in row]
        for name, part in named
        if (rows := re.findall(r"^\|.*\|$", part, flags=re.MULTILINE))
    }


def is_number(cell: str) -> bool:
    """Whether a cell is a positive number, bold or not."""
    return re.fullmatch(r"(\*\*)?\d+(\.\d+)?(e-\d+)?(\*\*)?", cell) is not None


def test_tables_are_whole(measured: Path) -> None:
    tables = named_tables((measured / "tables.md").read_text())
    for name, (head, *rows) in tables.items():
        assert rows, name
        assert all(len(row) == len(head) for row in rows), name
        assert not re.search("nan|inf", str(rows)), name
    for part in ("low-resolution", "subdivided"):
        for kind in ("ratios", "errors", "detail"):
            head, *rows = tables[f"{part}-{kind}"]
            assert head[1:] == ["10 %", "30 %", "50 %", "70 %", "camera", "patches"]
            # Results with threads and libigl are dashes on machines without them.
            own = [r for r in rows if not re.search("threads|libigl", r[0])]
            assert len(own) == {"ratios": 5, "errors": 3, "detail": 5}[kind]
            assert all(is_number(cell) for row in own for cell in row[1:])
    head, *rows = tables["training-speed"]
    assert head[1:] == ["10 %", "30 %", "50 %", "70 %", "camera", "patches"]
    assert rows[0][0] == "time of detail, trained, times detail"
    assert all(is_number(cell) for row in rows for cell in row[1:])
    assert tables["numbering"][0][-1] == "ratio"
    assert all(is_number(r[-1]) for r in tables["numbering"][1:] if "threads" not in r[2])
    assert all(is_number(cell) for row in tables["latency"][1:] for cell in row[4:])


def test_the_plain_implementation_has_the_same_errors(measured: Path) -> None:
    rows: list[dict[str, Any]] = json.loads((measured / "results.json").read_text())["comparison"]
    natural = [row for row in rows if row["numbering"] == "natural"]
    nmsve = {(row["part"], row["mask"], row["method"]): row["nmsve"] for row in natural}
    pairs = [(part, mask) for part, mask, method in nmsve if method == "motion"]
    assert len(pairs) == 18
    for part, mask in pairs:
        plain = nmsve[part, mask, "plain"]
        assert nmsve[part, mask, "motion"] == pytest.approx(plain, rel=1e-3)


def test_tables_and_figures_come_from_the_stored_run_too(measured: Path, programs: Path) -> None:
    again = measured / "again"
    result = benchmarks(programs, "--results", measured / "results.json", "--out", again)
    assert result.returncode == 0, result.stderr
    assert (again / "tables.md").read_text() == (measured / "tables.md").read_text()
    figures = {path.name for path in again.glob("*.png")}
    assert figures == {path.name for path in (REPOSITORY / "docs/figures/speed").iterdir()}


def test_the_page_has_a_place_for_each_table(measured: Path) -> None:
    more = REPOSITORY / "docs" / "reference" / "measurements.md"
    text = PAGE.read_text() + more.read_text()
    found = re.findall(r"^<!-- (?!end)(.*) -->$", text, flags=re.MULTILINE)
    places = [place for place in found if place not in OTHERS]
    named = re.findall(r"^\*\*(.*)\*\*$", (measured / "tables.md").read_text(), re.MULTILINE)
    program = "from benchmarks.page import LONG; print(*LONG)"
    command = [sys.executable, "-c", program]
    listed = subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True, check=True)
    assert sorted(places) == sorted({*named, "instructions"} - set(listed.stdout.split()))


def test_every_method_of_the_study_that_the_paper_lacks_is_benchmarked() -> None:
    program = """
from dynmesh.study.methods import MOTION
from dynmesh.study.baselines import BEYOND
from benchmarks import methods, methods_table
everywhere = {MOTION, *BEYOND}
assert everywhere <= set(methods.ALL)
assert everywhere - set(methods_table.OTHERS) == {methods_table.MOTION, methods_table.DETAIL}
for shown in (methods.ALL, methods_table.OTHERS):
    assert len({method.colour for method in shown}) == len(shown)
"""
    command = [sys.executable, "-c", program]
    subprocess.run(command, cwd=REPOSITORY, check=True)


def test_a_frame_takes_no_more_instructions_than_recorded(programs: Path) -> None:
    result = benchmarks(programs, "--instructions")
    if result.returncode == 2:  # no valgrind, or another compiler or processor
        pytest.skip(result.stderr.strip())
    assert result.returncode == 0, result.stderr + "script/bench --record-instructions accepts it"


def test_the_constants_of_tracking_have_an_effect(programs: Path) -> None:
    few = ("--frames", "2", "--cameras", "1", "--constants")
    result = benchmarks(programs, *few, "pull", "steps", module="benchmarks.tracking_constants")
    assert result.returncode == 0, result.stderr
    rows = [line.split("|")[1:-1] for line in result.stdout.splitlines()[2:]]
    assert [row[0].strip() for row in rows] == ["`pull`", "`steps`"]
    assert all(float(cell) > 0 for row in rows for cell in row[1:])
    assert any(float(cell) != 1 for row in rows for cell in row[2:])
    unknown = benchmarks(programs, *few, "nothing", module="benchmarks.tracking_constants")
    assert "there is no constant nothing" in unknown.stderr
