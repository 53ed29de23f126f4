"""What `dynmesh.diagnose` and `dynmesh info` find, and what they leave alone."""

import io
import json
import re
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from commands import dynmesh_command as run
from conftest import REPOSITORY
from hypothesis import given, settings
from meshes import Array, Mesh, join, meshes, sheet
from rich.console import Console
from typer.testing import CliRunner

import dynmesh
from dynmesh import Sequence, _terminal, cli, degrade, synth
from dynmesh.diagnosis.finding import CODES, MOST_PLACES, SEVERITIES, frames_listed, listed
from dynmesh.files import formats

N_FRAMES = 16


def moving(mesh: Mesh, n_frames: int = N_FRAMES, dtype: Any = np.float64) -> Sequence:
    """A mesh that drifts and swells, a little in every frame."""
    times = np.arange(n_frames)[:, None, None]
    waves = 0.1 * (np.sin(0.3 * times + mesh.vertices[:, :1]) - np.sin(mesh.vertices[:, :1]))
    vertices = mesh.vertices * (1 + 0.002 * times) + np.array([0.05, 0.02, 0.01]) * times + waves
    return Sequence(vertices.astype(dtype), mesh.faces)


@lru_cache
def walker() -> Sequence:
    """The built-in figure."""
    return synth.walker(40)


def masked(sequence: Sequence) -> Array:
    """All known, to be spoilt."""
    return np.ones(sequence.vertices.shape[:2], np.bool_)


def with_faces(*faces: list[int]) -> Sequence:
    mesh = sheet(12)
    return moving(mesh._replace(faces=np.concatenate([mesh.faces, np.array(faces)])))


def with_points(*points: tuple[float, float, float], faces: list[list[int]]) -> Sequence:
    """A sheet of 144 vertices, and more after them."""
    mesh = sheet(12)
    vertices = np.concatenate([mesh.vertices, np.array(points)])
    added = np.array(faces, np.int64).reshape(-1, 3)
    return moving(Mesh(np.concatenate([mesh.faces, added]), vertices))


class Expected(NamedTuple):
    """Of one finding."""

    number: int
    vertices: list[int] | None = None
    faces: list[int] | None = None
    frames: list[int] | None = None
    also: tuple[str, ...] = ()
    """Codes of what cannot but come along."""


Broken = tuple[Sequence, Expected]


def first_frame_incomplete() -> Broken:
    sequence = moving(sheet(12))
    sequence.vertices[0, [3, 7]] = np.nan
    return sequence, Expected(2, [3, 7], frames=[0])


def known_not_finite() -> Broken:
    sequence = moving(sheet(12))
    sequence.vertices[4, 5] = np.inf
    sequence.vertices[6, 2] = np.nan
    return replace(sequence, known=masked(sequence)), Expected(2, [2, 5], frames=[4, 6])


def scrambled_frames() -> Broken:
    sequence = moving(sheet(12))
    sequence.vertices[5] = sequence.vertices[5, np.random.default_rng(0).permutation(144)]
    return sequence, Expected(1, frames=[5])


def zeros() -> Broken:
    sequence = moving(sheet(12))
    sequence.vertices[3:5, 10:14] = 0
    return sequence, Expected(8, [10, 11, 12, 13], frames=[3, 4])


def leaps() -> Broken:
    sequence = moving(sheet(12))
    sequence.vertices[6:] += 5  # a cut
    sequence.vertices[12] -= 5  # a frame in another place
    return sequence, Expected(3, frames=[6, 12, 13])


def outliers() -> Broken:
    sequence = moving(sheet(12))
    sequence.vertices[4, 50] += [0, 0, 10]
    return sequence, Expected(1, [50], frames=[4])


def frames_without_anchors() -> Broken:
    sequence = moving(sheet(12))
    known = masked(sequence)
    known[5:7] = False
    return replace(sequence, known=known), Expected(2, frames=[5, 6])


def hardly_any_anchors() -> Broken:
    sequence = moving(sheet(12))
    sequence.vertices[5, 2:] = np.nan
    return sequence, Expected(1, frames=[5])


