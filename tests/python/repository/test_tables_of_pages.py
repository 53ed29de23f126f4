"""The figures in the documentation are those of its tables and of the code."""

import re

import numpy as np
from conftest import REPOSITORY
from documents import DOCS, README, TABLE, cells

RIVALS = (
    "biharmonic on motion (libigl)",
    "ARAP (libigl)",
    "ARAP from the previous frame (libigl)",
)


def errors_of_methods() -> dict[tuple[str, str], dict[str, float]]:
    """The errors of the table of methods, relative to that of motion, by sequence and loss."""
    (_, _, of_motion, *methods), *measured = cells(DOCS / "tables" / "methods.csv")
    assert of_motion == "motion, x 1e4"
    return {
        (sequence.partition(",")[0], known): dict(
            zip(["motion", *methods], map(float, values), strict=True)
        )
        for sequence, known, *values in measured
        if sequence != "crane, 80 frames"
    }


def as_number(cell: str) -> float:
    return np.inf if cell == "-" else float(cell)


def test_the_table_of_the_readme_is_that_of_the_results() -> None:
    names = {
        "person": "crane",
        "horse": "horse_gallop",
        "face": "ict_face_arkit",
        "sea": "ocean_sim_50x50",
        "flag": "flag_sim_50x50",
    }
    errors = errors_of_methods()
    (_, *losses), *measured = cells(DOCS / "tables" / "crane.csv")
    times = {
        (row[0], loss): cell.split("; ")[1].removesuffix(" ms")
        for row in measured
        for loss, cell in zip(losses, row[1:], strict=True)
        if cell != "-"
    }
    built_in = {(row[0], row[1]): row[2:] for row in cells(DOCS / "tables/rivals-completion.csv")}
    timed = ("detail (dynmesh)", "motion (dynmesh)", RIVALS[0], RIVALS[1])
    checked = 0
    for line in re.findall(r"^\| (.*) \|$", README, flags=re.MULTILINE):
        case, *shown = (cell.strip() for cell in line.split("|"))
        subject, _, loss = case.rpartition(", ")
        if subject in names:
            row = errors[
                names[subject], loss.removesuffix(" known").replace("one camera", "camera")
            ]
            relative = [row["detail"], 1, row[RIVALS[0]], min(row[RIVALS[1]], row[RIVALS[2]])]
            assert shown == [f"{row['motion'] * times:.2g}" for times in relative], case
            checked += 1
        elif (key := (subject, loss.removesuffix(" known").replace("one ", ""))) in built_in:
            ours, motion, biharmonic, *arap = built_in[key][:5]
            assert shown == [ours, motion, biharmonic, min(arap, key=as_number)], case
            checked += 1
        elif loss in ("10 % known", "30 % known", "70 % known", "one camera"):
            known = {"10 % known": loss, "one camera": "camera"}.get(loss, loss[:4])
            assert shown == [times[method, known] for method in timed], case
            checked += 1
    assert checked == 9


def test_what_the_readme_claims_is_what_the_tables_show() -> None:
    relative = [
        row["detail"] / min(row[one] for one in RIVALS) for row in errors_of_methods().values()
    ]
    assert len(relative) == 30
    told = " ".join(README.split())
    (gain,) = re.findall(r"over 30 tests .*? error is (\S+) % below .*? libigl wins three", told)
    assert gain == f"{100 * (1 - np.exp(np.log(relative).mean())):.0f}"
    assert sum(one > 1 for one in relative) == 3
    _, *measured = cells(DOCS / "tables" / "crane.csv")
    detail, biharmonic = (
        np.array([float(cell.split("; ")[1].removesuffix(" ms")) for cell in row[1:]])
        for name in ("detail (dynmesh)", RIVALS[0])
        for row in measured
        if row[0] == name
    )
    ratios = detail / biharmonic
    spans = re.findall(r"takes (\S+) to (\S+) ms, (\S+) to (\S+) times faster", told)
    most = f"{detail.min():.0f}", f"{detail.max():.0f}"
    assert spans == [(*most, f"{1 / ratios.max():.0f}", f"{np.floor(1 / ratios.min()):.0f}")]
    (most_over_median,) = re.findall(r"99th percentile is at most (\S+) times", told)
    _, *slowest = cells(DOCS / "tables" / "latency.csv")
    of_detail = [row[2:] for row in slowest if row[:2] == ["detail (dynmesh)", "10000"]]
    assert float(most_over_median) >= max(float(cell) for cell in of_detail[0])
    tracked = {row[0]: row for row in cells(DOCS / "tables" / "rivals-tracking.csv")}["hand"]
    off = re.findall(r"is off by (\S+) mean edges, that of trimesh's non-rigid ICP by (\S+);", told)
    assert off == [(f"{float(tracked[1]):.2g}", f"{float(tracked[3]):.2g}")]


def test_every_table_is_shown_and_whole() -> None:
    shown = {
        (page.parent / name).resolve()
        for page in DOCS.rglob("*.md")
        for name in TABLE.findall(page.read_text())
    }
    assert shown == {path.resolve() for path in (DOCS / "tables").iterdir()}
    for path in shown:
        head, *rows = cells(path)
        assert rows
        assert all(len(row) == len(head) for row in rows), path


def test_the_constants_in_the_pages_are_those_of_the_code() -> None:
    defined: dict[str, set[float]] = {}
    for folder in ("shape", "surface_fit"):
        text = (REPOSITORY / "cpp" / "src" / folder / "constants.hpp").read_text()
        for name, value in re.findall(r"^  [\w:]+ (\w+) = ([-+\d.e]+);", text, flags=re.MULTILINE):
            defined.setdefault(name, set()).add(float(value))
    assert len(defined) > 50
    quoted = [
        (name, float(value))
        for page in DOCS.rglob("*.md")
        for name, value in re.findall(r"`(\w+)`\s=\s(-?\d+(?:\.\d+)?)", page.read_text())
    ]
    assert len(quoted) > 10
    assert not [(name, value) for name, value in quoted if value not in defined.get(name, ())]
