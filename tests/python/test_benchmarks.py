"""The benchmarks run and their tables are whole; the measurements are not tested."""

import csv
import importlib
import json
import re
import sys
from pathlib import Path
from typing import Any

import meshes
import numpy as np
import pytest
from conftest import REPOSITORY

import dynmesh
from benchmarks import harness, methods, methods_table
from benchmarks.baselines import BASELINES
from benchmarks.harness import Table
from benchmarks.speed import scenes
from benchmarks.speed.comparison import compare
from benchmarks.speed.plan import SpeedPlan
from dynmesh.study.methods import DETAIL, MOTION

Run = Any
"""A function that runs a benchmark with arguments, and returns the tables that it printed."""

DOCS = REPOSITORY / "docs"

SECTIONS = ("low-resolution", "subdivided", "largest", "sizes", "overhead", "latency")


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
    def start(name: str, *arguments: str | Path) -> list[list[list[str]]]:
        monkeypatch.setattr(sys, "argv", [name, *map(str, arguments)])
        importlib.import_module(f"benchmarks.{name}").main()
        found = tables(capsys.readouterr().out)
        for head, *rows in found:
            assert rows
            assert all(len(row) == len(head) for row in rows)
            assert "nan" not in str(rows)
        return found

    return start


@pytest.fixture
def compiled(programs: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    parts = programs / "benchmarks" / "cpp"
    if not (parts / "dynmesh-subjects.so").exists():
        pytest.skip("the C++ part is not built: cmake --preset develop; cmake --build ...")
    monkeypatch.setenv("DYNMESH_BENCHMARKS", str(parts))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a sheet that turns and bends, and a longer one."""
    made = tmp_path_factory.mktemp("sequences")
    mesh = meshes.sheet(9)
    for name, n in (("sheet", 12), ("long", 40)):
        frames = [meshes.turned(mesh.vertices, 0.05 * i) for i in range(n)]
        bent = np.stack(frames)
        bent[..., 2] += 0.1 * np.sin(np.arange(n))[:, None] * mesh.vertices[:, 0] ** 2 / 9
        dynmesh.write(made / f"{name}.npz", dynmesh.Sequence(bent.astype(np.float32), mesh.faces))
    return made


@pytest.mark.parametrize(
    ("name", "arguments", "sizes"),
    [
        ("calibration", "sheet --frames 8", [7, 2]),
        ("drift", "sheet --cycles 2", [4]),
        ("learning_table", "sheet:6", [5, 2]),
        ("learning_table", "sheet:6 --cycles 10", [11, 2]),
        ("nmsve_table", "sheet:4", [5]),
        ("whole_frame_table", "sheet:6", [5]),
        ("registration_table", "sheet:6 --scans whole half", [5, 3]),
        ("bidirectional_table", "sheet:6", [7]),
        ("tracking_calibration", "sheet --frames 4 --cameras 2 --training", [2]),
        ("tracking_gaps", "long --starts 2", [2]),
        ("tracking_poses", "sheet --cameras 2", [5]),
        ("tracking_table", "sheet:4 --cameras 1 --depth", [2]),
        ("tracking_table", "sheet:8 --frames 2 --training --baselines 1", [7, 2, 9]),
    ],
)
def test_a_table_is_whole(
    name: str, arguments: str, sizes: list[int], folder: Path, run: Run, tmp_path: Path
) -> None:
    if "baselines" in arguments:
        pytest.importorskip("trimesh")
    found = run(name, folder, *arguments.split(), "--csv", tmp_path)
    assert [len(table) for table in found] == sizes
    for path in tmp_path.iterdir():
        if (DOCS / "tables" / path.name).exists():
            assert head_of(path) == head_of(DOCS / "tables" / path.name)


def test_pairs_of_a_folder_are_registered(run: Run, tmp_path: Path) -> None:
    mesh = meshes.sheet(9)
    for name, suffix in (("man_src", "obj"), ("man_tar", "ply"), ("other", "obj")):
        frame = dynmesh.Sequence(mesh.vertices[None], mesh.faces)
        dynmesh.write(tmp_path / f"{name}.{suffix}", frame)
    ((_, row),) = run("registration_table", "--pairs", tmp_path)
    assert row[:4] == ["man_src.obj", "whole", "dynmesh", "-"]
    (tmp_path / "man_tar.ply").unlink()
    with pytest.raises(ValueError, match="has no pairs of files"):
        run("registration_table", "--pairs", tmp_path)


def test_the_table_of_costs_is_whole(run: Run) -> None:
    ((_, *rows),) = run("whole_frame_cost", "--sides", "8", "12", "--frames", "4")
    assert [row[:2] for row in rows] == [["64", "4"], ["144", "4"]]
    assert all(int(row[2]) > 0 for row in rows)


@pytest.mark.parametrize("part", ["detail", "error-bars", "tracking"])
@pytest.mark.usefixtures("compiled")
def test_constants_have_an_effect(part: str, folder: Path, run: Run) -> None:
    constant = {"detail": "pull", "error-bars": "averagings", "tracking": "iterations"}[part]
    few = ("--frames", "6", "--cameras", "2", "--constants")
    ((_, *rows),) = run("constants", part, folder, "sheet", *few, constant)
    numbers = [cell for row in rows for cell in row[2:]]
    assert len(set(numbers)) > 1
    assert all(float(number) > 0 for number in numbers)
    with pytest.raises(SystemExit):
        run("constants", part, folder, "sheet", *few, "nothing")


def test_the_table_of_methods_is_whole(folder: Path, run: Run, tmp_path: Path) -> None:
    pytest.importorskip("igl", reason="libigl is not installed")
    ((_, *errors),) = run("methods_table", folder, "sheet:4", "--csv", tmp_path)
    assert [row[1] for row in errors] == ["10 %", "30 %", "50 %", "70 %", "camera"]
    for row in errors[:-1]:  # the camera sees all of a sheet
        detail, *baselines = (cell.strip("*") for cell in row[3:])
        bold = [cell.startswith("**") for cell in row[4:]]
        assert bold == [float(baseline) < float(detail) for baseline in baselines]
    stored = list(csv.reader((tmp_path / "methods.csv").read_text().splitlines()))
    assert stored[1:] == [[cell.replace("**", "") for cell in row] for row in errors]


def test_the_tables_of_training_are_whole(folder: Path, run: Run) -> None:
    pytest.importorskip("igl", reason="libigl is not installed")
    losses = ["10 %", "30 %", "camera", "patches"]
    (_, *summary), (head, *rows) = run("training_table", folder, "sheet:8")
    assert [row[0] for row in summary] == ["sheet"]
    assert [row[1] for row in rows] == [loss for loss in losses for _ in range(3)]
    ((head, *rows),) = run("training_table", folder, "sheet:4", "--whole")
    assert [row[1] for row in rows] == losses
    trained = head.index("detail, trained")
    assert {row[trained] for row in rows} == {"-"}


@pytest.mark.usefixtures("coarse_figures")
def test_the_comparison_beyond_the_paper_is_whole(folder: Path, run: Run, tmp_path: Path) -> None:
    pytest.importorskip("igl", reason="libigl is not installed")
    (_, *rows), (_, *claims) = run("beyond", folder, "sheet:4", "--out", tmp_path)
    assert [row[0] for row in rows[-3:]] == [*(m.label for m in BASELINES), "motion, once only"]
    assert len(claims) == 6
    names = {path.stem for path in tmp_path.glob("*.png")}
    assert names == {path.stem for path in tmp_path.glob("*.svg")}
    assert names == {
        "figure12_camera_and_patches",
        "figure12_camera_sheet",
        "figure12_patches_sheet",
        "figure13_two_readings",
        "figure14_detail_and_libigl",
        "figure15_sheet",
    }
    verdict = {"claim": "a claim", "sequence": "sheet", "holds": True, "evidence": "1 > 0"}
    (tmp_path / "results.json").write_text(json.dumps({"claims": [verdict]}))
    assert run("claims", tmp_path) == [
        [["claim", "sheet"], ["a claim", "holds"]],
        [["claim", "sheet"], *claims],
    ]


@pytest.mark.usefixtures("compiled", "coarse_figures")
def test_the_tables_of_speed_are_whole(run: Run, tmp_path: Path) -> None:
    run("speed.__main__", "--tiny", "--csv", tmp_path, "--only", *SECTIONS)
    files = tmp_path.glob("*.csv")
    stored = {path.stem: list(csv.reader(path.read_text().splitlines())) for path in files}
    for part in ("low-resolution", "subdivided"):
        for kind, n in (("ratios", 5), ("errors", 3), ("detail", 5)):
            head, *rows = stored[f"{part}-{kind}"]
            assert head[1:] == ["10 %", "30 %", "50 %", "70 %", "camera", "patches"]
            # Threads and libigl are not there on every machine.
            own = [row for row in rows if not re.search("threads|libigl", row[0])]
            assert len(own) == n
            assert all(float(cell) > 0 for row in own for cell in row[1:])
    assert stored["numbering"][0][-1] == "ratio"
    figures = {path.name for path in tmp_path.glob("*.png")}
    assert figures == {path.name for path in (DOCS / "figures" / "speed").iterdir()}
    text = "".join(page.read_text() for page in DOCS.rglob("*.md"))
    assert re.findall(r"^<!-- (?!end)(.*) -->$", text, flags=re.MULTILINE) == ["machine"]
    shown = stored.keys() & {path.stem for path in (DOCS / "tables").iterdir()}
    assert len(shown) == 6
    for name in shown:  # the first column names the mesh
        assert head_of(DOCS / "tables" / f"{name}.csv")[1:] == stored[name][0][1:]


@pytest.mark.usefixtures("compiled")
def test_the_plain_implementation_has_the_same_errors() -> None:
    scene = scenes.low_resolution(SpeedPlan.smallest())
    found = compare(scene, 1, 0, {}, [MOTION, methods.PLAIN])
    assert len(found.runs) == 6
    assert found.errors("plain") == pytest.approx(found.errors("motion"), rel=1e-3)


def test_every_comparison_has_the_same_methods() -> None:
    everywhere = {MOTION, DETAIL, *BASELINES}
    for shown in (methods.ALL, methods_table.METHODS):
        assert everywhere <= set(shown)
        assert len({method.colour for method in shown}) == len(shown)


def test_tables_are_replaced_in_the_documentation(tmp_path: Path) -> None:
    (tmp_path / "tables").mkdir()
    (tmp_path / "tables" / "here.csv").write_text("old\n")
    for name in ("here", "nowhere"):
        harness.replace_in(tmp_path, Table(name, [("a", "b"), ("`c`", "**1**")], "a note"))
    (path,) = (tmp_path / "tables").iterdir()
    assert path.read_bytes() == b"a,b\nc,1\n"


def test_notes_are_replaced_in_the_documentation(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("<!-- here -->\nold\n<!-- end -->\n<!-- there -->\nkept\n<!-- end -->\n")
    harness.replace_in(tmp_path, Table("here", [], "new"))
    harness.replace_in(tmp_path, Table("nowhere", [], "new"))
    written = "<!-- here -->\nnew\n<!-- end -->\n<!-- there -->\nkept\n<!-- end -->\n"
    assert page.read_text() == written
    (tmp_path / "more.md").write_text("<!-- here -->\nold\n<!-- end -->\n")
    with pytest.raises(ValueError, match="2 places for here"):
        harness.replace_in(tmp_path, Table("here", [], "newer"))
    assert page.read_text() == written


@pytest.mark.usefixtures("compiled")
def test_a_frame_takes_no_more_instructions_than_recorded(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["speed", "--instructions"])
    with pytest.raises(SystemExit) as left:
        importlib.import_module("benchmarks.speed.__main__").main()
    told = capsys.readouterr().err
    if left.value.code == 2:  # no valgrind, or another compiler or processor
        pytest.skip(told.strip())
    assert left.value.code == 0, told + "script/bench --record-instructions accepts it"