def few_anchors() -> Broken:
    sequence = moving(sheet(12))
    sequence.vertices[5, 10:] = np.nan
    return sequence, Expected(1, frames=[5])


def never_seen() -> Broken:
    sequence = moving(sheet(12))
    sequence.vertices[1:, [8, 90]] = np.nan
    return sequence, Expected(2, [8, 90])


def never_seen_in_a_patch() -> Sequence:
    sequence = moving(sheet(12))
    sequence.vertices[1:, sheet(12).vertices[:, 0] < 2] = np.nan
    return sequence


def component_unseen() -> Broken:
    sequence = moving(join(sheet(12), sheet(4, offset=20)))
    sequence.vertices[2:13, 144:] = np.nan
    expected = Expected(1, list(range(144, 160)), frames=list(range(2, 13)))
    return sequence, expected._replace(also=("several_components",))


def coincident_vertices() -> Broken:
    flat = sheet(12)
    flat.vertices[:, 2] = 0
    mesh = join(flat, flat._replace(vertices=flat.vertices + np.array([11, 0, 0])))
    seam = [i for i in range(288) if mesh.vertices[i, 0] == 11]
    return moving(mesh), Expected(24, seam, also=("several_components",))


def isolated_vertices() -> Broken:
    return with_points((3, 3, 3), (4, 4, 4), faces=[]), Expected(2, [144, 145])


def far_from_origin() -> Broken:
    mesh = sheet(12)
    return moving(mesh._replace(vertices=mesh.vertices + 1e5), dtype=np.float32), Expected(1)


def non_manifold_edges() -> Broken:
    sequence = with_points((5, 5, 2), faces=[[65, 66, 144]])  # a fin on an inner edge
    around = [f for f, face in enumerate(sequence.faces.tolist()) if {65, 66} <= set(face)]
    return sequence, Expected(1, [65, 66], faces=around)


def non_manifold_vertices() -> Broken:
    sequence = with_points((5, 5, 2), (6, 5, 2), faces=[[65, 144, 145]])
    return sequence, Expected(1, faces=[242])


def flat_faces() -> Broken:
    sequence = with_points((20, 0, 0), (21, 0, 0), (22, 0, 0), faces=[[144, 145, 146]])
    return sequence, Expected(1, faces=[242], also=("several_components",))


def needle_faces() -> Broken:
    sequence = with_points((20, 0, 0), (21, 0.005, 0), (22, 0, 0), faces=[[144, 145, 146]])
    return sequence, Expected(1, faces=[242], also=("several_components",))


def degenerate_faces() -> Broken:
    return with_faces([5, 5, 6], [7, 7, 7]), Expected(2, faces=[242, 243])


def duplicate_faces() -> Broken:
    a, b, c = sheet(12).faces[0].tolist()
    return with_faces([b, c, a], [b, a, c]), Expected(2, faces=[242, 243])


def flipped_faces() -> Broken:
    mesh = sheet(12)
    turned = [0, 40, 41, 150]
    mesh.faces[turned] = mesh.faces[turned, ::-1]
    return moving(mesh), Expected(4, faces=turned)


def one_sided_surface() -> Broken:
    n = 60
    angle = np.repeat(2 * np.pi * np.arange(n) / n, 2)
    across = np.tile([-2.0, 2.0], n)
    radius = 20 + across * np.cos(angle / 2)
    strip = [radius * np.cos(angle), radius * np.sin(angle), across * np.sin(angle / 2)]
    v = 2 * np.arange(n)
    after = np.where(v + 2 == 2 * n, 1, v + 2), np.where(v + 2 == 2 * n, 0, v + 3)
    faces = [np.stack([v, after[0], v + 1], 1), np.stack([v + 1, after[0], after[1]], 1)]
    return moving(Mesh(np.concatenate(faces), np.stack(strip, 1))), Expected(120)


def repeated_frames() -> Broken:
    sequence = moving(sheet(12))
    sequence.vertices[7:9] = sequence.vertices[6]
    return sequence, Expected(2, frames=[7, 8])


def several_components() -> Broken:
    return moving(join(sheet(12), sheet(5, offset=20))), Expected(2)


