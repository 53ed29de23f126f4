"""The Python interface: arguments, settings, reports, errors, and copies of streams."""

import inspect
import json
import math
import pickle
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import Mesh, sheet, turned
from streams import COPIES, pickled

import dynmesh
from dynmesh import _core, _report
from dynmesh._errors import InputError, KindError, SettingError, locating
from dynmesh._report import Report


def test_importing_loads_numpy_alone() -> None:
    code = (
        "import sys, numpy; before = set(sys.modules); import dynmesh;"
        "new = {m.partition('.')[0] for m in set(sys.modules) - before};"
        "print(sorted(new - set(sys.stdlib_module_names) - {'dynmesh', 'numpy'}))"
    )
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert loaded.stdout.strip() == "[]"


def test_broadcast_arrays_are_taken_and_fields_of_records_are_written(mesh: Mesh) -> None:
    """Broadcasting gives equal masks with strides of 0, which the core refuses."""
    k = len(mesh.vertices)
    column = np.broadcast_to(np.arange(float(k))[:, None], (k, 3))
    row = np.broadcast_to(np.array([1.0, 2.0, 3.0]), (k, 3))
    everyone: Any = np.broadcast_to(np.array(True), (k,))
    for given, mask in ((column, everyone), (row, everyone), (row, everyone.astype(np.uint8))):
        one, other = (dynmesh.Completer(mesh.faces, mesh.vertices) for _ in range(2))
        out = np.zeros(k, np.dtype([("seen", "?"), ("xyz", "<f8", 3)], align=True))["xyz"]
        assert one.push(given, mask, out=out) is out
        np.testing.assert_array_equal(out, other.push(np.array(given), np.array(mask, bool)))


def test_float64_beyond_the_range_of_float32_is_too_large_and_not_missing(mesh: Mesh) -> None:
    completer = dynmesh.Completer(mesh.faces, mesh.vertices.astype(np.float32))
    points = mesh.vertices.copy()
    points[5, 1] = -1e300
    known = np.ones(len(points), bool)
    known[5] = False
    assert np.isfinite(completer.push(points, known)).all()
    points[5, 1] = -np.inf
    completer.push(points)
    assert completer.report.known == len(points) - 1


def test_out_is_written_and_returned(mesh: Mesh) -> None:
    completer = dynmesh.Completer(mesh.faces, mesh.vertices)
    out = np.asfortranarray(np.empty_like(mesh.vertices))
    assert completer.push(mesh.vertices, out=out) is completer.skip(out=out) is out
    assert completer.push_sparse([3], mesh.vertices[3:4], out=out) is out  # type: ignore[arg-type]
    np.testing.assert_array_equal(out, mesh.vertices)


def test_empty_lists_are_rows_of_which_there_are_none(mesh: Mesh) -> None:
    nothing: Any = []
    one, other = (dynmesh.Completer(mesh.faces, mesh.vertices) for _ in range(2))
    np.testing.assert_array_equal(one.push_sparse(nothing, nothing), other.skip())
    tracker, lost = (dynmesh.Tracker(mesh.faces, mesh.vertices) for _ in range(2))
    for each in (tracker, lost):
        each.push(mesh.vertices)
    nowhere = tracker.push(nothing, nothing, viewpoints=nothing, colours=nothing)
    np.testing.assert_array_equal(nowhere, lost.skip())


MESH: Mesh = sheet(7)
FRAMES = np.stack([turned(MESH.vertices, 0.05 * i) for i in range(5)])


def test_what_the_caller_does_with_its_arrays_later_has_no_effect() -> None:
    given = MESH.faces.astype(np.int32), FRAMES[0].copy(), FRAMES.copy()
    completer = dynmesh.Completer(*given[:2], training=given[2])
    for array in given:
        array[:] = 0
    assert pickled(completer).state() == completer.state()


def test_a_frame_0_of_another_size_than_the_training_frames_is_pickled_as_well() -> None:
    completer = dynmesh.Completer(MESH.faces, FRAMES[0], training=FRAMES[:5])
    completer.reset(1000 * FRAMES[0])  # which the constructor would refuse
    assert pickled(completer).state() == completer.state()


class Named(dynmesh.Completer):
    """A completer with an attribute."""

    name = "none"


