"""A character of several meshes, read, completed and shown together."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from characters import (
    BODY,
    COAT,
    EYE,
    FIRST,
    LAST,
    MESHES,
    RATE,
    STAND,
    character,
    known_of,
    truth_of,
)
from commands import dynmesh_command as run
from sequences import assert_refused
from stages import stage_of, values_of

import dynmesh

Usd, UsdGeom, UsdValidation = (
    pytest.importorskip(f"pxr.{name}") for name in ("Usd", "UsdGeom", "UsdValidation")
)
TIMES = [float(time) for time in range(FIRST, LAST + 1)]


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a stage, `shot.usda`, and of the layer that one command writes, `done.usdc`."""
    folder = tmp_path_factory.mktemp("character")
    character(folder / "shot.usda")
    options = ("--prim", "all", "--mask", "primvars:tracked")
    run("complete", folder / "shot.usda", folder / "done.usdc", *options)
    return folder


def samples(stage: Any, path: str, name: str = "points") -> np.ndarray:
    """(n, ...) the values of an attribute of a mesh, which must have those of all frames."""
    attribute = stage.GetPrimAtPath(path).GetAttribute(name)
    assert attribute.GetTimeSamples() == TIMES
    return np.array([attribute.Get(time) for time in TIMES])


def test_one_layer_completes_all_meshes_and_changes_nothing_else(shot: Path) -> None:
    stage = stage_of(shot / "done.usdc")
    for name in MESHES:
        points, truth = samples(stage, name), truth_of(name)
        assert np.isfinite(points).all()
        np.testing.assert_array_equal(points[known_of(name)], truth[known_of(name)])
        np.testing.assert_allclose(points, truth, atol=10)  # of 160
        velocities = np.gradient(points.astype(float), axis=0) * RATE
        np.testing.assert_allclose(samples(stage, name, "velocities"), velocities, atol=1e-3)
    before, after = values_of(stage_of(shot / "shot.usda")), values_of(stage)
    changed = {path for path in before | after if before.get(path) != after.get(path)}
    assert {path.partition(".")[0] for path in changed} == {*MESHES}
    own = {"points", "extent", "velocities", "primvars:generation", "primvars:age"}
    assert {path.partition(".")[2] for path in changed} == own | {"primvars:known"}
    assert not stage.GetPrimAtPath(COAT).GetAttribute("primvars:known").HasAuthoredValue()
    assert stage.GetStartTimeCode() == FIRST
    assert stage.GetMetadata("metersPerUnit") == 0.01
    registry = UsdValidation.ValidationRegistry()
    check = UsdValidation.ValidationContext(registry.GetOrLoadAllValidators()).Validate
    found = {error.GetMessage() for error in check(stage)}
    assert found == {error.GetMessage() for error in check(stage_of(shot / "shot.usda"))}


@pytest.mark.parametrize("name", MESHES)
def test_each_mesh_has_a_completer_of_its_own(shot: Path, name: str) -> None:
    known = "primvars:tracked" if name == EYE else None
    alone = dynmesh.complete(dynmesh.open(shot / "shot.usda", prim=name, known=known)).read()
    np.testing.assert_array_equal(samples(stage_of(shot / "done.usdc"), name), alone.vertices)


def test_some_are_chosen_by_their_paths(shot: Path, tmp_path: Path) -> None:
    said = run("complete", "--prim", BODY, COAT, shot / "shot.usda", tmp_path / "a.usda").stderr
    assert f"{BODY}: good; 59 frames completed" in said
    before, after = stage_of(shot / "shot.usda"), stage_of(tmp_path / "a.usda")
    np.testing.assert_array_equal(samples(after, EYE), samples(before, EYE))
    assert np.isfinite(samples(after, COAT)).all()
    report = json.loads(
        run(
            "complete", shot / "shot.usda", tmp_path / "b.usda", "--prim", BODY, COAT, "--json"
        ).stdout
    )
    assert report["meshes"][COAT]["frames"] == 60
    with pytest.raises(ValueError, match=r"training: .* choose one by `prim`"):
        dynmesh.complete(dynmesh.open(shot / "shot.usda", prim=[BODY, COAT]), training="x.npz")
    assert_refused(shot / "shot.usda", "'/No'", prim=[BODY, "/No"])
    alone = dynmesh.read(shot / "shot.usda", prim=BODY)
    dynmesh.write(tmp_path / "a.abc", alone)
    assert_refused(tmp_path / "a.abc", "only for USD", prim=["/Char", "/Other"])


def test_together_they_are_where_the_stage_has_them(shot: Path) -> None:
    stage = stage_of(shot / "done.usdc")
    both: Any = dynmesh.read(shot / "done.usdc", prim="all")
    assert (both.up_axis, both.metres_per_unit, both.start, both.fps) == ("z", 0.01, FIRST, RATE)
    cache, first = UsdGeom.XformCache(), 0
    names = [str(prim.GetPath()) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    assert sorted(names) == sorted([*MESHES, STAND])
    for name in names:
        points = UsdGeom.Mesh(stage.GetPrimAtPath(name)).GetPointsAttr()
        for number in (0, 7, 59):
            cache.SetTime(TIMES[number])
            matrix = cache.GetLocalToWorldTransform(stage.GetPrimAtPath(name))
            expected = [matrix.Transform(point) for point in points.Get(TIMES[number])]
            found = both.vertices[number, first : first + len(expected)]
            np.testing.assert_allclose(found, expected, atol=1e-4)
        first += len(expected)
    assert first == both.vertices.shape[1] == len(np.unique(both.faces))
    made = dynmesh.complete(dynmesh.open(shot / "shot.usda", prim="all", known="primvars:tracked"))
    np.testing.assert_array_equal(made.read().vertices, both.vertices)


def test_numbers_that_stand_for_missing_positions_are_found_before_they_are_moved(
    shot: Path,
) -> None:
    partial: Any = dynmesh.read(shot / "shot.usda", prim=[COAT, BODY], missing="zero")
    expected = np.concatenate([known_of(COAT), known_of(BODY)], axis=1)
    np.testing.assert_array_equal(partial.known, expected)


def test_a_page_shows_and_names_all(shot: Path, browser: Any, tmp_path: Path) -> None:
    from browser import Page, in_colour

    options = ("--prim", "all", "--colour", "mesh", "--input", shot / "shot.usda")
    said = run("view", shot / "done.usdc", "-o", tmp_path / "a.html", *options).stderr
    assert "bake" not in said
    page = Page(browser, tmp_path / "a.html")
    assert "Eye, Body, Coat, Stand" in page.text("note")
    assert {"Eye", "Body", "Coat", "Stand"} <= {*page.text("bar").split()}
    assert in_colour(page.picture()).any()
    assert not page.complaints
