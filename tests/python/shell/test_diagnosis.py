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
from hypothesis import strategies as st
from meshes import Mesh, join, meshes, sheet

import dynmesh
from dynmesh import Sequence, losses, synth
from dynmesh.advice.diagnosis import KINDS, Diagnosis


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
    frames: list[int] | None = None


SOUND = moving(sheet(12))
X = SOUND.vertices
SPOILT: dict[str, tuple[dict[Any, Any], Expected]] = {
    "known_not_finite": (
        {(4, 5): np.inf, (6, 2): np.nan, "known": ()}, Expected(2, [2, 5], frames=[4, 6])
    ),
    "zeros": (
        {(n, (10, 11, 12, 13)): 0 for n in (3, 4)}, Expected(8, [10, 11, 12, 13], frames=[3, 4])
    ),
    "long_edges": (  # one vertex, and a hole that was filled with one place
        {(4, 50, 2): X[4, 50, 2] + 10, (6, (80, 81)): -999},
        Expected(3, [50, 80, 81], frames=[4, 6]),
    ),
    "held": (
        {(n, (10, 11, 22, 23)): X[2, [10, 11, 22, 23]] for n in (3, 4)},
        Expected(8, [10, 11, 22, 23], frames=[3, 4]),
    ),
}  # fmt: skip
"""What is changed in a sound sequence, in some of them with a mask that lacks these frames."""
FLAT = Mesh(sheet(12).faces, sheet(12).vertices * [1, 1, 0])
TWO = join(FLAT, FLAT._replace(vertices=FLAT.vertices + np.array([11, 0, 0])))
NOTHING = np.full((3, 4, 3), np.nan)
WHOLE: dict[str, tuple[Sequence, Expected]] = {
    "coincident_vertices": (
        moving(TWO), Expected(24, np.flatnonzero(TWO.vertices[:, 0] == 11).tolist())
    ),
    "no_faces": (moving(Mesh(np.empty((0, 3), int), SOUND.vertices[0])), Expected(144)),
    "nothing_known": (Sequence(NOTHING, np.array([[0, 1, 2]])), Expected(3)),
}  # fmt: skip
"""What is wrong throughout."""


def broken(code: str) -> tuple[Sequence, Expected]:
    if code in WHOLE:
        return WHOLE[code]
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
    for name in ("vertices", "frames"):
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
    assert finding.code == "long_edges"
    assert 0.9 * astray.sum() < finding.count <= astray.sum()
    assert not set(finding.vertices) - set(np.flatnonzero(astray.any(axis=0)))


def test_vertices_that_are_numbered_otherwise_are_at_long_edges() -> None:
    vertices = X.copy()
    vertices[5] = X[5, np.random.default_rng(0).permutation(144)]
    (finding,) = diagnosed(replace(SOUND, vertices=vertices)).findings
    assert finding.code == "long_edges"
    assert finding.frames.tolist() == [5]
    assert finding.count > 0.5 * 144


def test_what_is_known_is_told() -> None:
    known = np.random.default_rng(1).random(X.shape[:2]) < 0.5
    known[:, 7] = False
    known[4:6] = False
    known[9, :] = np.arange(144) != 7
    told = str(dynmesh.info(replace(SOUND, known=known)))
    assert re.search(r"\(0.0 to 99.3 %\); 1 vertex never\n", told)
    assert re.search(r"known at most +99.3 %, in frame 9\n", told)
    assert re.search(r"nothing known +in frames 4 and 5\n", told)


def test_faces_that_are_refused_are_counted() -> None:
    """A fin, two that repeat a vertex, and two sheets that touch in one."""
    more = [[65, 66, 144], [5, 5, 6], [7, 7, 7], [42, 145, 146]]
    sheet_, tips = sheet(12), [(5, 5, 2), (5, 0, -1), (6, 0, -1)]
    mesh = Mesh(np.concatenate([sheet_.faces, more]), np.concatenate([sheet_.vertices, tips]))
    told = str(dynmesh.info(moving(mesh)))
    assert "1 non manifold edge, 2 degenerate, 1 non manifold vertex\n" in told


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


@given(few=st.sets(st.integers(0, 143), min_size=3, max_size=8))
@settings(max_examples=30, deadline=None)
def test_a_vertex_that_rests_may_be_one_of_few_that_are_known(few: set[int]) -> None:
    vertices, known = X[:3].copy(), np.ones((3, len(X[0])), np.bool_)
    vertices[1, min(few)] = vertices[0, min(few)]
    known[1] = np.isin(np.arange(len(X[0])), list(few))
    completed = dynmesh.complete(Sequence(vertices, SOUND.faces, known=known))
    assert np.isfinite(completed.vertices).all()
    np.testing.assert_array_equal(completed.vertices[known], vertices[known])


def test_empty_and_still_sequences_are_diagnosed() -> None:
    no_faces = np.empty((0, 3), np.int64)
    found = diagnosed(Sequence(NOTHING, no_faces)).findings
    assert [(one.code, one.severity) for one in found] == [
        ("no_faces", "error"),
        ("nothing_known", "error"),
    ]
    still = dynmesh.info(Sequence(np.ones((3, 4, 3)), np.array([[0, 1, 2], [1, 2, 3]])))
    assert [one["code"] for one in still.to_dict()["findings"]] == ["coincident_vertices"]
    json.dumps(still.to_dict(), allow_nan=False)
    with pytest.raises(ValueError, match="no frame"):
        diagnosed(Sequence(np.empty((0, 4, 3)), no_faces))
    with pytest.raises(ValueError, match="no vertices"):
        diagnosed(Sequence(np.empty((3, 0, 3)), no_faces))


@settings(max_examples=150, deadline=None)
@given(meshes())
def test_faces_that_are_refused_are_listed_as_in_the_core(mesh: Mesh) -> None:
    described = dynmesh.info(moving(mesh, 3)).to_dict()
    topology = dynmesh.Completer(mesh.faces, mesh.vertices).topology
    assert described["mesh"]["refused_faces"] == [vars(face) for face in topology.refused_faces]
    json.dumps(described, allow_nan=False)


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
    sequence, _ = broken("long_edges")
    path, sound = (tmp_path / f"{name}.npz" for name in ("a", "sound"))
    dynmesh.write(path, sequence)
    dynmesh.write(sound, moving(sheet(12)))
    told = run("info", path).stdout
    assert re.search(r"^warning: 3 positions most of whose", told, re.MULTILINE)
    assert "No problems were found." in run("info", sound, "--strict").stdout
    assert json.loads(run("info", path, "--json", "--strict", code=1).stdout)["findings"]
