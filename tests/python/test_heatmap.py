"""The values that colours show, their scales, and missing vertices."""

from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from meshes import Mesh

from dynmesh import Sequence, metrics, read, write
from dynmesh import open as open_sequence
from dynmesh.draw.heatmap import Heatmap, likely_up, stated_up, whole_faces
from dynmesh.draw.quantities import QUANTITIES, Colour
from dynmesh.draw.scales import CountScale, KnownScale, MeasureScale, plain, round_up
from dynmesh.frames.memory import SequenceReader


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


@pytest.fixture
def path(sequence: Sequence, tmp_path: Path) -> Path:
    """The file of the sequence."""
    write(tmp_path / "partial.npz", sequence)
    return tmp_path / "partial.npz"


def test_missing_vertices_are_invisible_with_and_without_masks(
    sequence: Sequence, tmp_path: Path
) -> None:
    write(tmp_path / "partial.npz", sequence)
    bare = Sequence(np.where(sequence.vertices > 1e9, np.inf, sequence.vertices), sequence.faces)
    write(tmp_path / "bare.npz", bare)
    for name in ("partial.npz", "bare.npz"):
        with open_sequence(tmp_path / name) as reader:
            (frame,) = Heatmap(reader).frames(range(4, 5))
        assert frame.number == 4
        assert np.flatnonzero(~frame.visible).tolist() == [3, 8]


@pytest.mark.parametrize("unit", [None, 0.01])
def test_the_error_is_in_millimetres_or_per_cent_of_the_diagonal(
    unit: float | None,
    path: Path,
    sequence: Sequence,
    tmp_path: Path,
    mesh: Mesh,
    rng: np.random.Generator,
) -> None:
    truth = np.stack([mesh.vertices + 0.1 * i + rng.normal(size=(49, 3)) for i in range(5)])
    write(tmp_path / "truth.npz", Sequence(truth, mesh.faces, metres_per_unit=unit))
    diagonal = np.linalg.norm(np.ptp(truth[0], axis=0))
    per_unit = 10 if unit else 100 / diagonal
    with open_sequence(path) as reader, open_sequence(tmp_path / "truth.npz") as reference:
        heatmap = Heatmap(reader, reference=reference)
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


def test_the_default_colour(path: Path, sequence: Sequence, tmp_path: Path) -> None:
    with open_sequence(path) as reader:
        assert Heatmap(reader).colour == "generation"
    write(tmp_path / "masks.npz", replace(sequence, generation=None, age=None))
    with open_sequence(tmp_path / "masks.npz") as reader:
        assert Heatmap(reader).colour == "known"
    write(tmp_path / "bare.npz", Sequence(sequence.vertices, sequence.faces))
    with open_sequence(tmp_path / "bare.npz") as reader:
        heatmap = Heatmap(reader)
        assert heatmap.colour == "plain"
        assert heatmap.colours == ("plain",)
        assert heatmap.scale("plain", list(heatmap.frames(range(2)))) is None


def test_known_is_generation_0_where_there_are_no_masks(sequence: Sequence, tmp_path: Path) -> None:
    write(tmp_path / "done.npz", replace(sequence, known=None))
    with open_sequence(tmp_path / "done.npz") as reader:
        (frame,) = Heatmap(reader, colour="known").frames(range(3, 4))
    assert sequence.generation is not None
    np.testing.assert_array_equal(frame.values["known"], sequence.generation[3] == 0)


def test_everything_that_there_is_can_be_shown(path: Path, sequence: Sequence) -> None:
    with open_sequence(path) as reader:
        heatmap = Heatmap(reader, reference=None)
        assert heatmap.colours == ("generation", "age", "known", "plain")
        (frame,) = heatmap.frames(range(2, 3))
    assert (*frame.values, "plain") == heatmap.colours
    assert sequence.age is not None
    np.testing.assert_array_equal(frame.values["age"], sequence.age[2])
    assert get_args(Colour) == (*QUANTITIES, "plain")


