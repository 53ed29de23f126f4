"""Frames are called by the numbers that they have in their file."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from commands import dynmesh_command as run
from sequences import sea

import dynmesh
from dynmesh._command import slice_of
from dynmesh.files.header import header_of
from dynmesh.files.times import frame_numbers, indices_of

N = 8
FIRST = 1001


TRUTH = sea(N, start=FIRST)
PARTIAL = sea(N, share=0.6, whole=[3], start=FIRST)
"""A shot that starts at 1001, of which only frame 1004 is whole."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    dynmesh.write(tmp_path / "truth.npz", TRUTH)
    dynmesh.write(tmp_path / "partial.npz", PARTIAL)
    return tmp_path


def test_completion_and_evaluation(folder: Path) -> None:
    path, made = folder / "partial.npz", folder / "made.npz"
    said = run("complete", path, made, "--start", "1004").stderr
    assert "vertices, frame 1004 not counted" in said
    assert "frame 1004" in run("complete", path, folder / "b.npz").stderr
    assert dynmesh.read(made).start == FIRST
    refused = run("complete", path, folder / "c.npz", "--start", "3", code=1).stderr
    assert "partial.npz: --start: there is no frame 3, only 1001 to 1008" in refused
    table = folder / "errors.csv"
    options = ("--frames", "1002:1005", "--csv", table, "--json")
    whole = json.loads(run("evaluate", made, folder / "truth.npz", *options).stdout)
    with table.open() as file:
        rows = list(csv.DictReader(file))
    assert [row["frame"] for row in rows] == ["1002", "1003", "1004"]
    assert float(rows[2]["maximum"]) == 0  # the frame that was whole
    assert whole["summary"]["maximum"] == max(float(row["maximum"]) for row in rows) > 0


@pytest.mark.parametrize(
    ("text", "times", "expected"),
    [
        ("1002:1005", None, [1, 2, 3]),
        (":1003", None, [0, 1]),
        ("1007:", None, [6, 7]),
        ("1001:1009:3", None, [0, 3, 6]),
        ("1004.5:1006", np.arange(N) * 0.5 + 1001, None),
        ("1003:1007", np.arange(N) * 2.0 + 1001, [1, 2]),
        ("-3:0", np.arange(N) - 4.0, [1, 2, 3]),
    ],
)
def test_ranges_are_half_open(
    text: str, times: np.ndarray | None, expected: list[int] | None
) -> None:
    numbers = frame_numbers(header_of(replace(TRUTH, times=times)))
    if expected is None:
        with pytest.raises(ValueError, match=r"must be some of 1001:1005\.5"):
            indices_of(numbers, slice_of(text))
    else:
        assert list(indices_of(numbers, slice_of(text))) == expected
