"""The values that colours show, their scales, and missing vertices."""

from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from meshes import Mesh, sheet

from dynmesh import Sequence, metrics
from dynmesh.draw.heatmap import Heatmap, likely_up, stated_up, whole_faces
from dynmesh.draw.quantities import QUANTITIES, Colour
from dynmesh.draw.scales import CountScale, MeasureScale
from dynmesh.files.memory import SequenceReader
from dynmesh.scans import PointScan, open_scans, write_ply


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
        (frame,) = Heatmap(SequenceReader(of)).frames(range(4, 5))
        assert frame.number == 4
        assert np.flatnonzero(~frame.visible).tolist() == [3, 8]


@pytest.mark.parametrize("unit", [None, 0.01])
def test_the_error_is_in_millimetres_or_per_cent_of_the_diagonal(
    unit: float | None, sequence: Sequence, mesh: Mesh, rng: np.random.Generator
) -> None:
    truth = np.stack([mesh.vertices + 0.1 * i + rng.normal(size=(49, 3)) for i in range(5)])
    reference = SequenceReader(Sequence(truth, mesh.faces, metres_per_unit=unit))
    per_unit = 10 if unit else 100 / np.linalg.norm(np.ptp(truth[0], axis=0))
    heatmap = Heatmap(SequenceReader(sequence), reference=reference)
    assert heatmap.colour == "error"
    frames = list(heatmap.frames(range(0, 5, 2)))
    scale = heatmap.scale("error", frames)
    assert scale is not None
    words = "mm" if unit else "% of the bounding-box diagonal"
    assert scale.title == f"error in {words}"
    assert [frame.number for frame in frames] == [0, 2, 4]
    for frame in frames:
        seen = frame.visible
        places = truth[frame.number, seen], sequence.vertices[frame.number, seen]
        expected = metrics.vertex_error(*places) * per_unit
        np.testing.assert_allclose(frame.values["error"][seen], expected, rtol=1e-12)


def test_the_colours_are_what_there_is_and_the_first_is_the_default(sequence: Sequence) -> None:
    bare = Sequence(sequence.vertices, sequence.faces)
    for of, colours in (
        (sequence, ("generation", "age", "known", "plain")),
        (replace(sequence, generation=None, age=None), ("known", "plain")),
        (bare, ("plain",)),
    ):
        heatmap = Heatmap(SequenceReader(of))
        (frame,) = heatmap.frames(range(2, 3))
        assert heatmap.colour == colours[0]
        assert (*frame.values, "plain") == heatmap.colours == colours
    assert heatmap.scale("plain", []) is None
    assert get_args(Colour) == (*QUANTITIES, "plain")


def test_known_is_generation_0_where_there_are_no_masks(sequence: Sequence) -> None:
    reader = SequenceReader(replace(sequence, known=None))
    (frame,) = Heatmap(reader, colour="known").frames(range(3, 4))
    assert sequence.generation is not None
    np.testing.assert_array_equal(frame.values["known"], sequence.generation[3] == 0)
    np.testing.assert_array_equal(frame.values["age"], abs(3 * sequence.generation[3]))


def test_the_input_says_what_was_observed(sequence: Sequence) -> None:
    done = SequenceReader(Sequence(sequence.vertices, sequence.faces))
    heatmap = Heatmap(done, input=SequenceReader(sequence))
    assert heatmap.colour == "known"
    (frame,) = heatmap.frames(range(4, 5))
    scale = heatmap.scale("known", [frame])
    assert scale is not None
    assert [tick.label for tick in scale.ticks] == ["filled in", "observed"]
    assert np.flatnonzero(frame.values["known"] == 0).tolist() == [3, 8]
    assert np.flatnonzero(~frame.beside["input"].visible).tolist() == [3, 8]


@pytest.mark.parametrize("colour", ["generation", "age", "known"])
def test_scales_cover_what_is_shown(sequence: Sequence, colour: Colour) -> None:
    heatmap = Heatmap(SequenceReader(sequence), colour=colour)
    frames = list(heatmap.frames(range(5)))
    scale = heatmap.scale(heatmap.colour, frames)
    assert scale is not None
    for frame in frames:
        places = scale.position(frame.values[heatmap.colour])
        assert ((places >= 0) & (places <= 1)).all()
    assert [tick.position for tick in scale.ticks] == sorted(t.position for t in scale.ticks)


@pytest.mark.parametrize(
    ("low", "high", "values", "places", "labels"),
    [
        (0.02, 2, [0, 0.2, 9], [0, 0.5, 1], ["0.02 mm or less", "0.1 mm", "1 mm", "2 mm or more"]),
        (0, 6, [0, 1.5, 9], [0, 0.25, 1], ["0 mm", "1.5 mm", "3 mm", "4.5 mm", "6 mm or more"]),
        (1.5, 6, [0, 3, 9], [0, 0.5, 1], ["1.5 mm or less", "2 mm", "5 mm", "6 mm or more"]),
    ],
)
def test_measures_are_placed_by_decades_or_evenly_from_zero(
    low: float, high: float, values: list[float], places: list[float], labels: list[str]
) -> None:
    scale = MeasureScale("error", "mm", low, high)
    np.testing.assert_allclose(scale.position(np.array(values)), places, atol=1e-6)
    assert [tick.label for tick in scale.ticks] == labels
    marked = scale.position(np.array([float(label.split()[0]) for label in labels]))
    np.testing.assert_allclose([tick.position for tick in scale.ticks], marked, atol=1e-6)


@pytest.mark.parametrize("largest", [*range(70), 2**20])
def test_every_count_has_the_step_that_names_it(largest: int) -> None:
    scale = CountScale("steps", largest, zero="here")
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


def test_up_is_what_the_files_say_or_across_a_flat_sheet(mesh: Mesh) -> None:
    assert likely_up(mesh.vertices, None) == "z"
    assert likely_up(np.roll(mesh.vertices, 1, axis=1), None) == "y"
    assert likely_up(mesh.vertices, "y") == "y"
    sheet = Sequence(mesh.vertices[None], mesh.faces)
    silent, y, z = (SequenceReader(replace(sheet, up_axis=axis)) for axis in (None, "y", "z"))
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
    heatmap = Heatmap(SequenceReader(sequence), scans=scans, scan_factor=1e-3)
    assert heatmap.colours == ("distance", "plain")
    every, none, one = (frame.values["distance"] for frame in heatmap.frames(range(3)))
    edges = np.unique(np.sort(mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)), axis=0)
    lengths = np.linalg.norm(np.subtract(*mesh.vertices[edges.T]), axis=1)
    np.testing.assert_allclose(every, 0.75 / lengths.mean(), rtol=1e-5)
    assert np.isinf(none).all()
    away = np.linalg.norm(mesh.vertices - above[0], axis=1)
    np.testing.assert_allclose(one, away / lengths.mean(), rtol=1e-5)
    scale = heatmap.scale("distance", [])
    assert scale is not None
    np.testing.assert_array_equal(scale.position(none), 1)
