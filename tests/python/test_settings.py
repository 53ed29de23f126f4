"""The settings of a completer, which are those of the compiled core, and other keywords."""

import inspect
import pickle
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from meshes import Mesh

import dynmesh
from dynmesh import _core
from dynmesh._errors import KindError, SettingError

PARAMETERS = inspect.signature(dynmesh.Completer).parameters
TAKES = {
    "method": ("motion", "detail"),
    "revisit": ("motion",),
    "extra_iterations": ("motion",),
    "disconnected": ("motion", "detail"),
    "noise": ("detail",),
    "reject_outliers": ("detail",),
    "learn": ("detail",),
    "uncertainty": ("detail",),
    "threads": ("motion", "detail"),
}
"""The methods that take a setting."""
OTHER: dict[str, Any] = {
    "method": "motion",
    "disconnected": "hold",
    "extra_iterations": 3,
    "noise": 0.5,
    "threads": 2,
}


@pytest.mark.parametrize(
    ("kind", "defaults"),
    [
        (dynmesh.Completer, _core.default_settings()),
        (dynmesh.Tracker, _core.default_tracker_settings()),
    ],
)
def test_the_signature_shows_every_setting_of_the_core(kind: Any, defaults: dict[str, Any]) -> None:
    taken = inspect.signature(kind).parameters
    keywords = [name for name, one in taken.items() if one.kind == one.KEYWORD_ONLY]
    assert {name: taken[name].default for name in keywords} == defaults | {"training": None}


def test_a_file_is_completed_with_the_defaults_of_the_core() -> None:
    parameters = inspect.signature(dynmesh.complete_file).parameters
    shared = parameters.keys() & TAKES.keys()
    assert shared >= {"method", "noise", "learn", "uncertainty", "threads"}
    for name in shared:
        assert parameters[name].default == PARAMETERS[name].default


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("method", "other"),
        ("disconnected", "other"),
        ("extra_iterations", -1),
        ("threads", 0),
        ("threads", 2**31),
        ("noise", 10**400),
    ],
)
def test_a_value_out_of_range_is_refused_by_the_name_of_its_setting(
    mesh: Mesh, name: str, wrong: Any
) -> None:
    given: Any = {"method": TAKES[name][0], name: wrong}
    with pytest.raises(SettingError) as refused:
        dynmesh.Completer(mesh.faces, mesh.vertices, **given)
    assert refused.value.argument == name


@pytest.mark.parametrize("name", [name for name in TAKES if name != "method"])
@pytest.mark.parametrize("method", ["motion", "detail"])
def test_a_setting_belongs_to_its_methods(mesh: Mesh, name: str, method: str) -> None:
    value = OTHER.get(name, not PARAMETERS[name].default)
    settings: Any = {"method": method, name: value}
    if method in TAKES[name]:
        dynmesh.Completer(mesh.faces, mesh.vertices, **settings)
    else:
        with pytest.raises(SettingError) as refused:
            dynmesh.Completer(mesh.faces, mesh.vertices, **settings)
        assert refused.value.argument == name


def test_what_belongs_to_another_method_is_refused_before_any_file(tmp_path: Path) -> None:
    for name, value in (("bidirectional", True), ("drop_above", 1.0), ("training", "t.npz")):
        options: Any = {"method": "motion", name: value}
        with pytest.raises(SettingError) as refused:
            dynmesh.complete_file(tmp_path / "none.npz", tmp_path / "out.npz", **options)
        assert refused.value.argument == name


def test_files_are_opened_with_the_same_options_everywhere() -> None:
    taken = inspect.signature(dynmesh.open).parameters
    options = {name: one.annotation for name, one in taken.items() if one.kind == one.KEYWORD_ONLY}
    assert options.pop("format") == str | None
    assert options == dynmesh.files.Source.__annotations__


@pytest.mark.parametrize(
    ("function", "keyword", "meant"),
    [
        (dynmesh.complete_file, "mask", "source={'known': ...}"),
        (dynmesh.complete_file, "missing", "source={'missing': ...}"),
        (dynmesh.complete_file, "bidirektional", "bidirectional"),
        (dynmesh.complete, "mask", "known"),
        (dynmesh.complete, "iterations", "extra_iterations"),
        (dynmesh.evaluate, "input", "partial"),
        (dynmesh.read, "mask", "known"),
        (dynmesh.view, "output", "out"),
        (dynmesh.Completer, "treads", "threads"),
        (dynmesh.Tracker, "uncertanty", "uncertainty"),
    ],
)
def test_a_keyword_that_does_not_exist_names_the_one_that_is_meant(
    function: Callable[..., Any], keyword: str, meant: str
) -> None:
    with pytest.raises(KindError, match=f"did you mean {re.escape(meant)}") as caught:
        function("a", "b", **{keyword: 1})
    assert caught.value.argument == keyword
    with pytest.raises(KindError, match=str(next(iter(inspect.signature(function).parameters)))):
        function("a", "b", quite_another=1)
    if inspect.isfunction(function):
        assert pickle.loads(pickle.dumps(function)) is function
