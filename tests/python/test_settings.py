"""The table of settings is what every interface of the package has."""

import inspect
from pathlib import Path
from typing import Any, Literal, get_args

import pytest
from meshes import Mesh
from typer.main import get_command

import dynmesh
from dynmesh._errors import KindError, SettingError
from dynmesh.cli import app
from dynmesh.cli.completion import complete
from dynmesh.jobs.batch import Job
from dynmesh.jobs.job_table import optional_columns, read_jobs
from dynmesh.settings import SETTINGS, Setting, Settings, default_settings

OTHER: dict[str, Any] = {"extra_iterations": 3, "noise": 0.5, "threads": 2}


def other_value(name: str) -> Any:
    """A value that is not the default."""
    setting = SETTINGS[name]
    if setting.choices:
        return next(choice for choice in setting.choices if choice != setting.default)
    return OTHER.get(name, not setting.default)


def type_of(setting: Setting) -> Any:
    """The type of a setting's values, as the table describes it."""
    if setting.choices:
        return Literal.__getitem__(setting.choices)
    return setting.kind if setting.default is not None else setting.kind | None


def test_the_type_for_editors_is_that_of_the_table() -> None:
    assert Settings.__annotations__ == {name: type_of(s) for name, s in SETTINGS.items()}


@pytest.mark.parametrize("function", [dynmesh.complete, dynmesh.Completer, dynmesh.complete_file])
def test_every_function_takes_the_settings_of_the_table(function: Any) -> None:
    parameters = inspect.signature(function).parameters
    names = [name for name in parameters if name in SETTINGS]
    assert names == list(SETTINGS)
    assert {name: parameters[name].default for name in names} == default_settings
    if function is not dynmesh.Completer:
        annotations = {name: parameters[name].annotation for name in names}
        assert annotations == Settings.__annotations__


def test_the_choices_are_those_of_the_compiled_core(mesh: Mesh) -> None:
    for name, setting in SETTINGS.items():
        for choice in setting.choices:
            settings: Any = {name: choice}
            dynmesh.Completer(mesh.faces, mesh.vertices, **settings)
        if setting.choices:
            wrong: Any = {name: "other"}
            with pytest.raises(SettingError, match=f"^{name}: ") as refused:
                dynmesh.Completer(mesh.faces, mesh.vertices, **wrong)
            assert all(f"'{choice}'" in refused.value.reason for choice in setting.choices)
        if setting.least is not None:
            too_small: Any = {"method": setting.method or "detail", name: setting.least - 1}
            with pytest.raises(SettingError, match=f"^{name}: must be from {setting.least} "):
                dynmesh.Completer(mesh.faces, mesh.vertices, **too_small)


@pytest.mark.parametrize("name", [name for name in SETTINGS if name != "method"])
def test_a_setting_belongs_to_the_method_of_the_table(mesh: Mesh, name: str) -> None:
    for method in SETTINGS["method"].choices:
        settings: Any = {"method": method, name: other_value(name)}
        if SETTINGS[name].method in (None, method):
            dynmesh.Completer(mesh.faces, mesh.vertices, **settings)
        else:
            with pytest.raises(SettingError) as refused:
                dynmesh.Completer(mesh.faces, mesh.vertices, **settings)
            assert refused.value.argument == name


def test_a_table_of_jobs_has_a_column_for_each(tmp_path: Path) -> None:
    assert optional_columns[-len(SETTINGS) :] == tuple(SETTINGS)
    values = {name: other_value(name) for name in SETTINGS}
    table = tmp_path / "jobs.csv"
    row = ",".join(str(value).lower() for value in values.values())
    table.write_text(f"input,output,{','.join(values)}\na.npz,b.npz,{row}\n")
    (job,) = read_jobs(table)
    assert isinstance(job, Job)
    assert job.settings == values


def test_the_command_has_an_option_for_each() -> None:
    command: Any = get_command(app)
    names = {option.name: option.opts for option in command.commands["complete"].params}
    parameters = inspect.signature(complete).parameters
    for name, setting in SETTINGS.items():
        kind, option = get_args(parameters[name].annotation)
        assert names[name] == [f"--{name.replace('_', '-')}"]
        assert parameters[name].default == default_settings[name]  # type: ignore[literal-required]
        assert kind == type_of(setting)
        assert (option.help, option.min) == (setting.help, setting.least)


def test_a_setting_that_there_is_not_is_refused_before_any_file(tmp_path: Path) -> None:
    wrong: Any = {"speed": 1}
    with pytest.raises(
        KindError, match=r"^speed: is not a setting; the settings are method, revisit"
    ):
        dynmesh.complete_file(tmp_path / "none.npz", tmp_path / "out.npz", **wrong)
    wrong = {"prim": "/body"}
    with pytest.raises(KindError, match=r"^prim: .*source=\{'prim': "):
        dynmesh.complete_file(tmp_path / "none.npz", tmp_path / "out.npz", **wrong)