def test_the_input_says_what_was_observed(path: Path, sequence: Sequence, tmp_path: Path) -> None:
    write(tmp_path / "done.npz", Sequence(sequence.vertices, sequence.faces))
    with open_sequence(path) as partial, open_sequence(tmp_path / "done.npz") as done:
        heatmap = Heatmap(done, input=partial)
        assert heatmap.colour == "known"
        (frame,) = heatmap.frames(range(4, 5))
        scale = heatmap.scale("known", [frame])
    assert scale is not None
    assert [tick.label for tick in scale.ticks] == ["filled in", "observed"]
    assert np.flatnonzero(frame.values["known"] == 0).tolist() == [3, 8]
    assert np.flatnonzero(~frame.beside["input"].visible).tolist() == [3, 8]


@pytest.mark.parametrize(
    ("colour", "message"),
    [
        ("age", r"bare.npz: holds no age; dynmesh complete --provenance writes it"),
        ("generation", r"bare.npz: holds no generation; dynmesh complete --provenance writes it"),
        ("known", r"bare.npz: holds no known masks"),
        ("error", "error requires a reference"),
    ],
)
def test_colours_without_data_are_refused(
    path: Path, tmp_path: Path, colour: str, message: str
) -> None:
    sequence = read(path)
    write(tmp_path / "bare.npz", Sequence(sequence.vertices, sequence.faces))
    with (
        open_sequence(tmp_path / "bare.npz") as reader,
        pytest.raises(ValueError, match=message),
    ):
        Heatmap(reader, colour=colour)  # type: ignore[arg-type]


def test_unsuitable_references_are_refused(path: Path, tmp_path: Path, mesh: Mesh) -> None:
    shifted = np.stack([mesh.vertices] * 5)
    write(tmp_path / "short.npz", Sequence(shifted[:4], mesh.faces))
    write(tmp_path / "other.npz", Sequence(shifted, mesh.faces[::-1].copy()))
    write(tmp_path / "truth.npz", Sequence(shifted, mesh.faces))
    write(tmp_path / "point.npz", Sequence(np.zeros_like(shifted), mesh.faces))
    with open_sequence(path) as reader:
        for name, message in (
            ("short.npz", "partial.npz has 5 frames, but .*short.npz has 4"),
            ("other.npz", "different faces"),
            ("point.npz", "errors have no unit"),
        ):
            with (
                open_sequence(tmp_path / name) as reference,
                pytest.raises(ValueError, match=message),
            ):
                Heatmap(reader, reference=reference)
        with (
            open_sequence(tmp_path / "truth.npz") as reference,
            pytest.raises(ValueError, match=r"partial.npz: frame 4 lacks vertex 3"),
        ):
            list(Heatmap(reference, reference=reader).frames(range(5)))


def test_scales_cover_what_is_shown(path: Path) -> None:
    with open_sequence(path) as reader:
        for colour in ("generation", "age", "known"):
            heatmap = Heatmap(reader, colour=colour)
            frames = list(heatmap.frames(range(5)))
            scale = heatmap.scale(heatmap.colour, frames)
            assert scale is not None
            for frame in frames:
                places = scale.position(frame.values[heatmap.colour])
                assert ((places >= 0) & (places <= 1)).all()
            assert [tick.position for tick in scale.ticks] == sorted(
                t.position for t in scale.ticks
            )


def test_measures_are_placed_by_decades() -> None:
    scale = MeasureScale("error", "%", 0.02, 2)
    places = scale.position(np.array([0.0, 0.02, 0.2, 2, 100.0]))
    np.testing.assert_allclose(places, [0, 0, 0.5, 1, 1], atol=1e-6)
    assert [tick.label for tick in scale.ticks] == ["0.02 % or less", "0.1 %", "1 %", "2 % or more"]
    marked = scale.position(np.array([0.02, 0.1, 1, 2]))
    np.testing.assert_allclose([tick.position for tick in scale.ticks], marked, atol=1e-6)