def small_holes() -> Broken:
    mesh = sheet(12)
    lost = 60  # an inner face
    sequence = moving(mesh._replace(faces=np.delete(mesh.faces, lost, axis=0)))
    return sequence, Expected(1, sorted(mesh.faces[lost].tolist()))


def unlikely_unit() -> Broken:
    return replace(walker(), metres_per_unit=0.01), Expected(1)


def no_faces() -> Broken:
    sequence = moving(sheet(12))
    return replace(sequence, faces=np.empty((0, 3), np.int64)), Expected(1)


BROKEN: dict[str, Callable[[], Broken]] = {
    make.__name__: make
    for make in (
        first_frame_incomplete, known_not_finite, no_faces, scrambled_frames, zeros, leaps,
        outliers, frames_without_anchors, hardly_any_anchors, few_anchors, never_seen,
        component_unseen,
        coincident_vertices, isolated_vertices, far_from_origin, non_manifold_edges,
        non_manifold_vertices, flat_faces, needle_faces, degenerate_faces, duplicate_faces,
        flipped_faces, one_sided_surface, repeated_frames, several_components, small_holes,
        unlikely_unit,
    )
}  # fmt: skip


def info(*arguments: str | Path, code: int = 0) -> str:
    """What the command prints, in this process."""
    result = CliRunner().invoke(cli.app, ["info", *map(str, arguments)])
    assert result.exit_code == code, result.output
    return result.stdout


def codes(diagnosis: dynmesh.Diagnosis) -> list[str]:
    return [finding.code for finding in diagnosis.findings]


@pytest.mark.parametrize("code", CODES)
def test_what_is_broken_is_found_where_it_is(code: str) -> None:
    sequence, expected = BROKEN[code]()
    found = {finding.code: finding for finding in dynmesh.diagnose(sequence).findings}
    assert set(found) == {code, *expected.also}
    finding = found[code]
    assert finding.count == expected.number
    for name in ("vertices", "faces", "frames"):
        places = getattr(expected, name)
        if places is not None:
            assert getattr(finding.where, name).tolist() == places


@pytest.mark.parametrize(
    "sequence",
    [
        moving(sheet(12)),
        moving(sheet(12), 1),
        moving(sheet(2), dtype=np.float32),
        synth.ocean(20),
    ],
    ids=["sheet", "one frame", "square", "ocean"],
)
def test_nothing_is_odd_about_what_is_sound(sequence: Sequence) -> None:
    diagnosis = dynmesh.diagnose(sequence)
    assert codes(diagnosis) == []
    assert diagnosis.severity is None


def test_losing_vertices_alone_is_not_odd() -> None:
    whole = walker()
    assert codes(dynmesh.diagnose(whole)) == []
    n_frames, k, _ = whole.vertices.shape
    for share, expected in ((0.7, []), (0.3, []), (0.1, ["never_seen"])):
        known = np.stack(list(degrade.random_known(n_frames, k, share)))
        diagnosis = dynmesh.diagnose(replace(whole, known=known))
        assert codes(diagnosis) == expected
        assert diagnosis.severity in (None, "note")
        holes = np.where(known[..., None], whole.vertices, np.float32(np.nan))
        assert codes(dynmesh.diagnose(replace(whole, vertices=holes))) == expected


def test_recordings_raise_no_false_alarm(data: Path) -> None:
    small = {"horse_gallop": ["small_holes", "needle_faces"]}
    people = {"crane": "metres", "horse_gallop": "metres"}
    for path in sorted(data.glob("*.npz")):
        diagnosis = dynmesh.diagnose(path)
        assert codes(diagnosis) == small.get(path.stem, []), path
        unit = diagnosis.likely_unit
        assert (None if unit is None else unit.name) == people.get(path.stem), path


def test_most_outliers_are_found_and_nothing_else() -> None:
    truth = walker().vertices[:20]
    frames = np.stack(list(degrade.add_outliers(truth, walker().faces, 0.01)))
    astray = (frames != truth).any(axis=2)
    (finding,) = dynmesh.diagnose(replace(walker(), vertices=frames)).findings
    assert finding.code == "outliers"
    assert 0.9 * astray.sum() < finding.count <= astray.sum()
    assert not set(finding.where.vertices) - set(np.flatnonzero(astray.any(axis=0)))


