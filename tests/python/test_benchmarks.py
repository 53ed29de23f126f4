"""The benchmarks run and their tables are whole; the measurements are not tested."""

import csv
import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import meshes
import numpy as np
import pytest
from conftest import REPOSITORY

import dynmesh
from benchmarks import __main__ as benchmarks
from benchmarks import instructions, speed
from benchmarks.subjects import from_file, losses

pytestmark = pytest.mark.slow

Run = Any
"""A function that runs a benchmark with arguments, and returns the tables that it printed."""

DOCS = REPOSITORY / "docs"


def tables(text: str) -> list[list[list[str]]]:
    """Returns the cells of each table, starting with the header."""
    found = re.findall(r"(?:^\|.*\|$\n?)+", text, flags=re.MULTILINE)
    return [
        [[c.strip() for c in row.split("|")[1:-1]] for row in part.splitlines() if "---" not in row]
        for part in found
    ]


def head_of(table: Path) -> list[str]:
    """Returns the names of the columns of a CSV file."""
    with table.open(newline="") as file:
        return next(csv.reader(file))


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    def start(*arguments: str | Path) -> list[list[list[str]]]:
        monkeypatch.setattr(sys, "argv", ["script/reproduce", *map(str, arguments)])
        benchmarks.main()
        found = tables(capsys.readouterr().out)
        for head, *rows in found:
            assert rows
            assert all(len(row) == len(head) for row in rows)
            assert "nan" not in str(rows)
        return found

    return start


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a sheet that turns and bends."""
    made = tmp_path_factory.mktemp("sequences")
    mesh = meshes.sheet(9)
    frames = np.stack([meshes.turned(mesh.vertices, 0.05 * i) for i in range(12)])
    frames[..., 2] += 0.1 * np.sin(np.arange(12))[:, None] * mesh.vertices[:, 0] ** 2 / 9
    dynmesh.write(made / "sheet.npz", dynmesh.Sequence(frames.astype(np.float32), mesh.faces))
    return made


@pytest.mark.parametrize(
    ("name", "arguments", "sizes"),
    [
        ("two-readings", "sheet:4", [5]),
        ("drift", "sheet:6 --known 0.1 0.3", [7]),
        ("methods", "sheet:4", [6]),
        ("training", "sheet:8", [2]),
        ("learning", "sheet:6", [2]),
        ("calibration", "sheet --frames 8", [2]),
        ("whole-frame", "sheet:6", [5]),
        ("both-sides", "sheet:6", [7]),
        ("registration", "sheet:6 --scans whole half", [5, 3]),
        ("tracking", "sheet:4 --cameras 1 --depth", [2]),
        ("tracking", "sheet:8 --frames 2 --training --baselines 1", [7, 2, 9]),
    ],
)
def test_a_table_is_whole(
    name: str, arguments: str, sizes: list[int], folder: Path, run: Run, tmp_path: Path
) -> None:
    if name == "methods":
        pytest.importorskip("igl", reason="libigl is not installed")
    found = run(name, folder, *arguments.split(), "--out", tmp_path)
    assert [len(table) for table in found] == sizes
    for path in tmp_path.iterdir():
        if (DOCS / "tables" / path.name).exists():
            assert head_of(path) == head_of(DOCS / "tables" / path.name)


@pytest.mark.usefixtures("coarse_figures")
def test_the_tables_of_speed_are_whole(folder: Path, tmp_path: Path) -> None:
    subject = from_file(folder / "sheet.npz")
    found = speed.compare(subject, losses(subject), 2, 2, speed.ON_ONE_THREAD)
    for head, *rows in (speed.ratios(found), speed.errors(found)):
        assert head[1:] == ("10 %", "30 %", "50 %", "70 %", "camera", "patches")
        assert all(float(cell) > 0 for row in rows for cell in row[1:])
    plan = replace(speed.QUICK, frames=6, grids=(5, 8, 10))
    (table,) = speed.sizes(plan, [tmp_path])
    assert table.lines[0][1:-1] == ("25", "64", "100")
    speed._draw_error_and_time(found, [tmp_path])
    figures = {path.name for path in tmp_path.glob("*.png")}
    assert figures == {path.name for path in (DOCS / "figures" / "speed").iterdir()}


def test_a_frame_takes_no_more_instructions_than_recorded(
    programs: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("DYNMESH_BENCHMARKS", str(programs / "benchmarks" / "cpp"))
    code = instructions.main(record=False)
    told = "".join(capsys.readouterr())
    if code == 2:  # no valgrind, or another compiler or processor
        pytest.skip(f"instructions are counted elsewhere: {told.strip()}")
    assert code == 0, told + "script/bench --instructions record accepts it"