def test_measures_from_zero_are_placed_evenly() -> None:
    scale = MeasureScale("error", "mm", 0, 6)
    np.testing.assert_allclose(scale.position(np.array([0, 1.5, 3, 9])), [0, 0.25, 0.5, 1])
    labels = ["0 mm", "1.5 mm", "3 mm", "4.5 mm", "6 mm or more"]
    assert [tick.label for tick in scale.ticks] == labels


def test_a_narrow_scale_has_numbers_inside() -> None:
    labels = [tick.label for tick in MeasureScale("error", "mm", 1.5, 6).ticks]
    assert labels == ["1.5 mm or less", "2 mm", "5 mm", "6 mm or more"]


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.1, "0.1"), (1e-6, "0.000001"), (1234.5, "1230"), (2, "2"), (0.30000000000000004, "0.3")],
)
def test_numbers_are_plain(value: float, text: str) -> None:
    assert plain(value) == text


def test_a_range_fixes_the_scale(path: Path, tmp_path: Path, mesh: Mesh) -> None:
    write(tmp_path / "truth.npz", Sequence(np.stack([mesh.vertices] * 5), mesh.faces))
    with open_sequence(path) as reader, open_sequence(tmp_path / "truth.npz") as reference:
        heatmap = Heatmap(reader, reference=reference, range=(0.5, 20))
        frames = list(heatmap.frames(range(4)))
        scale = heatmap.scale("error", frames)
        assert scale is not None
        np.testing.assert_allclose(scale.position(np.array([0.5, 20])), [0, 1], atol=1e-6)
        counts = Heatmap(reader, colour="age", range=(2, 5)).scale("age", frames)
    assert counts is not None
    labels = ["0, observed", "1 to 2", "3", "4", "5 or more"]
    assert [tick.label for tick in counts.ticks] == labels
    steps = (counts.position(np.array([0, 1, 2, 3, 5, 900])) * 5).astype(int)
    assert steps.tolist() == [0, 1, 1, 2, 4, 4]
    labels = [tick.label for tick in CountScale("age", 60, zero="here", fixed=5).ticks]
    assert labels[:3] == ["0, here", "1 to 5", "6"]
    assert labels[-2:] == ["37 to 59", "60 or more"]


@pytest.mark.parametrize(
    ("colour", "ends", "message"),
    [
        ("age", (5.0, 2.0), "not 5 2"),
        ("age", (2.0, 2.0), "not 2 2"),
        ("age", (-1.0, 2.0), "not -1 2"),
        ("age", (0.0, float("nan")), "must be finite, not nan"),
        ("age", (0.5, 2.0), "whole numbers for age, not 0.5 2"),
        ("known", (0.0, 1.0), "not known"),
        ("plain", (0.0, 1.0), "not plain"),
    ],
)
def test_ranges_that_no_scale_has_are_refused(
    colour: Colour, ends: tuple[float, float], message: str, path: Path
) -> None:
    with open_sequence(path) as reader, pytest.raises(ValueError, match=f"range: .*{message}"):
        Heatmap(reader, colour=colour, range=ends)


def test_files_that_differ_in_their_unit_are_refused(sequence: Sequence, tmp_path: Path) -> None:
    write(tmp_path / "cm.npz", replace(sequence, metres_per_unit=0.01))
    write(tmp_path / "m.npz", replace(sequence, metres_per_unit=1.0))
    with (
        open_sequence(tmp_path / "cm.npz") as reader,
        open_sequence(tmp_path / "m.npz") as reference,
        pytest.raises(ValueError, match=r"cm.npz has 0.01 metres per unit, but .*m.npz has 1"),
    ):
        Heatmap(reader, reference=reference)


