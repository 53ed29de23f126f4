"""What all verbs share: reports, bars, and errors that know their place."""

import json
import math
import pickle
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import Mesh

import dynmesh
from dynmesh._errors import InputError, KindError, SettingError, locating
from dynmesh._progress import tracked
from dynmesh._report import Report
from dynmesh.tracking.fits import Counts, Fits


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


@pytest.mark.parametrize("progress", [False, True])
def test_a_bar_passes_all_on_and_is_shown_if_asked_for(
    progress: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")
    assert list(tracked(iter("abc"), 3, "spelling", progress)) == ["a", "b", "c"]
    printed = capsys.readouterr()
    assert printed.out == ""
    assert ("spelling" in printed.err) == progress


def test_the_share_of_far_points_is_the_quality() -> None:
    assert Counts().share == 0
    assert Counts(100, 25).share == 0.25
    assert Fits(total=Counts(1000, 19)).quality == "good"
    assert Fits(total=Counts(1000, 40)).quality == "doubtful"
    assert Fits(total=Counts(1000, 60)).quality == "ruined"


def test_an_error_in_a_frame_knows_the_frame(mesh: Mesh) -> None:
    frames = [mesh.vertices, mesh.vertices, mesh.vertices[:3]]
    with pytest.raises(dynmesh.DynmeshError) as refused:
        list(dynmesh.complete(mesh.faces, frames))
    assert isinstance(refused.value, ValueError)
    assert refused.value.frame == 2
    assert str(refused.value) == f"frame 2: {refused.value.reason}"
    with pytest.raises(dynmesh.DynmeshError) as of_a_kind:
        list(dynmesh.complete(mesh.faces, [mesh.vertices, mesh.vertices.astype(int)]))
    assert isinstance(of_a_kind.value, TypeError)
    assert of_a_kind.value.frame == 1


def test_an_error_in_a_file_knows_the_file_argument_and_frame(tmp_path: Path, mesh: Mesh) -> None:
    path = tmp_path / "a.npz"
    header = dynmesh.Header(mesh.faces, 2, 49, np.dtype(np.float64), has_known=True)
    with pytest.raises(dynmesh.DynmeshError) as refused, dynmesh.create(path, header) as writer:
        writer.append(mesh.vertices, np.ones(48, bool))
    error = refused.value
    assert (error.file, error.frame, error.argument) == (path, 0, "known")
    assert str(error) == f"{path}: frame 0: known: {error.reason}"


def test_the_file_that_is_damaged_is_named_alone(tmp_path: Path, mesh: Mesh) -> None:
    vertices = np.zeros((1, 49, 3), np.float32)
    dynmesh.write(tmp_path / "a.pc2", dynmesh.Sequence(vertices, mesh.faces))
    beside = tmp_path / "a.obj"
    beside.write_text("v 1 2\n")
    with pytest.raises(dynmesh.DynmeshError) as refused:
        dynmesh.open(tmp_path / "a.pc2")
    assert refused.value.file == beside
    assert str(refused.value).count("a.obj") == 1


def test_the_innermost_place_stays() -> None:
    error = KindError("must be float32", argument="points")
    with pytest.raises(KindError), locating(frame=7, file=Path("b")), locating(frame=3):
        raise error
    assert str(error) == "b: frame 3: points: must be float32"


@pytest.mark.parametrize("kind", [InputError, KindError, SettingError])
def test_errors_survive_another_process(kind: type[dynmesh.DynmeshError]) -> None:
    error = kind("is empty", argument="faces", frame=3, file=Path("a.npz"))
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is kind
    assert str(again) == str(error) == "a.npz: frame 3: faces: is empty"
