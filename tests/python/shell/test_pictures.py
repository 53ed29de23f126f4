"""Pictures, what notebooks show, and the values of their colours."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import bluish, reddish
from commands import hide
from meshes import Array, Mesh, sheet
from reference import directed_edges, mean_edge
from shown import HOLED, MOVING, TRUTH

import dynmesh
from dynmesh import Sequence, metrics, write
from dynmesh.draw import notebook
from dynmesh.draw.heatmap import Heatmap, stated_up, whole_faces
from dynmesh.draw.scales import count_scale
from dynmesh.scans import PointScan, open_scans, write_ply
from dynmesh.topology import likely_up

pytest.importorskip("pyvista", reason="pictures need pyvista: pip install 'dynmesh[view]'")
images = pytest.importorskip("PIL.Image")

SEQUENCE = replace(MOVING[:4], vertices=TRUTH.vertices[:4])
"""Four frames of a sheet; after frame 0 the vertices right of x = 5.5 are filled in."""


def draw(sequence: Sequence, folder: Path, **options: Any) -> Array:
    """The pixels (height, width, 3) of a picture of a file, from the front with x to the right."""
    write(folder / "sheet.npz", sequence)
    drawn = dynmesh.picture(folder / "sheet.npz", **{"up": "z", "azimuth": -90, **options})
    drawn.save(folder / "sheet.png")
    with images.open(folder / "sheet.png") as image:
        assert image.format == "PNG"
        return np.asarray(image.convert("RGB")).astype(int)


def test_colours_are_at_their_vertices(tmp_path: Path) -> None:
    first = draw(SEQUENCE, tmp_path, frames=[0], colour="known", size=300)
    left = first[:, :300]  # the colour bar is at the right
    assert bluish(left).sum() > 10_000
    assert not reddish(left).any()
    left = draw(SEQUENCE, tmp_path, frames=[2], colour="known", size=300)[:, :300]
    assert bluish(left).sum() > 4_000
    assert reddish(left).sum() > 4_000
    blue, red = (np.nonzero(mask(left))[1] for mask in (bluish, reddish))
    assert np.percentile(blue, 99) < np.percentile(red, 1) + 20


def test_holes_and_dots_are_drawn(tmp_path: Path) -> None:
    # In one picture, so that they have the same scale and crop.
    sheets = [draw(HOLED, tmp_path, frames=[0, n]) for n in range(1, 5)]
    whole, nothing, dot, half = (int(bluish(image).sum()) for image in sheets)
    frame, bar = whole - nothing, 2 * nothing - whole
    assert frame > 20_000
    assert 0.4 * frame < half - nothing < 0.6 * frame
    assert 0 < dot - nothing < 0.01 * frame
    assert bar < 2000


def test_a_mesh_far_from_the_origin_is_drawn(mesh: Mesh, tmp_path: Path) -> None:
    near = draw(Sequence(mesh.vertices[None], mesh.faces), tmp_path, frames=[0])
    far = draw(Sequence(mesh.vertices[None] + 5e5, mesh.faces), tmp_path, frames=[0])
    areas = [(image < 235).all(axis=2).sum() for image in (near, far)]
    assert areas[0] == pytest.approx(areas[1], rel=0.05)


LEAST: dict[str, Any] = {"vertices": np.zeros((2, 4, 3)), "faces": np.array([[0, 1, 2]])}
TABLES: dict[str, dict[str, Any]] = {
    "has no frames": {"vertices": np.empty((0, 4, 3))},
    "no vertex is known": {"known": np.zeros((2, 4), bool)},
    "takes long": {"vertices": np.zeros((1, notebook.LARGEST_MESH + 1, 3))},
    "cannot be simplified enough": {},
    "this needs k3d": {},
}


@pytest.mark.parametrize("reason", TABLES)
def test_a_sequence_that_cannot_be_played_is_shown_as_a_table(
    reason: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    change = TABLES[reason]
    sequence = dynmesh.Sequence(**LEAST | change) if change else MOVING
    if "simplified" in reason:
        monkeypatch.setattr(notebook, "LARGEST_PLAYER", 100_000)
    if "k3d" in reason:
        hide(monkeypatch, "k3d")
    html = sequence._repr_html_()
    assert "<iframe" not in html
    assert reason in html
    assert f"{sequence.vertices.shape[1]} vertices" in html
    assert len(html.encode()) < 1000


@pytest.fixture
def sequence(mesh: Mesh, rng: np.random.Generator) -> Sequence:
    """Five frames with masks and provenance; two vertices of the last are missing."""
    vertices = np.stack([mesh.vertices + 0.1 * i for i in range(5)])
    generation = rng.integers(-1, 6, vertices.shape[:2]).astype(np.int32)
    generation[0] = 0
    known = np.ones(vertices.shape[:2], np.bool_)
    known[4, [3, 8]] = False
    vertices[4, 3] = np.nan
    vertices[4, 8] = 1e30
    return Sequence(vertices, mesh.faces, known, generation=generation, age=abs(3 * generation))


def test_missing_vertices_are_invisible_with_and_without_masks(sequence: Sequence) -> None:
    bare = Sequence(np.where(sequence.vertices > 1e9, np.inf, sequence.vertices), sequence.faces)
    for of in (sequence, bare):
        (frame,) = Heatmap(of).frames(range(4, 5))
        assert frame.number == 4
        assert np.flatnonzero(~frame.visible).tolist() == [3, 8]


@pytest.mark.parametrize("unit", [None, 0.01])
def test_the_error_is_in_millimetres_or_per_cent_of_the_diagonal(
    unit: float | None, sequence: Sequence, mesh: Mesh, rng: np.random.Generator
) -> None:
    truth = np.stack([mesh.vertices + 0.1 * i + rng.normal(size=(49, 3)) for i in range(5)])
    reference = Sequence(truth, mesh.faces, metres_per_unit=unit)
    per_unit = 10 if unit else 100 / np.linalg.norm(np.ptp(truth[0], axis=0))
    heatmap = Heatmap(sequence, reference=reference)
    assert heatmap.colour == "error"
    frames = list(heatmap.frames(range(0, 5, 2)))
    scale: Any = heatmap.scale("error", frames)
    words = "mm" if unit else "% of the bounding-box diagonal"
    assert scale.title == f"error in {words}"
    assert [frame.number for frame in frames] == [0, 2, 4]
    for frame in frames:
        seen = frame.visible
        places = truth[frame.number, seen], sequence.vertices[frame.number, seen]
        expected = metrics.vertex_error(*places) * per_unit
        np.testing.assert_allclose(frame.values["error"][seen], expected, rtol=1e-12)


def test_known_is_generation_0_or_what_the_input_says(sequence: Sequence) -> None:
    reader = replace(sequence, known=None)
    (frame,) = Heatmap(reader, wanted="known").frames(range(3, 4))
    assert sequence.generation is not None
    np.testing.assert_array_equal(frame.values["known"], sequence.generation[3] == 0)
    np.testing.assert_array_equal(frame.values["age"], abs(3 * sequence.generation[3]))
    done = Sequence(sequence.vertices, sequence.faces)
    masked = replace(sequence, generation=None, age=None)
    heatmap = Heatmap(done, input=masked)
    assert heatmap.colour == "known"
    (frame,) = heatmap.frames(range(4, 5))
    scale: Any = heatmap.scale("known", [frame])
    assert [tick.label for tick in scale.ticks] == ["filled in", "observed"]
    assert np.flatnonzero(frame.values["known"] == 0).tolist() == [3, 8]
    assert np.flatnonzero(~frame.beside["input"].visible).tolist() == [3, 8]


@pytest.mark.parametrize("largest", [*range(70), 2**20])
def test_every_count_has_the_step_that_names_it(largest: int) -> None:
    scale = count_scale("steps", largest, zero="here")
    counts = np.unique(np.linspace(1, largest, 100).astype(int)) if largest else np.array([0])
    for count, position in zip(counts, scale.position(counts), strict=True):
        label = min(scale.ticks, key=lambda tick: abs(tick.position - position)).label
        first, _, last = label.split(",")[0].partition(" to ")
        assert int(first) <= count <= int(last or first)


def test_triangles_with_a_missing_vertex_are_left_out() -> None:
    faces = np.array([[0, 1, 2], [1, 3, 2], [4, 5, 6]])
    visible = np.array([True, True, True, False, True, False, True, True])
    whole, alone = whole_faces(faces, visible)
    assert whole.tolist() == [[0, 1, 2]]
    assert np.flatnonzero(alone).tolist() == [4, 6, 7]


def test_up_is_what_the_files_say_or_across_a_flat_sheet_or_along_what_is_tall(mesh: Mesh) -> None:
    assert likely_up(mesh.vertices, None) == "z"
    assert likely_up(mesh.vertices[:, [0, 2, 1]], None) == "z"
    assert likely_up(mesh.vertices[:, [0, 2, 1]] * [3, 1, 1], None) == "y"
    assert likely_up(np.roll(mesh.vertices, 1, axis=1), None) == "y"
    assert likely_up(mesh.vertices, "y") == "y"
    sheet = Sequence(mesh.vertices[None], mesh.faces)
    silent, y, z = (replace(sheet, up_axis=axis) for axis in (None, "y", "z"))
    assert stated_up(silent, None) is None
    assert stated_up(silent, None, z) == "z"
    assert stated_up(y, z) == "y"


def test_distances_from_the_nearest_point_of_scans(tmp_path: Path) -> None:
    """In mean edges, of scans in millimetres; from the second one, everything is far away."""
    mesh = sheet(6)
    sequence = Sequence(np.stack([mesh.vertices] * 3), mesh.faces, metres_per_unit=1.0)
    above = mesh.vertices + np.array([0, 0, 0.75])
    for number, points in enumerate((above, above[:0], above[:1])):
        write_ply(tmp_path / f"{number}.ply", PointScan(1000 * points, None, None))
    scans = open_scans(tmp_path)
    heatmap = Heatmap(sequence, scans=scans, scan_factor=1e-3)
    assert heatmap.colours == ("distance", "plain")
    every, none, one = (frame.values["distance"] for frame in heatmap.frames(range(3)))
    h = mean_edge(directed_edges(mesh.faces), mesh.vertices)
    np.testing.assert_allclose(every, 0.75 / h, rtol=1e-5)
    assert np.isinf(none).all()
    away = np.linalg.norm(mesh.vertices - above[0], axis=1)
    np.testing.assert_allclose(one, away / h, rtol=1e-5)
    scale: Any = heatmap.scale("distance", [])
    np.testing.assert_array_equal(scale.position(none), 1)