def test_patches_that_stay_hidden_matter_more() -> None:
    assert dynmesh.diagnose(never_seen()[0]).severity == "note"
    assert dynmesh.diagnose(never_seen_in_a_patch()).severity == "warning"


@pytest.mark.parametrize("code", ["first_frame_incomplete", "known_not_finite"])
def test_an_error_is_what_completion_refuses(code: str) -> None:
    sequence, _ = BROKEN[code]()
    assert dynmesh.diagnose(sequence).severity == "error"
    known = None if sequence.known is None else iter(sequence.known)
    with pytest.raises(ValueError, match="finite"):
        list(dynmesh.complete(sequence.faces, iter(sequence.vertices), known))


def test_frame_0_says_where_to_begin_instead() -> None:
    sequence, _ = BROKEN["first_frame_incomplete"]()
    sequence.vertices[1:3, 9] = np.nan
    assert "Frame 3 is the first whole one" in dynmesh.diagnose(sequence).findings[0].advice
    sequence.vertices[:, 9] = np.nan
    assert "No frame is whole" in dynmesh.diagnose(sequence).findings[0].advice


@pytest.mark.parametrize("scale", [1, 100, 1000])
def test_units_of_people_are_guessed_and_no_others(scale: float) -> None:
    person = replace(walker(), vertices=walker().vertices[:1])
    unit = dynmesh.diagnose(replace(person, vertices=person.vertices * scale)).likely_unit
    assert unit is not None
    assert unit.metres * scale == 1
    assert dynmesh.diagnose(replace(person, vertices=person.vertices * 7)).likely_unit is None
    sheet_of_a_size = replace(person, faces=person.faces[:200])
    assert dynmesh.diagnose(sheet_of_a_size).likely_unit is None


def test_nothing_at_all_is_bearable() -> None:
    nothing = np.full((3, 4, 3), np.nan)
    no_faces = np.empty((0, 3), np.int64)
    assert "first_frame_incomplete" in codes(dynmesh.diagnose(Sequence(nothing, no_faces)))
    assert codes(dynmesh.diagnose(Sequence(nothing, np.array([[0, 1, 2]]))))[0] == CODES[0]
    still = dynmesh.diagnose(Sequence(np.zeros((3, 4, 3)), np.array([[0, 1, 2], [1, 2, 3]])))
    assert {"coincident_vertices", "flat_faces", "repeated_frames"} <= set(codes(still))
    json.loads(still.as_json())
    with pytest.raises(ValueError, match="no frame"):
        dynmesh.diagnose(Sequence(np.empty((0, 4, 3)), no_faces))


@settings(max_examples=150, deadline=None)
@given(meshes())
def test_any_mesh_is_told_as_the_core_tells_it(mesh: Mesh) -> None:
    sequence = moving(mesh, 3)
    diagnosis = dynmesh.diagnose(sequence)
    topology = dynmesh.Completer(mesh.faces, mesh.vertices).topology
    found = {finding.code: finding for finding in diagnosis.findings}

    def places(code: str) -> list[int]:
        return found[code].where.faces.tolist() if code in found else []

    refused = topology.refused_faces
    assert places("degenerate_faces") == [f for f, why in refused if why.startswith("degenerate")]
    assert places("duplicate_faces") == [f for f, why in refused if why.startswith("duplicate")]
    parts = topology.components - topology.isolated_vertices
    assert ("several_components" in found) == (parts > 1)
    if parts > 1:
        assert found["several_components"].count == parts
    isolated = found["isolated_vertices"].count if "isolated_vertices" in found else 0
    assert isolated == topology.isolated_vertices
    # Turned over, the flipped faces are flipped no more.
    faces = mesh.faces.copy()
    flipped = places("flipped_faces")
    faces[flipped] = faces[flipped, ::-1]
    assert "flipped_faces" not in codes(dynmesh.diagnose(replace(sequence, faces=faces)))
    json.loads(diagnosis.as_json())


