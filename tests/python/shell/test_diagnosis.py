"""The findings of `dynmesh.info` and `dynmesh info`."""

import json
import re
import tracemalloc
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from commands import dynmesh_command as run
from hypothesis import given, settings
from meshes import Mesh, join, meshes, sheet

import dynmesh
from dynmesh import Sequence, losses, synth
from dynmesh.advice.diagnosis import Diagnosis
from dynmesh.advice.findings import KINDS


def moving(mesh: Mesh, n_frames: int = 16, dtype: Any = np.float64) -> Sequence:
    """Returns a mesh that drifts and grows slowly."""
    times = np.arange(n_frames)[:, None, None]
    waves = 0.1 * (np.sin(0.3 * times + mesh.vertices[:, :1]) - np.sin(mesh.vertices[:, :1]))
    vertices = mesh.vertices * (1 + 0.002 * times) + np.array([0.05, 0.02, 0.01]) * times + waves
    return Sequence(vertices.astype(dtype), mesh.faces)


class Expected(NamedTuple):
    """The expected content of a finding."""

    number: int
    vertices: list[int] | None = None
    faces: list[int] | None = None
    frames: list[int] | None = None


SOUND = moving(sheet(12))
X = SOUND.vertices
PATCH = [0, 1, 2, 12, 13, 14, 24, 25, 26]
SPOILT: dict[str, tuple[dict[Any, Any], Expected]] = {
    "first_frame_incomplete": ({(0, (3, 7)): np.nan}, Expected(2, [3, 7], frames=[0])),
    "known_not_finite": (
        {(4, 5): np.inf, (6, 2): np.nan, "known": ()}, Expected(2, [2, 5], frames=[4, 6])
    ),
    "scrambled_frames": (
        {5: X[5, np.random.default_rng(0).permutation(144)]}, Expected(1, frames=[5])
    ),
    "zeros": (
        {(n, (10, 11, 12, 13)): 0 for n in (3, 4)}, Expected(8, [10, 11, 12, 13], frames=[3, 4])
    ),
    "leaps": (  # a cut and a misplaced frame
        {n: X[n] + 5 for n in (6, 7, 8, 9, 10, 11, 13, 14, 15)}, Expected(3, frames=[6, 12, 13])
    ),
    "outliers": (  # one vertex, and a hole that was filled with one place
        {(4, 50, 2): X[4, 50, 2] + 10, (6, (0, 1)): -999}, Expected(3, [0, 1, 50], frames=[4, 6])
    ),
    "held": (
        {(n, (10, 11, 22, 23)): X[2, [10, 11, 22, 23]] for n in (3, 4)},
        Expected(8, [10, 11, 22, 23], frames=[3, 4]),
    ),
    "frames_without_anchors": ({"known": (5, 6)}, Expected(2, frames=[5, 6])),
    "never_seen": ({(n, tuple(PATCH)): np.nan for n in range(1, 16)}, Expected(9, PATCH)),
}  # fmt: skip
"""What is changed in a sound sequence, in some of them with a mask that lacks these frames."""
FLAT = Mesh(sheet(12).faces, sheet(12).vertices * [1, 1, 0])
TWO = join(FLAT, FLAT._replace(vertices=FLAT.vertices + np.array([11, 0, 0])))
MESHES: dict[str, tuple[Any, Any, Expected]] = {
    "coincident_vertices": (
        TWO.vertices, TWO.faces, Expected(24, np.flatnonzero(TWO.vertices[:, 0] == 11).tolist())
    ),
    "non_manifold_edges": ([(5, 5, 2)], [[65, 66, 144]], Expected(1, faces=[242])),  # a fin
    "non_manifold_vertices": (
        [(5, 5, 2), (6, 5, 2)], [[65, 144, 145]], Expected(1, faces=[242])
    ),
    "degenerate_faces": ([], [[5, 5, 6], [7, 7, 7]], Expected(2, faces=[242, 243])),
    "no_faces": (SOUND.vertices[0], np.empty((0, 3), int), Expected(144)),
}  # fmt: skip
"""Vertices and faces, in lists those that are added to a sheet of 144."""


