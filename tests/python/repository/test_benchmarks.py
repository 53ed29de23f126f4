"""What script/reproduce and script/dev/bench make of a small sequence; no time is tested."""

import re
import sys
from pathlib import Path
from typing import Any

import meshes
import numpy as np
import pytest
from documents import DOCS, cells

import dynmesh
from benchmarks import __main__ as benchmarks
from benchmarks import speed
from benchmarks.methods import ARAP, ARAP_FROM_PREVIOUS, BASELINES, BIHARMONIC, COMPARED, ONCE

pytestmark = pytest.mark.slow

Run = Any
"""A function that runs a benchmark with arguments, and returns the tables that it printed."""


def tables(text: str) -> list[list[list[str]]]:
    """Returns the cells of each table, starting with the header."""
    found = re.findall(r"(?:^\|.*\|$\n?)+", text, flags=re.MULTILINE)
    return [
        [[c.strip() for c in row.split("|")[1:-1]] for row in part.splitlines() if "---" not in row]
        for part in found
    ]


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
        ("drift", "sheet:6 --known 0.1 0.3", [7]),
        ("methods", "sheet:4", [6]),
        ("training", "sheet:8", [2]),
        ("learning", "sheet:6", [2]),
        ("calibration", "sheet --frames 8", [2]),
        ("whole-frame", "sheet:6", [5]),
        ("both-sides", "sheet:6", [7]),
        ("tracking", "sheet:4 --cameras 1 --frames 2", [5]),
        ("tracking-resolutions", "sheet:4 --cameras 1", [2]),
        ("tracking-colours", "sheet:4 --cameras 1", [2]),
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
            assert cells(path)[0] == cells(DOCS / "tables" / path.name)[0]


def test_the_table_of_speed_is_whole() -> None:
    head, *rows = speed.sizes((5, 8, 10)).lines
    assert head[1:-1] == ("25", "64", "100")
    assert all(float(cell) > 0 for row in rows for cell in row[1:-1])


@pytest.mark.usefixtures("coarse_figures")
def test_the_figures_and_tables_of_the_paper(run: Run, folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    run("paper", folder, "sheet", "--quick", "--out", out)
    assert {path.stem for path in out.glob("*.webp")} == {
        "figure7",
        "figure9",
        "figure14_detail_and_libigl",
        *(f"figure{which}_sheet" for which in ("8", "10", "11")),
    }

    (head, *rows), (_, *claims) = (
        cells(out / f"{name}.csv") for name in ("sheet", "claims-recorded")
    )
    assert head == ["method", "10 % known", "30 %", "50 %", "70 %", "camera", "patches"]
    assert [row[0] for row in rows] == [m.label for m in (*COMPARED, *BASELINES, ONCE)]
    assert {verdict for _, verdict in claims} == {"holds", "does not hold"}


def baselines(mesh: meshes.Mesh) -> dict[str, Any]:
    pytest.importorskip("igl", reason="libigl is not installed")
    faces, first = mesh.faces, mesh.vertices
    return {
        "biharmonic": BIHARMONIC.begin(faces, first),
        "arap": ARAP.begin(faces, first),
        "arap from previous": ARAP_FROM_PREVIOUS.begin(faces, first),
    }


def test_known_vertices_stay_as_given_and_the_rest_is_not_read(rng: np.random.Generator) -> None:
    mesh = meshes.sheet(8)
    for name, baseline in baselines(mesh).items():
        close = 0.2 if "arap" in name else 1e-9  # libigl stops ARAP after ten iterations
        for n in (1, 2):
            known = rng.random(len(mesh.vertices)) < 0.4
            moved = mesh.vertices + np.array([n, 0, 0])
            points = np.where(known[:, None], moved, np.nan)
            completed, _ = baseline(points, known)
            np.testing.assert_array_equal(completed[known], points[known], err_msg=name)
            np.testing.assert_allclose(completed, moved, atol=close, err_msg=name)
