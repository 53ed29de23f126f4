"""What all verbs share: reports, and bars that show how far they are."""

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dynmesh
from dynmesh._progress import tracked
from dynmesh._report import Report


@dataclass(frozen=True, kw_only=True)
class Made(Report):
    output: Path
    errors: Any


def test_a_report_is_its_lines_and_json() -> None:
    values = {"a": np.float32(0.5), "b": [math.inf, np.arange(2)]}
    made = Made(quality="doubtful", reason="why", remarks=("r",), output=Path("o"), errors=values)
    assert str(made) == "why\nr"
    assert json.loads(json.dumps(made.to_dict(), allow_nan=False)) == {
        "quality": "doubtful",
        "reason": "why",
        "remarks": ["r"],
        "output": "o",
        "errors": {"a": 0.5, "b": [None, [0, 1]]},
    }


def test_an_evaluation_prints_five_lines() -> None:
    truth = dynmesh.synth.ocean(8, grid=6)
    found = dynmesh.evaluate(truth, truth)
    assert len(str(found).splitlines()) == 5
    assert len(repr(found)) < 500
    assert found.quality == "good"


@pytest.mark.parametrize("progress", [False, True])
def test_a_bar_passes_all_on_and_is_shown_if_asked_for(
    progress: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    assert list(tracked(iter("abc"), 3, "spelling", progress)) == ["a", "b", "c"]
    printed = capsys.readouterr()
    assert printed.out == ""
    assert ("spelling" in printed.err) == progress