def broken(code: str) -> tuple[Sequence, Expected]:
    if code in MESHES:
        vertices, faces, expected = MESHES[code]
        mesh = sheet(12)
        if isinstance(faces, list):
            vertices = np.concatenate([mesh.vertices, np.reshape(vertices, (-1, 3))])
            faces = np.concatenate([mesh.faces, faces])
        return moving(Mesh(faces, vertices)), expected
    changes, expected = SPOILT[code]
    vertices, known = X.copy(), np.ones(X.shape[:2], np.bool_)
    for place, value in changes.items():
        if place == "known":
            known[list(value)] = False
        else:
            vertices[place] = value
    return replace(SOUND, vertices=vertices, known=known if "known" in changes else None), expected


WALKER = synth.walker(40)


def diagnosed(sequence: Any) -> Diagnosis:
    diagnosis = dynmesh.info(sequence).diagnosis
    assert diagnosis is not None
    return diagnosis


def codes(diagnosis: Diagnosis) -> list[str]:
    return [finding.code for finding in diagnosis.findings]


@pytest.mark.parametrize("code", KINDS)
def test_what_is_broken_is_found_where_it_is(code: str) -> None:
    sequence, expected = broken(code)
    found = {finding.code: finding for finding in diagnosed(sequence).findings}
    assert set(found) == {code}
    finding = found[code]
    assert finding.count == expected.number
    for name in ("vertices", "faces", "frames"):
        places = getattr(expected, name)
        if places is not None:
            assert getattr(finding, name).tolist() == places


@pytest.mark.parametrize(
    "sequence",
    [
        moving(sheet(12)),
        moving(sheet(12), 1),
        moving(sheet(2), dtype=np.float32),
        synth.ocean(20),
        WALKER,
    ],
    ids=["sheet", "one frame", "square", "ocean", "walker"],
)
def test_sound_sequences_have_no_findings_whatever_is_lost(sequence: Sequence) -> None:
    diagnosis = diagnosed(sequence)
    assert codes(diagnosis) == []
    n_frames, k, _ = sequence.vertices.shape
    for share in (0.3, 0.1) if k > 1000 else ():  # of so few, some would never be seen
        known = np.stack(list(losses.random_known(n_frames, k, share)))
        assert codes(diagnosed(replace(sequence, known=known))) == []
        holes = np.where(known[..., None], sequence.vertices, np.float32(np.nan))
        assert codes(diagnosed(replace(sequence, vertices=holes))) == []


def test_where_few_vertices_are_seen_the_positions_of_others_do_not_count() -> None:
    sound = moving(sheet(5))
    known = np.random.default_rng(1).random(sound.vertices.shape[:2]) < 0.5
    known[0] = True
    far = sound.vertices + 100.0 * (np.arange(16) % 2)[:, None, None]
    vertices = np.where(known[..., None], sound.vertices, far)
    assert codes(diagnosed(replace(sound, vertices=vertices, known=known))) == []


def test_recordings_raise_no_false_alarm(data: Path) -> None:
    for path in sorted(set(data.glob("*.npz")) - set(data.glob("*_scans.npz"))):
        diagnosis = diagnosed(dynmesh.read(path)[:60])
        assert codes(diagnosis) == [], path


def test_most_outliers_are_found_and_nothing_else() -> None:
    truth = WALKER.vertices[:20]
    frames = np.stack(list(losses.add_outliers(truth, WALKER.faces, 0.01)))
    astray = (frames != truth).any(axis=2)
    (finding,) = diagnosed(replace(WALKER, vertices=frames)).findings
    assert finding.code == "outliers"
    assert 0.9 * astray.sum() < finding.count <= astray.sum()
    assert not set(finding.vertices) - set(np.flatnonzero(astray.any(axis=0)))


def test_no_exact_position_is_an_outlier_where_a_surface_bends_strongly() -> None:
    """A car is bent to a circle, and most edges become longer."""
    car = synth.beetle(1)
    first = car.vertices[0].astype(np.float64)
    height = first[:, 2] - first[:, 2].min()
    frames = []
    for turn in np.linspace(0.0, 9.0, 11):
        angle, arm = turn * height / height.max(), first[:, 0] - first[:, 0].mean()
        arm += height.max() / max(turn, 1e-9)
        bent = np.stack([arm * np.cos(angle), first[:, 1], arm * np.sin(angle)], axis=1)
        frames.append(bent - bent.mean(axis=0))
    found = diagnosed(replace(car, vertices=np.array(frames, np.float32))).findings
    assert "outliers" not in [finding.code for finding in found]


