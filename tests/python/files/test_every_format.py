"""Requirements for all file formats."""

from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import to_file
from every_format import (
    FORMATS,
    KEPT,
    KNOWN,
    MASKED,
    NUMBERED,
    PARTIAL,
    SINGLE_PRECISION,
    TIMED,
    TRACED,
    place,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from sequences import assert_refused

import dynmesh
from dynmesh.formats.format import STATED
from dynmesh.polygons import Polygons, split_polygons


@st.composite
def sequences(draw: st.DrawFn, format: str) -> dynmesh.Sequence:
    """Draws what this format may be given, with values where nothing is known."""
    n, k = draw(st.integers(1, 4)), draw(st.integers(3, 9))
    rng = np.random.default_rng(draw(st.integers(0, 99)))
    polygons = None
    faces: Any = np.array([[0, 1, 2]] * draw(st.integers(1, 3)), np.int32)
    if k > 3 and draw(st.booleans()):
        polygons = Polygons(np.array([4, 3], np.int32), np.array([0, 1, 2, 3, 2, 1, 0], np.int32))
        faces, _ = split_polygons(polygons)
    optional: dict[str, Any] = {
        "known": rng.random((n, k)) < 0.5,
        "fps": draw(st.sampled_from([24.0, 1.0, 30000 / 1001])),
        "start": draw(st.sampled_from([1001, -7, 1000.5])),
        "up_axis": draw(st.sampled_from(["y", "z"])),
        "name": "/world/body",
        "metres_per_unit": draw(st.sampled_from([0.01, 1 / 3])),
    }
    if format in TRACED and draw(st.booleans()):
        for name in ("generation", "age"):
            optional[name] = rng.integers(0, 2**31 - 1, (n, k)).astype(np.int32)
        optional["standard_error"] = rng.random((n, k)).astype(np.float32)
        optional["standard_error_of"] = draw(st.sampled_from(["position", "surface"]))
    traces = {"generation", "age", "standard_error", "standard_error_of"}
    stated = {key: optional[key] for key in optional if key in traces or draw(st.booleans())}
    vertices = rng.normal(size=(n, k, 3)) / 3
    vertices = vertices.astype(draw(st.sampled_from([np.float32, np.float64])))
    return dynmesh.Sequence(vertices, faces, polygons=polygons, **stated)


def as_kept(kept: dynmesh.Sequence, format: str) -> dynmesh.Sequence:
    """What a file of this format gives back: what it cannot hold is unknown."""
    vertices = kept.vertices
    if format in SINGLE_PRECISION | {"obj"}:
        vertices = vertices.astype(np.float64 if format == "obj" else np.float32)
    if format not in MASKED and kept.known is not None:
        vertices = np.where(kept.known[..., None], vertices, np.nan)
        kept = replace(kept, known=None)
    if format in ("usd", "alembic") and kept.name is None:
        kept = replace(kept, name="/mesh")
    lost = {*kept.described()} & {*STATED} - KEPT[format]
    lost |= {"start"} if format in NUMBERED and kept.start % 1 else set()
    changes: Any = {name: 0 if name == "start" else None for name in lost}
    return replace(kept, vertices=vertices, **changes)


@pytest.mark.parametrize("format", FORMATS)
@settings(max_examples=20)
@given(st.data())
def test_any_sequence_survives(
    tmp_path_factory: pytest.TempPathFactory, format: str, data: st.DataObject
) -> None:
    path = place(tmp_path_factory.mktemp("some [2]"), format, "a body [1] é")
    sequence = data.draw(sequences(format))
    remarks = " ".join(dynmesh.write(path, sequence).remarks)
    again = vars(dynmesh.read(path))
    stated = sequence.header.stated
    for name in {*stated} & {*STATED}:
        is_lost = again[name] is None or (name == "start" and again[name] != stated[name])
        renumbered = name == "start" and "numbered from 0" in remarks
        assert is_lost == (STATED[name] in remarks or renumbered), name
    kept = as_kept(sequence, format)
    for name, value in ((field.name, getattr(kept, field.name)) for field in fields(kept)):
        if name == "origin":
            assert (again[name] is not None) == (format == "usd")  # over which a layer can lie
        elif name == "fps" and value is not None:
            assert again["fps"] == pytest.approx(value, rel=1e-5)
        elif isinstance(value, np.ndarray):
            assert name == "faces" or again[name].dtype == value.dtype
            np.testing.assert_array_equal(again[name], value, err_msg=name)
        elif name == "polygons" and value is not None:
            for one, other in zip(again[name], value, strict=True):
                np.testing.assert_array_equal(one, other)
        else:
            assert again[name] == value, name


@pytest.mark.parametrize(
    ("times", "fps"),
    [
        ([1.0, 2, 3, 7, 8, 9, 10], 24),
        ([-4.5, -3.5, 1001, 1002, 1003.25, 1004, 1005], 24),
        ([17.0, 20, 23, 26, 29, 32, 35], 24),
        ([17.0, 20, 23, 26, 29, 32, 35], None),
    ],
)
@pytest.mark.parametrize("format", sorted(TIMED))
def test_times_of_frames_survive_completion(
    tmp_path: Path, format: str, times: list[float], fps: float | None
) -> None:
    source, target = place(tmp_path, format), place(tmp_path, format, "completed")
    dynmesh.write(source, replace(PARTIAL, start=times[0], times=np.array(times), fps=fps))
    to_file.complete(source, target)
    for path in (source, target):
        again = dynmesh.open(path).header
        seconds = again.numbers / (again.fps or 1)
        np.testing.assert_allclose(seconds, np.array(times) / (fps or 1), rtol=1e-9)
        # Evenly spaced time codes of USD are frames of a lower rate.
        assert again.fps == (fps if format != "usd" or again.times is not None else 8)


@pytest.mark.parametrize("format", FORMATS)
def test_any_frames_can_be_requested(tmp_path: Path, format: str) -> None:
    path = place(tmp_path, format)
    dynmesh.write(path, PARTIAL)
    with dynmesh.open(path) as reader:
        assert (reader.n_frames, reader.n_vertices) == (7, 144)
        for numbers in (slice(2, 6, 2), slice(5, None), slice(3, 3), slice(None, 1)):
            frames = list(reader.frames(numbers.start or 0, numbers.stop, numbers.step or 1))
            points = np.array([frame.points for frame in frames]).reshape(-1, 144, 3)
            np.testing.assert_array_equal(points, PARTIAL.vertices[numbers])
            if format in MASKED:
                known = np.array([frame.known for frame in frames], bool).reshape(-1, 144)
                np.testing.assert_array_equal(known, KNOWN[numbers])
        first, second = iter(reader), iter(reader)
        next(first)
        np.testing.assert_array_equal(next(second).points, PARTIAL.vertices[0])
        np.testing.assert_array_equal(next(first).points, PARTIAL.vertices[1])


@pytest.mark.parametrize("format", sorted(SINGLE_PRECISION))
def test_what_float32_cannot_hold_is_refused(tmp_path: Path, format: str) -> None:
    path = place(tmp_path, format)
    vertices = np.nan_to_num(PARTIAL.vertices.astype(np.float64))
    vertices[1, 5, 0] = np.inf  # not finite, so it is missing
    dynmesh.write(path, dynmesh.Sequence(vertices, PARTIAL.faces))
    assert np.isinf(dynmesh.read(path).vertices).sum() == 1
    before = path.read_bytes()
    vertices[2, 7, 1] = -1e39
    with pytest.raises(ValueError, match=r"frame 2: vertex 7 at \[.*-1e\+39.* range of") as caught:
        dynmesh.write(path, dynmesh.Sequence(vertices, PARTIAL.faces))
    assert str(caught.value).startswith(f"{path}: ")
    assert path.read_bytes() == before
    if format not in MASKED:
        known = vertices[..., 1] > -1e38
        dynmesh.write(path, dynmesh.Sequence(vertices, PARTIAL.faces, known))
        assert np.isnan(dynmesh.read(path).vertices[2, 7]).all()


@pytest.mark.parametrize("format", sorted({*FORMATS} - TRACED))
def test_provenance_is_refused_by_formats_without_it(tmp_path: Path, format: str) -> None:
    source = tmp_path / "in.npz"
    dynmesh.write(source, PARTIAL)
    with pytest.raises(ValueError, match=r"generation|provenance") as caught:
        to_file.complete(source, place(tmp_path, format), provenance=True)
    assert ".npz" in str(caught.value)
    assert [path.name for path in tmp_path.iterdir()] == ["in.npz"]


@pytest.mark.parametrize("format", ["npz", "hdf5", "alembic"])
def test_the_suffix_can_be_overridden(tmp_path: Path, format: str) -> None:
    """The other formats have several files, or libraries that insist on the suffix."""
    path = tmp_path / "scan.dat"
    dynmesh.write(path, PARTIAL, format=format)
    np.testing.assert_array_equal(dynmesh.read(path, format=format).vertices, PARTIAL.vertices)
    with pytest.raises(ValueError, match=r"'\.dat'.* \.npz"):
        dynmesh.read(path)


@pytest.mark.parametrize("format", FORMATS)
def test_masks_may_be_in_another_file(tmp_path: Path, format: str) -> None:
    zeros = np.where(np.isnan(PARTIAL.vertices), 0, PARTIAL.vertices + 1)
    path = place(tmp_path, format)
    dynmesh.write(path, dynmesh.Sequence(zeros, PARTIAL.faces))
    assert PARTIAL.known is not None
    np.save(tmp_path / "mask.npy", PARTIAL.known)
    options: Any
    for options in (
        {"known": tmp_path / "mask.npy"},
        {"known": PARTIAL.known},
        {"missing": "zero"},
    ):
        again = dynmesh.read(path, **options)
        np.testing.assert_array_equal(again.known, PARTIAL.known)


@pytest.mark.parametrize("format", ["npy", "pc2"])
def test_positions_alone_take_their_faces_from_elsewhere(tmp_path: Path, format: str) -> None:
    path = place(tmp_path, format)
    dynmesh.write(path, PARTIAL)
    for beside in {*tmp_path.iterdir()} - {path}:
        beside.unlink()
    assert_refused(path, read=dynmesh.open)
    dynmesh.write(tmp_path / "mesh.npz", PARTIAL[:1])
    dynmesh.write(
        tmp_path / "other.npz", dynmesh.Sequence(np.zeros((1, 4, 3)), np.array([[0, 1, 2]]))
    )
    for faces in (tmp_path / "mesh.npz", PARTIAL.faces):
        again = dynmesh.read(path, faces=faces)
        np.testing.assert_array_equal(again.faces, PARTIAL.faces)
        assert (again.polygons is None) == (faces is PARTIAL.faces)
    stated = (again.up_axis, dynmesh.read(path, faces=tmp_path / "mesh.npz").up_axis)
    assert stated == (None, "y")
    for wrong in (tmp_path / "other.npz", np.array([[0, 1, 2, 144]])):
        assert_refused(path, "144", dynmesh.open, faces=wrong)