def test_a_subclass_keeps_its_attributes() -> None:
    completer = Named(MESH.faces, FRAMES[0])
    completer.name = "front"
    assert [made(completer).name for made in COPIES] == ["front"] * 3
    assert type(pickled(completer)) is Named


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"_settings": {"method": "motion"}}, "state: .* method is detail, not motion"),
        ({"_settings": {"speed": 2}}, "settings: one of them is not known"),
        ({"_faces": MESH.faces[1:].astype(np.int32)}, "state: of a mesh with other faces"),
    ],
)
def test_pickles_of_something_else_are_refused(changes: dict[str, Any], message: str) -> None:
    kept, state = dynmesh.Completer(MESH.faces, FRAMES[0]).__getstate__()
    made = dynmesh.Completer.__new__(dynmesh.Completer)
    with pytest.raises(ValueError, match=message):
        made.__setstate__((kept | changes, state))


@pytest.mark.parametrize("kind", [dynmesh.Completer, dynmesh.Tracker])
def test_reports_are_pickled_and_copied(kind: Any) -> None:
    subject = kind(MESH.faces, FRAMES[0], uncertainty=True)
    subject.push(FRAMES[1])
    report: Any = subject.report
    names = [name for name in dir(report) if not name.startswith("_")]
    assert len(names) >= 14
    for copied in [made(report) for made in COPIES]:
        assert type(copied) is type(report)
        for name in names:
            np.testing.assert_equal(getattr(copied, name), getattr(report, name), err_msg=name)


PARAMETERS = inspect.signature(dynmesh.Completer).parameters
SETTINGS: dict[str, tuple[str, Any]] = {
    "revisit": ("motion", False),
    "extra_iterations": ("motion", 3),
    "disconnected": ("motion, detail", "hold"),
    "noise": ("detail", 0.5),
    "reject_outliers": ("detail", True),
    "learn": ("detail", True),
    "uncertainty": ("detail", True),
    "threads": ("motion, detail", 2),
}
"""The methods that take a setting, and another value than the default."""


def test_the_signatures_show_every_setting_of_the_core() -> None:
    kinds: Any = {
        dynmesh.Completer: _core.default_settings(),
        dynmesh.Tracker: _core.default_tracker_settings() | {"resolution": "best"},
    }
    for kind, defaults in kinds.items():
        taken = inspect.signature(kind).parameters.values()
        shown = {one.name: one.default for one in taken if one.kind == one.KEYWORD_ONLY}
        assert shown == defaults | {"training": None}


def test_a_file_is_completed_with_the_defaults_of_the_core() -> None:
    parameters = inspect.signature(dynmesh.complete).parameters
    shared = parameters.keys() & {"method", *SETTINGS}
    assert shared >= {"method", "noise", "learn", "uncertainty", "threads"}
    for name in shared:
        assert parameters[name].default == PARAMETERS[name].default


@pytest.mark.parametrize("name", SETTINGS)
@pytest.mark.parametrize("method", ["motion", "detail"])
def test_a_setting_belongs_to_its_methods(mesh: Mesh, name: str, method: str) -> None:
    methods, value = SETTINGS[name]
    settings: Any = {"method": method, name: value}
    if method in methods:
        dynmesh.Completer(mesh.faces, mesh.vertices, **settings)
    else:
        with pytest.raises(SettingError) as refused:
            dynmesh.Completer(mesh.faces, mesh.vertices, **settings)
        assert refused.value.argument == name


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
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    assert list(_report.tracked(iter("abc"), 3, "spelling", progress)) == ["a", "b", "c"]
    printed = capsys.readouterr()
    assert printed.out == ""
    assert ("spelling" in printed.err) == progress


def test_an_error_in_a_frame_knows_the_frame(mesh: Mesh) -> None:
    vertices = np.stack([mesh.vertices] * 3)
    vertices[2, 4] = np.inf
    sequence = dynmesh.Sequence(vertices, mesh.faces, np.ones((3, 49), bool), start=7)
    with pytest.raises(dynmesh.DynmeshError) as refused:
        dynmesh.read(dynmesh.complete(sequence))
    assert isinstance(refused.value, ValueError)
    assert refused.value.frame == 9
    assert str(refused.value) == f"sequence: frame 9: {refused.value.reason}"


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
