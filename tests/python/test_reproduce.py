"""The paper's evaluation, on a small sequence."""

import json
import re
from itertools import count
from pathlib import Path
from typing import Any

import meshes
import numpy as np
import pytest
from commands import dynmesh_command
from conftest import REPOSITORY
from PIL import Image

import dynmesh
from dynmesh.draw import figures
from dynmesh.study import charts, style
from dynmesh.study.sequence_study import Plan, study
from dynmesh.study.subjects import Subject

pytest.importorskip("pyvista")
pytest.importorskip("matplotlib")


def small_sequence() -> dynmesh.Sequence:
    mesh = meshes.sheet(9)
    frames = [meshes.turned(mesh.vertices, 0.05 * i) for i in range(9)]
    return dynmesh.Sequence(np.stack(frames).astype(np.float32), mesh.faces)


@pytest.mark.usefixtures("coarse_figures")
def test_the_results_of_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One test, as the results would otherwise be made once in every process that runs tests."""
    sequence = small_sequence()
    dynmesh.write(tmp_path / "sheet.npz", sequence)
    still = np.repeat(sequence.vertices[:1], 3, axis=0)
    dynmesh.write(tmp_path / "still.npz", dynmesh.Sequence(still, sequence.faces))
    results = tmp_path / "results"
    results.mkdir()  # an existing folder is fine
    monkeypatch.chdir(REPOSITORY / "docs" / "programs")
    monkeypatch.syspath_prepend(Path.cwd())  # which removes it again
    own = ("--method", "own_method:Hold", "--method", "dynmesh:Completer")  # which is detail
    dynmesh_command("reproduce", results, "--quick", "--data", tmp_path, *own)
    every_figure_is_there(results)
    the_numbers_are_those_of_the_library(results)
    the_report_stands_alone_and_judges_every_claim(results)


def test_ticks_of_logarithmic_axes_are_plain_numbers() -> None:
    with style.new_figure(4, 3) as figure:
        axis = figure.subplots()
        axis.set(yscale="log", ylim=(0.005, 2000))
        figure.draw_without_rendering()
        labels = [label.get_text() for label in axis.get_yticklabels()]
    numbers = [re.sub(r"\$\\mathdefault{(.*)}\$", r"\1", label) for label in labels]
    assert {"0.01", "0.1", "1", "10", "100", "1000"} <= set(numbers)


def every_figure_is_there(results: Path) -> None:
    names = {path.stem for path in results.glob("*.png")}
    assert names == {
        "figure7",
        "figure9",
        *(f"figure{n}_{name}" for n in (8, 10, 11) for name in ("sheet", "still")),
    }
    assert names == {path.stem for path in results.glob("*.svg")}


def the_numbers_are_those_of_the_library(results: Path) -> None:
    numbers = json.loads((results / "results.json").read_text())
    sheet = numbers["sequences"]["sheet"]
    assert (sheet["frames"], sheet["vertices"]) == (9, 81)
    sequence = small_sequence()
    masks = list(dynmesh.degrade.random_known(9, 81, 0.3, seed=0))
    completed = np.stack(
        list(dynmesh.complete(sequence.faces, sequence.vertices, masks, method="motion"))
    )
    error = dynmesh.metrics.nmsve(sequence.faces, sequence.vertices, completed)[1:]
    diagonal = np.linalg.norm(np.ptp(sequence.vertices[0].astype(float), axis=0))
    motion = sheet["grid"]["motion"]["0.3"]
    assert motion["nmsve_mean"] == pytest.approx(error.mean() / diagonal)
    assert motion["unknown_mean"] == 81 - 24
    smooth = [
        dynmesh.baselines.laplacian_interpolation(sequence.faces, points, known)
        for points, known in zip(sequence.vertices, masks, strict=True)
    ]
    lia = dynmesh.metrics.nmsve(sequence.faces, sequence.vertices, np.stack(smooth))[1:]
    assert sheet["grid"]["lia"]["0.3"]["nmsve_mean"] == pytest.approx(lia.mean() / diagonal)
    assert set(sheet["scenarios"]) == {"camera", "patches"}
    assert numbers["sequences"]["still"]["grid"]["motion"]["0.5"]["nmsve_mean"] == 0
    detailed = np.stack(
        list(dynmesh.complete(sequence.faces, sequence.vertices, masks, method="detail"))
    )
    detail = dynmesh.metrics.nmsve(sequence.faces, sequence.vertices, detailed)[1:]
    assert sheet["grid"]["detail"]["0.3"]["nmsve_mean"] == pytest.approx(detail.mean() / diagonal)
    assert set(sheet["grid"]["detail"]) == {"0.1", "0.3", "0.5", "0.7"}
    assert list(sheet["grid"])[-2:] == ["Hold", "Completer"]
    held = [sequence.vertices[0]]
    for points, known in zip(sequence.vertices[1:], masks[1:], strict=True):
        held.append(np.where(known[:, None], points, held[-1]))
    holding = dynmesh.metrics.nmsve(sequence.faces, sequence.vertices, np.stack(held))[1:]
    assert sheet["grid"]["Hold"]["0.3"]["nmsve_mean"] == pytest.approx(holding.mean() / diagonal)
    for ours, theirs in (
        (sheet["grid"]["Completer"], sheet["grid"]["detail"]),
        *(({"": of["Completer"]}, {"": of["detail"]}) for of in sheet["scenarios"].values()),
    ):
        for share, run in theirs.items():
            for measured in ("nmsve_mean", "nmsve_p90", "nmsve_last", "unknown_mean"):
                assert ours[share][measured] == run[measured]


def the_report_stands_alone_and_judges_every_claim(results: Path) -> None:
    page = (results / "report.html").read_text()
    assert not re.search(r"""(src|href)=["'](?!data:)""", page)
    assert page.count("data:image/png;base64,") == 8
    numbers = json.loads((results / "results.json").read_text())
    claims, of_detail = numbers["claims"], numbers["detail_claims"]
    assert len(claims) == 2 * 12
    assert len(of_detail) == 2 * 3
    for claim in (*claims, *of_detail):
        assert claim["evidence"]
        assert isinstance(claim["holds"], bool)
    judged = re.findall(r"<td>(?:holds|<b>does not hold</b>)</td>", page)
    assert len(judged) == len(claims) + len(of_detail)
    # The tables show NMSVE in units of 1e-4 diagonals; the JSON file has diagonals.
    run = numbers["sequences"]["sheet"]["grid"]["motion"]["0.1"]
    cell = f"{1e4 * run['nmsve_mean']:.3g}; {run['milliseconds_median']:.3g} ms"
    assert f"<td>motion (dynmesh)</td><td>{cell}</td>" in page
    for own in ("Hold", "Completer"):
        assert page.count(f"<td>{own}</td>") == 2
    assert "Completer" in (results / "figure9.svg").read_text()


