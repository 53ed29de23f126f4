"""Accuracy on the built-in subjects, relative to other libraries, is that of the documentation."""

import pytest
from documents import DOCS, cells

from benchmarks import rivals
from benchmarks.harness import Table
from dynmesh.synth import Name

pytestmark = pytest.mark.slow


def assert_as_accurate(measured: Table) -> None:
    """Each ratio is at most 5 % above that of the table, or so small that rounding decides."""
    table = cells(DOCS / "tables" / f"{measured.name}.csv")
    head, *rows = measured.lines
    assert list(head) == table[0]
    n_names = 2 if "known" in head else 1
    documented = {tuple(row[:n_names]): row[-1] for row in table}
    for row in rows:
        expected = documented[row[:n_names]]
        assert (row[-1] == "-") == (expected == "-"), row
        if expected != "-":
            assert float(row[-1]) <= 1.05 * float(expected) + 0.001, row


@pytest.mark.parametrize("name", rivals.COMPLETED_NAMES)
def test_completion(name: str) -> None:
    pytest.importorskip("igl", reason="libigl is not installed")
    assert_as_accurate(rivals.completion(rivals.cases([name])))


@pytest.mark.parametrize("name", [row[0] for row in cells(DOCS / "tables/rivals-tracking.csv")[1:]])
def test_tracking(name: Name) -> None:
    assert_as_accurate(rivals.tracking(rivals.subjects(rivals.TRACKED, [name])))