def test_the_most_important_comes_first() -> None:
    sequence, _ = BROKEN["needle_faces"]()
    sequence.vertices[3, 10:14] = 0
    sequence.vertices[0, 3] = np.nan
    found = dynmesh.diagnose(sequence).findings
    ranks = [(SEVERITIES.index(f.severity), CODES.index(f.code)) for f in found]
    assert len(ranks) > 2
    assert ranks == sorted(ranks)


def test_json_holds_it_all_and_is_limited() -> None:
    sequence, _ = BROKEN["outliers"]()
    diagnosis = dynmesh.diagnose(sequence)
    parsed = json.loads(diagnosis.as_json())
    assert parsed == diagnosis.as_dict()
    assert (parsed["schema"], parsed["version"]) == ("dynmesh-diagnosis", 1)
    (finding,) = parsed["findings"]
    assert finding["where"] == {"vertices": [50], "faces": [], "frames": [4]}
    assert finding["worst"] == pytest.approx(10 / 1.1, rel=0.3)  # mean edges
    assert parsed["sequence"]["frames"] == N_FRAMES
    assert parsed["mesh"]["boundary_edges"] == 44
    still = np.zeros((2, 3 * MOST_PLACES, 3)) + np.arange(3 * MOST_PLACES)[:, None]
    alone = dynmesh.diagnose(Sequence(still, np.array([[0, 0, 0]])))
    isolated = next(f for f in alone.findings if f.code == "isolated_vertices")
    assert isolated.count == 3 * MOST_PLACES
    assert len(isolated.where.vertices) == MOST_PLACES


def test_places_are_listed_as_people_do() -> None:
    assert listed("vertex", [4]) == "vertex 4"
    assert listed("face", [4, 6]) == "faces 4 and 6"
    assert listed("vertex", range(9)) == "vertices 0, 1, 2, 3, 4 and 4 others"
    assert frames_listed([1, 2, 3, 7, 9, 10]) == "frames 1 to 3, 7, 9 and 10"


@pytest.mark.parametrize("format", [name for name in formats if formats[name].writer])
def test_a_file_is_told_as_the_sequence_is(format: str, tmp_path: Path) -> None:
    sequence, _ = BROKEN["outliers"]()
    suffix = formats[format].suffixes[0]
    path = tmp_path / (f"a_%04d{suffix}" if format in ("ply", "obj") else f"a{suffix}")
    try:
        dynmesh.write(path, sequence)
    except ImportError as error:
        pytest.skip(str(error))
    (finding,) = dynmesh.diagnose(path).findings
    assert (finding.code, finding.where.frames.tolist()) == ("outliers", [4])
    with dynmesh.open(path) as reader:
        assert codes(dynmesh.diagnose(reader)) == ["outliers"]
    assert "1 position astray" in info(path)


def test_memory_does_not_grow_with_the_frames(tmp_path: Path) -> None:
    ocean = synth.ocean(10)
    peaks = []
    for repetitions in (2, 20):  # 0.6 MB and 6 MB
        dynmesh.write(
            tmp_path / "a.npy",
            replace(ocean, vertices=np.tile(ocean.vertices, (repetitions, 1, 1)), fps=None),
        )
        tracemalloc.start()
        dynmesh.diagnose(tmp_path / "a.npy")
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < peaks[0] + 300_000


def test_the_command_says_it_in_every_way(tmp_path: Path) -> None:
    sequence, _ = BROKEN["outliers"]()
    path, sound = tmp_path / "a.npz", tmp_path / "sound.npz"
    dynmesh.write(path, sequence)
    dynmesh.write(sound, moving(sheet(12)))
    shown = info(path)
    assert "1 warning\n" in shown
    assert re.search(r"^warning +1 position astray, more than 4 mean edges", shown, re.MULTILINE)
    assert "Nothing odd was found." in info(sound, "--strict")
    assert json.loads(info(path, "--json"))["severity"] == "warning"
    assert json.loads(run("info", path, "--json", "--strict", code=1).stdout)["findings"]
    holes = tmp_path / "holes.npz"  # no more than a note
    dynmesh.write(holes, BROKEN["small_holes"]()[0])
    assert "1 note\n" in info(holes, "--strict")
    assert "no such file" in run("info", tmp_path / "b.npz", "--json", code=1).stderr.lower()