def curtain() -> Sequence:
    """Cloth of which one edge rests, and that swings faster and faster."""
    cloth = sheet(14)
    away = cloth.vertices[:, 0] / 13
    swing = [0.4 * n * np.sin(0.9 * n) for n in range(20)]
    moved = [np.outer(away * s, [0.0, 0.0, 1.0]) for s in swing]
    return Sequence(cloth.vertices + moved, cloth.faces)


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_a_held_limb_is_found_and_left_out(noise: float) -> None:
    """And no part that rests beside one that begins to move, as that of a heart, or a curtain."""
    assert codes(diagnosed(synth.heart(40))) == []
    assert "held" not in codes(diagnosed(curtain()))
    foot = WALKER.vertices[0, :, 2] < np.quantile(WALKER.vertices[0, :, 2], 0.1)
    vertices = np.stack(list(losses.add_noise(WALKER.vertices, WALKER.faces, noise)))
    held = replace(WALKER, vertices=vertices)
    held.vertices[5:, foot] = vertices[4, foot]
    finding = next(one for one in diagnosed(held[:12]).findings if one.code == "held")
    assert set(finding.vertices) <= set(np.flatnonzero(foot))
    assert finding.count > 0.9 * 7 * foot.sum()
    left, taken = (
        dynmesh.complete(held[:12], reject_outliers=rejects) for rejects in (True, False)
    )
    assert taken.report.held == left.report.held > 0
    error, usual = (np.abs(one.vertices - WALKER.vertices[:12]).max() for one in (left, taken))
    assert error < 0.1 * usual


def test_empty_and_still_sequences_are_diagnosed() -> None:
    nothing = np.full((3, 4, 3), np.nan)
    no_faces = np.empty((0, 3), np.int64)
    assert "first_frame_incomplete" in codes(diagnosed(Sequence(nothing, no_faces)))
    found = diagnosed(Sequence(nothing, np.array([[0, 1, 2]]))).findings[0]
    assert (found.code, found.severity) == ("first_frame_incomplete", "error")
    still = diagnosed(Sequence(np.ones((3, 4, 3)), np.array([[0, 1, 2], [1, 2, 3]])))
    assert codes(still) == ["coincident_vertices"]
    json.dumps(still.as_dict(), allow_nan=False)
    with pytest.raises(ValueError, match="no frame"):
        diagnosed(Sequence(np.empty((0, 4, 3)), no_faces))
    with pytest.raises(ValueError, match="no vertices"):
        diagnosed(Sequence(np.empty((3, 0, 3)), no_faces))


@settings(max_examples=150, deadline=None)
@given(meshes())
def test_the_findings_agree_with_the_core(mesh: Mesh) -> None:
    sequence = moving(mesh, 3)
    diagnosis = diagnosed(sequence)
    topology = dynmesh.Completer(mesh.faces, mesh.vertices).topology
    found = {finding.code: finding for finding in diagnosis.findings}

    def places(code: str) -> list[int]:
        return found[code].faces.tolist() if code in found else []

    refused = topology.refused_faces
    for code, kind in (
        ("degenerate_faces", "degenerate"),
        ("non_manifold_edges", "non_manifold_edge"),
    ):
        assert places(code) == [face.index for face in refused if face.kind == kind]
    json.dumps(diagnosis.as_dict(), allow_nan=False)


def test_memory_does_not_grow_with_the_frames(tmp_path: Path) -> None:
    ocean = synth.ocean(10)
    peaks = []
    for repetitions in (2, 20):  # 0.6 MB and 6 MB
        longer = np.tile(ocean.vertices, (repetitions, 1, 1))
        dynmesh.write(tmp_path / "a.npy", replace(ocean, vertices=longer, fps=None))
        tracemalloc.start()
        diagnosed(tmp_path / "a.npy")
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < peaks[0] + 300_000


def test_the_command_prints_text_and_json(tmp_path: Path) -> None:
    sequence, _ = broken("outliers")
    path, sound = (tmp_path / f"{name}.npz" for name in ("a", "sound"))
    dynmesh.write(path, sequence)
    dynmesh.write(sound, moving(sheet(12)))
    told = run("info", path).stdout
    assert re.search(r"^warning: 3 outliers that edges", told, re.MULTILINE)
    assert "No problems were found." in run("info", sound, "--strict").stdout
    assert json.loads(run("info", path, "--json", "--strict", code=1).stdout)["findings"]
