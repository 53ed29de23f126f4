"""Several meshes of a scene, read, completed and shown together."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import dynmesh_command as run
from sequences import assert_refused
from stages import BODY, FLAG, HAT, STONE, TIMES, frames_of, production, stage_of, values_of

import dynmesh

Sdf, Usd, UsdGeom, UsdValidation, Vt = (
    pytest.importorskip(f"pxr.{name}") for name in ("Sdf", "Usd", "UsdGeom", "UsdValidation", "Vt")
)
SECOND = FLAG.replace("First", "Second")
MESHES = {BODY: 0, HAT: 1, FLAG: 2, SECOND: 2}
"""Their seeds."""


@pytest.fixture(scope="module")
def shot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a stage, `shot.usda`, and of the layer that one command writes, `done.usdc`.

    The mask of the hat has another name, `tracked`.
    """
    folder = tmp_path_factory.mktemp("several")
    stage = stage_of(production(folder / "shot.usda"))
    hat = UsdGeom.PrimvarsAPI(stage.GetPrimAtPath(HAT))
    mask = hat.CreatePrimvar("tracked", Sdf.ValueTypeNames.BoolArray, "vertex")
    for time, known in zip(TIMES, frames_of(MESHES[HAT])[1], strict=True):
        mask.Set(Vt.BoolArray.FromNumpy(known), time)
    hat.RemovePrimvar("known")
    stage.GetRootLayer().Save()
    options = ("--prim", "all", "--mask", "primvars:tracked")
    run("complete", folder / "shot.usda", folder / "done.usdc", *options)
    return folder


def samples(stage: Any, path: str) -> np.ndarray:
    """(n, k, 3) the points of a mesh, which must have those of all frames."""
    points = UsdGeom.Mesh(stage.GetPrimAtPath(path)).GetPointsAttr()
    assert tuple(points.GetTimeSamples()) == TIMES
    return np.array([points.Get(time) for time in TIMES])


def test_one_layer_completes_all_meshes_and_changes_nothing_else(shot: Path) -> None:
    stage = stage_of(shot / "done.usdc")
    for name, seed in MESHES.items():
        truth, known = frames_of(seed)
        points = samples(stage, name)
        assert np.isfinite(points).all()
        np.testing.assert_array_equal(points[known], truth[known])
    before, after = values_of(stage_of(shot / "shot.usda")), values_of(stage)
    changed = {path for path in before | after if before.get(path) != after.get(path)}
    own = {"points", "extent", "velocities", "normals", "extentsHint"}
    own |= {f"primvars:{name}" for name in ("generation", "age", "known", "tracked")}
    assert {path.partition(".")[2] for path in changed} <= own
    check = UsdValidation.ValidationContext(
        UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    ).Validate
    found = {error.GetMessage() for error in check(stage)}
    assert found == {error.GetMessage() for error in check(stage_of(shot / "shot.usda"))}


@pytest.mark.parametrize("name", MESHES)
def test_each_mesh_has_a_completer_of_its_own(shot: Path, name: str) -> None:
    known = "primvars:tracked" if name == HAT else None
    alone = dynmesh.complete(dynmesh.open(shot / "shot.usda", prim=name, known=known)).read()
    np.testing.assert_array_equal(samples(stage_of(shot / "done.usdc"), name), alone.vertices)


def test_some_are_chosen_by_their_paths(shot: Path, tmp_path: Path) -> None:
    words = ("complete", shot / "shot.usda", tmp_path / "a.usda", "--prim", BODY, FLAG, "--json")
    assert json.loads(run(*words).stdout)["meshes"][FLAG]["frames"] == len(TIMES)
    before, after = stage_of(shot / "shot.usda"), stage_of(tmp_path / "a.usda")
    np.testing.assert_array_equal(samples(after, HAT), samples(before, HAT))
    assert np.isfinite(samples(after, BODY)).all()
    with pytest.raises(ValueError, match=r"training: .* choose one by `prim`"):
        dynmesh.complete(dynmesh.open(shot / "shot.usda", prim=[BODY, FLAG]), training="x.npz")
    assert_refused(shot / "shot.usda", "'/No'", prim=[BODY, "/No"])


@pytest.mark.parametrize("name", ["shot.usda", "done.usdc"])
def test_what_is_known_of_each_is_what_is_known_of_it_alone(name: str, shot: Path) -> None:
    """Also of those that are completed, of which estimates are not known."""
    several = json.loads(run("info", shot / name, "--json").stdout)["meshes"]
    for mesh in (BODY, FLAG):
        alone = json.loads(run("info", shot / name, "--prim", mesh, "--json").stdout)
        expected = frames_of(MESHES[mesh])[1][1:].mean()
        assert several[mesh]["known"] == pytest.approx(expected)
        assert alone["known_share"]["mean"] == pytest.approx(expected)
    assert several[STONE]["known"] == 1


def test_together_they_are_where_the_stage_has_them(shot: Path) -> None:
    stage = stage_of(shot / "done.usdc")
    both: Any = dynmesh.read(shot / "done.usdc", prim="all")
    assert (both.up_axis, both.metres_per_unit, both.fps) == ("z", 0.01, 12)
    cache, first = UsdGeom.XformCache(), 0
    names = [str(prim.GetPath()) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    assert sorted(names) == sorted([*MESHES, STONE])
    for name in names:
        points = UsdGeom.Mesh(stage.GetPrimAtPath(name)).GetPointsAttr()
        for number, time in enumerate(TIMES):
            cache.SetTime(time)
            matrix = cache.GetLocalToWorldTransform(stage.GetPrimAtPath(name))
            expected = [matrix.Transform(point) for point in points.Get(time)]
            found = both.vertices[number, first : first + len(expected)]
            np.testing.assert_allclose(found, expected, atol=1e-4)
        first += len(expected)
    assert first == both.vertices.shape[1] == len(np.unique(both.faces))
    made = dynmesh.complete(dynmesh.open(shot / "shot.usda", prim="all", known="primvars:tracked"))
    np.testing.assert_array_equal(made.read().vertices, both.vertices)


def test_numbers_that_stand_for_missing_positions_are_found_before_they_are_moved(
    shot: Path,
) -> None:
    partial: Any = dynmesh.read(shot / "shot.usda", prim=[HAT, BODY], missing="zero")
    seen = [
        known & truth.any(axis=2) for truth, known in map(frames_of, (MESHES[HAT], MESHES[BODY]))
    ]
    np.testing.assert_array_equal(partial.known, np.concatenate(seen, axis=1))


def test_a_page_shows_and_names_all(shot: Path, browser: Any, tmp_path: Path) -> None:
    from browser import Page, in_colour

    options = ("--prim", "all", "--colour", "mesh", "--input", shot / "shot.usda")
    run("view", shot / "done.usdc", "-o", tmp_path / "a.html", *options)
    page = Page(browser, tmp_path / "a.html")
    assert {BODY, HAT, STONE} <= {*page.text("bar").split()}
    assert in_colour(page.picture()).any()
    assert not page.complaints