def test_a_bar_waits_for_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    shown = io.StringIO()
    monkeypatch.setattr(_terminal, "_console", Console(file=shown, force_terminal=True))
    assert list(_terminal.track(range(3), 3, "reading", patience=60)) == [0, 1, 2]
    assert "reading" not in shown.getvalue()
    assert list(_terminal.track(range(3), 3, "reading")) == [0, 1, 2]
    assert "reading" in shown.getvalue()


def test_the_page_explains_every_finding() -> None:
    page = (REPOSITORY / "docs" / "diagnosis.md").read_text()
    explained = re.findall(r"^\| `(\w+)` \| (?:error|warning|note)", page, re.MULTILINE)
    assert explained == sorted(explained, key=CODES.index)
    assert set(explained) == set(CODES)


class TestPicture:
    """`draw`, and `dynmesh info --picture`."""

    @pytest.fixture(autouse=True)
    def _needs_pyvista(self) -> None:
        pytest.importorskip("pyvista", reason="pictures need pyvista: pip install 'dynmesh[view]'")

    @staticmethod
    def pixels(sequence: Sequence, folder: Path) -> Array:
        """(height, width, 3) of its picture."""
        from PIL import Image

        from dynmesh.diagnosis.picture import draw

        draw(dynmesh.diagnose(sequence), folder / "a.png", heading="a", size=300)
        with Image.open(folder / "a.png") as image:
            assert image.format == "PNG"
            return np.asarray(image.convert("RGB")).astype(int)

    @staticmethod
    def on_mesh(image: Array, colour: str) -> int:
        """How many pixels left of the legend and above the strip have this hue, lit or not."""
        height, width, _ = image.shape
        sides = image[: height // 2, : int(0.68 * width)] / 255
        wanted = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
        saturated = np.ptp(sides, axis=2) > 0.2
        cosine = (sides @ wanted) / (np.linalg.norm(sides, axis=2) + 1e-9) / np.linalg.norm(wanted)
        return int((saturated & (cosine > 0.98)).sum())

    @pytest.mark.parametrize("code", ["flipped_faces", "never_seen", "isolated_vertices"])
    def test_what_is_odd_has_a_colour(self, code: str, tmp_path: Path) -> None:
        from dynmesh.diagnosis.picture import COLOURS

        sequence, _ = BROKEN[code]()
        assert self.on_mesh(self.pixels(sequence, tmp_path), COLOURS[0]) > 15
        assert self.on_mesh(self.pixels(moving(sheet(12)), tmp_path), COLOURS[0]) == 0

    def test_every_finding_can_be_drawn(self, tmp_path: Path) -> None:
        for code in ("first_frame_incomplete", "known_not_finite", "frames_without_anchors"):
            assert np.ptp(self.pixels(BROKEN[code]()[0], tmp_path)) > 200
        for points in (np.full((3, 4, 3), np.nan), np.zeros((3, 4, 3)), np.zeros((1, 4, 3))):
            assert np.ptp(self.pixels(Sequence(points, np.array([[0, 1, 2]])), tmp_path)) > 200

    def test_leaps_are_marked_along_the_frames(self, tmp_path: Path) -> None:
        marked = self.pixels(leaps()[0], tmp_path)
        sound = self.pixels(moving(sheet(12)), tmp_path)
        strips = [image[-150:, : int(0.8 * image.shape[1])] for image in (marked, sound)]
        red = [((s[..., 0] > 180) & (s[..., 1] < 90) & (s[..., 2] < 60)).sum() for s in strips]
        assert red[0] > 40
        assert red[1] == 0

    def test_the_command_draws_it(self, tmp_path: Path) -> None:
        path, png = tmp_path / "a.npz", tmp_path / "a.png"
        dynmesh.write(path, flipped_faces()[0])
        assert f"{png}: drawn" in run("info", path, "--picture", png).stderr
        assert png.stat().st_size > 10_000
        assert "--overwrite" in run("info", path, "--picture", png, code=1).stderr
        with pytest.raises(ValueError, match=r"must end in \.png"):
            CliRunner().invoke(
                cli.app, ["info", str(path), "--picture", "a"], catch_exceptions=False
            )
