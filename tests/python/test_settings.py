"""The settings of a completer: their types are those of the compiled core, and every one works."""

import inspect
from pathlib import Path
from typing import Any, Literal

import pytest
from meshes import Mesh

import dynmesh
from dynmesh._core import setting_table
from dynmesh._errors import KindError, SettingError
from dynmesh.settings import Settings

TABLE: dict[str, dict[str, Any]] = {row["name"]: row for row in setting_table()}
OTHER: dict[str, Any] = {"extra_iterations": 3, "noise": 0.5, "threads": 2}


def other_value(name: str) -> Any:
    """A value that is not the default."""
    default, choices = TABLE[name]["default"], TABLE[name].get("choices", ())
    if choices:
        return next(choice for choice in choices if choice != default)
    return OTHER.get(name, not default)


def type_of(row: dict[str, Any]) -> Any:
    """The type of a setting's values, as the table describes it."""
    if row.get("choices"):
        return Literal.__getitem__(tuple(row["choices"]))
    return float | None if row["default"] is None else type(row["default"])


def test_the_type_for_editors_is_that_of_the_core() -> None:
    assert Settings.__annotations__ == {name: type_of(row) for name, row in TABLE.items()}


def test_a_file_is_completed_with_the_defaults_of_the_core() -> None:
    parameters = inspect.signature(dynmesh.complete_file).parameters
    shared = parameters.keys() & TABLE.keys()
    assert shared >= {"method", "noise", "learn", "uncertainty", "threads"}
    for name in shared:
        assert parameters[name].default == TABLE[name]["default"]


def test_the_choices_are_those_of_the_compiled_core(mesh: Mesh) -> None:
    for name, row in TABLE.items():
        for choice in row.get("choices", ()):
            settings: Any = {name: choice}
            dynmesh.Completer(mesh.faces, mesh.vertices, **settings)
        if row.get("choices"):
            wrong: Any = {name: "other"}
            with pytest.raises(SettingError) as refused:
                dynmesh.Completer(mesh.faces, mesh.vertices, **wrong)
            assert refused.value.argument == name
            assert all(f"'{choice}'" in refused.value.reason for choice in row["choices"])
        if "least" in row:
            too_small: Any = {"method": row["method"] or "detail", name: row["least"] - 1}
            with pytest.raises(SettingError) as refused:
                dynmesh.Completer(mesh.faces, mesh.vertices, **too_small)
            assert refused.value.argument == name


@pytest.mark.parametrize("name", [name for name in TABLE if name != "method"])
def test_a_setting_belongs_to_the_method_of_the_table(mesh: Mesh, name: str) -> None:
    for method in TABLE["method"]["choices"]:
        settings: Any = {"method": method, name: other_value(name)}
        if TABLE[name]["method"] in (None, method):
            dynmesh.Completer(mesh.faces, mesh.vertices, **settings)
        else:
            with pytest.raises(SettingError) as refused:
                dynmesh.Completer(mesh.faces, mesh.vertices, **settings)
            assert refused.value.argument == name


def test_a_setting_that_there_is_not_is_refused_at_once(mesh: Mesh) -> None:
    wrong: Any = {"speed": 1}
    with pytest.raises(KindError) as refused:
        dynmesh.complete(mesh.faces, [mesh.vertices], **wrong)
    assert refused.value.argument == "speed"


def test_what_belongs_to_another_method_is_refused_before_any_file(tmp_path: Path) -> None:
    for name, value in (("bidirectional", True), ("drop_above", 1.0), ("training", "t.npz")):
        options: Any = {"method": "motion", name: value}
        with pytest.raises(SettingError) as refused:
            dynmesh.complete_file(tmp_path / "none.npz", tmp_path / "out.npz", **options)
        assert refused.value.argument == name
