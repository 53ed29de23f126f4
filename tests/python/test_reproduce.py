"""What script/reproduce makes, on a small sequence; the measurements are not tested."""

import csv
import sys
from collections.abc import Callable
from pathlib import Path

import meshes
import numpy as np
import pytest
from numpy.typing import NDArray

import dynmesh
from benchmarks import __main__ as benchmarks
from benchmarks.methods import BASELINES, COMPARED, LIA, LSM, MOTION, ONCE
from benchmarks.paper.claims import verdicts
from benchmarks.paper.study import study
from benchmarks.subjects import Subject

pytestmark = pytest.mark.slow

N = 9


def frames() -> NDArray[np.float32]:
    """A sheet that turns, (9, 81, 3)."""
    vertices = meshes.sheet(9).vertices
    return np.stack([meshes.turned(vertices, 0.05 * i) for i in range(N)]).astype(np.float32)


@pytest.mark.usefixtures("coarse_figures")
def test_the_figures_and_tables_of_the_paper(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("igl", reason="libigl is not installed")
    faces, vertices = meshes.sheet(9).faces, frames()
    dynmesh.write(tmp_path / "sheet.npz", dynmesh.Sequence(vertices, faces))
    out = tmp_path / "out"
    arguments = ["paper", str(tmp_path), "sheet", "--quick", "--out", str(out)]
    monkeypatch.setattr(sys, "argv", ["script/reproduce", *arguments])
    benchmarks.main()
    assert {path.stem for path in out.glob("*.png")} == {
        "figure7",
        "figure9",
        "figure13_two_readings",
        "figure14_detail_and_libigl",
        *(f"figure{which}_sheet" for which in ("8", "10", "11", "12_camera", "12_patches", "15")),
    }

    (head, *rows), (_, *claims) = (
        list(csv.reader((out / f"{name}.csv").read_text().splitlines()))
        for name in ("sheet", "claims-recorded")
    )
    assert head == ["method", "10 % known", "30 %", "50 %", "70 %", "camera", "patches"]
    assert [row[0] for row in rows] == [m.label for m in (*COMPARED, *BASELINES, ONCE)]
    assert {verdict for _, verdict in claims} == {"holds", "does not hold"}
    # Independent of the code: the error of two methods by the functions of the package.
    masks = list(dynmesh.degrade.random_known(N, 81, 0.3, seed=0))
    completed = {
        "motion (dynmesh)": dynmesh.complete(faces, vertices, masks, method="motion"),
        "LIA, least squares": (
            dynmesh.baselines.laplacian_interpolation(faces, points, known)
            for points, known in zip(vertices, masks, strict=True)
        ),
    }
    diagonal = np.linalg.norm(np.ptp(vertices[0].astype(float), axis=0))
    printed = capsys.readouterr().out
    for label, made in completed.items():
        nmsve = dynmesh.metrics.nmsve(faces, vertices, np.stack(list(made)))[1:]
        (cell,) = (row[2] for row in rows if row[0] == label)
        assert cell.split(";")[0] == f"{1e4 * nmsve.mean() / diagonal:.3g}"
        assert f"| {label} |" in printed


def test_claims_follow_from_the_numbers() -> None:
    subject = Subject("sheet", frames(), meshes.sheet(9).faces, "z", 60.0)
    done = study(subject, quick=True)

    def with_errors(**factors: float) -> dict[str, bool]:
        for method, factor in ((MOTION, 1), (LIA, factors["lia"]), (LSM, factors["lsm"])):
            for run in done.losses(method).values():
                run.nmsve[:] = 1e-5 * factor
        return verdicts(done)

    similar = "LIA and LSM have similar errors (within a factor of 1.5)."
    better = "Motion is more accurate than LSM at every share of known vertices."
    loses = next(claim for claim in verdicts(done) if claim.startswith("LIA loses detail"))
    found = with_errors(lia=3, lsm=4)
    assert (found[similar], found[better], found[loses]) == (True, True, True)
    found = with_errors(lia=1.5, lsm=0.9)
    assert (found[similar], found[better], found[loses]) == (False, False, False)

    linear = "Time increases linearly with the number of unknown vertices (R² above 0.9)."
    real = "Fast enough for real time (16 ms a frame)."

    def with_times(seconds: Callable[[float], float]) -> dict[str, bool]:
        for run in done.sweep.values():
            run.seconds[:] = [1e-4 * seconds(n) for n in run.unknown]
        return verdicts(done)

    assert with_times(float)[linear]
    assert with_times(float)[real]
    assert not with_times(np.exp)[linear]
    assert not with_times(np.exp)[real]