def test_an_exact_completion_has_a_scale(tmp_path: Path, mesh: Mesh) -> None:
    write(tmp_path / "still.npz", Sequence(np.stack([mesh.vertices] * 3), mesh.faces))
    with open_sequence(tmp_path / "still.npz") as reader:
        heatmap = Heatmap(reader, reference=reader)
        frames = list(heatmap.frames(range(3)))
        scale = heatmap.scale("error", frames)
    assert scale is not None
    assert not scale.position(frames[2].values["error"]).any()


def test_few_counts_have_a_step_each() -> None:
    scale = CountScale("steps", 3, zero="here")
    assert [tick.label for tick in scale.ticks] == ["0, here", "1", "2", "3"]
    np.testing.assert_allclose(scale.position(np.arange(4)), [0.125, 0.375, 0.625, 0.875])


def test_many_counts_share_steps_that_double() -> None:
    scale = CountScale("steps", 20, zero="here", minus_one="nowhere")
    labels = ["0, here", "1", "2", "3 to 4", "5 to 8", "9 to 16", "17 to 20", "nowhere"]
    assert [tick.label for tick in scale.ticks] == labels
    assert len(scale.colours) == len(labels)
    steps = (scale.position(np.array([0, 1, 2, 3, 4, 5, 8, 9, 16, 17, 20, -1])) * 8).astype(int)
    assert steps.tolist() == [0, 1, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7]


@pytest.mark.parametrize("largest", [*range(70), 2**20])
def test_every_count_has_the_step_that_names_it(largest: int) -> None:
    scale = CountScale("steps", largest, zero="here")
    counts = np.unique(np.linspace(1, largest, 100).astype(int)) if largest else np.array([0])
    for count, position in zip(counts, scale.position(counts), strict=True):
        label = min(scale.ticks, key=lambda tick: abs(tick.position - position)).label
        first, _, last = label.split(",")[0].partition(" to ")
        assert int(first) <= count <= int(last or first)


def test_filled_in_is_a_step_only_where_there_can_be_any() -> None:
    assert [tick.label for tick in KnownScale(with_filled_in=False).ticks] == ["observed"]
    both = KnownScale(with_filled_in=True)
    assert [tick.label for tick in both.ticks] == ["filled in", "observed"]
    np.testing.assert_allclose(both.position(np.array([0, 1])), [0.25, 0.75])


@pytest.mark.parametrize(("value", "expected"), [(1, 1), (1.2, 2), (0.021, 0.05), (6e-7, 1e-6)])
def test_limits_are_round(value: float, expected: float) -> None:
    assert round_up(value) == pytest.approx(expected)


def test_triangles_with_a_missing_vertex_are_left_out() -> None:
    faces = np.array([[0, 1, 2], [1, 3, 2], [4, 5, 6]])
    visible = np.array([True, True, True, False, True, False, True, True])
    whole, alone = whole_faces(faces, visible)
    assert whole.tolist() == [[0, 1, 2]]
    assert np.flatnonzero(alone).tolist() == [4, 6, 7]


def test_up_is_what_the_file_says_or_across_a_flat_sheet(tmp_path: Path, mesh: Mesh) -> None:
    sheet = Sequence(mesh.vertices[None], mesh.faces)
    for name, sequence, expected in (
        ("flat", sheet, "z"),
        ("upright", Sequence(np.roll(mesh.vertices, 1, axis=1)[None], mesh.faces), "y"),
        ("said", replace(sheet, up_axis="y"), "y"),
    ):
        write(tmp_path / f"{name}.npz", sequence)
        with open_sequence(tmp_path / f"{name}.npz") as reader:
            assert likely_up(next(iter(reader)).points, reader.header.up_axis) == expected


def test_up_is_also_what_a_file_beside_it_says(mesh: Mesh) -> None:
    sheet = Sequence(mesh.vertices[None], mesh.faces)
    silent, y, z = (SequenceReader(replace(sheet, up_axis=axis)) for axis in (None, "y", "z"))
    assert stated_up(silent, None) is None
    assert stated_up(silent, None, z) == "z"
    assert stated_up(y, z) == "y"