def test_a_figure_is_wide_and_its_axes_show_nmsve_in_the_unit_of_the_tables(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn: list[Any] = []

    def save(figure: Any, *where: Any, **how: Any) -> Any:
        drawn.append(figure)
        return style.save(figure, *where, **how)

    monkeypatch.setattr(charts, "save", save)
    subject = Subject.of("sheet", small_sequence(), "z", 60.0, None)
    steps = count()
    done = study(subject, Plan.quick(), 0, lambda: next(steps))
    charts.figure9([done], tmp_path)
    (path,) = tmp_path.glob("*.png")
    with Image.open(path) as image:
        assert image.width >= 1200
        assert np.asarray(image.convert("L")).std() > 5
    assert path.stat().st_size < 300_000
    labelled = [axis for axis in drawn[0].axes if "NMSVE" in axis.get_ylabel()]
    assert len(labelled) == 2
    assert all(style.NMSVE_LABEL in axis.get_ylabel() for axis in labelled)
    errors = done.grid["motion", 0.3].nmsve
    by_share, _, along_frames = (axis.lines[0].get_ydata() for axis in drawn[0].axes)
    np.testing.assert_allclose(along_frames, 1e4 * errors)
    assert by_share[1] == pytest.approx(1e4 * errors.mean())
    assert next(steps) == Plan.quick().n_runs()


def test_pictures_show_what_they_should(mesh: meshes.Mesh) -> None:
    view = figures.View.of(mesh.vertices, "z", 60.0, (320, 240))

    def draw(**settings: Any) -> figures.Image:
        return figures.render(mesh.faces, mesh.vertices, view, **settings)

    plain = draw()
    assert plain.shape == (240, 320, 3)
    inked = np.any(plain < 250, axis=2)
    assert 0.2 < inked.mean() < 0.9
    rows, columns = np.flatnonzero(np.any(inked, axis=1)), np.flatnonzero(np.any(inked, axis=0))
    assert rows[0] > 0 < columns[0]  # framed: nothing touches the border
    assert rows[-1] < 239
    assert columns[-1] < 319

    k = len(mesh.vertices)
    all_known = draw(known=np.ones(k, bool)).astype(int)
    none_known = draw(known=np.zeros(k, bool)).astype(int)
    assert (all_known[..., 2] - all_known[..., 0])[inked].mean() > 50  # blue
    assert (none_known[..., 0] - none_known[..., 2])[inked].mean() > 50  # red
    low = draw(values=np.zeros(k), limit=1.0).astype(int)
    high = draw(values=np.ones(k), limit=1.0).astype(int)
    assert high[inked].sum() > 1.5 * low[inked].sum()

    cut = figures.cropped([plain, plain])
    assert cut[0].shape == cut[1].shape
    assert cut[0].shape[0] < 240
    np.testing.assert_array_equal(figures.cropped([np.full((4, 4, 3), 255, np.uint8)])[0], 255)
