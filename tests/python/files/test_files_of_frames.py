"""Sequences with one file per frame: how their frames fit together, and lost ones."""

import csv
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import to_file
from commands import dynmesh_command as run
from meshes import Mesh
from plain_files import FACE, POINTS, TRIANGLE, XYZ, ply
from sequences import assert_refused, sea, sequence_of

import dynmesh
from dynmesh.cli.command import slice_of
from dynmesh.formats.times import indices_of


@pytest.mark.parametrize(
    ("second", "message"),
    [
        (TRIANGLE.replace("f", "v 2 2 2\nf"), "has 4 vertices, but f0.obj has 3"),
        (TRIANGLE.replace("1 2 3", "1 3 2"), "its 1 faces are not those of f0.obj"),
    ],
)
def test_frames_of_another_mesh_are_refused(tmp_path: Path, second: str, message: str) -> None:
    (tmp_path / "f0.obj").write_text(TRIANGLE)
    (tmp_path / "f1.obj").write_text(second)
    assert_refused(tmp_path / "f1.obj", message, lambda _: dynmesh.read(tmp_path / "f%d.obj"))


def test_later_frames_may_have_only_points(tmp_path: Path) -> None:
    bare, whole = "v 0 0 0\nv 1 0 0\nv 0 1 0\n", TRIANGLE
    for number, text in enumerate((bare, whole)):
        (tmp_path / f"f{number}.obj").write_text(text)
    assert_refused(tmp_path / "f0.obj", read=lambda _: dynmesh.open(tmp_path / "f%d.obj"))
    for number, text in enumerate((whole, bare)):
        (tmp_path / f"f{number}.obj").write_text(text)
    sequence = dynmesh.read(tmp_path / "f%d.obj")
    np.testing.assert_array_equal(sequence.vertices[1], sequence.vertices[0])
    faces = (f"; face 1: {FACE}", b"3 0 1 2\n"), ("", b""), (f"; face 0: {FACE}", b"")
    for number, (element, row) in enumerate(faces):
        (tmp_path / f"f{number}.ply").write_bytes(ply(f"vertex 3: {XYZ}{element}", POINTS + row))
    assert dynmesh.read(tmp_path / "f%d.ply").vertices.shape == (3, 3, 3)


def test_precision_and_masks_are_those_of_the_first_frame(tmp_path: Path, mesh: Mesh) -> None:
    """Single precision is widened, and a mask comes with every frame or none."""
    known = np.ones((1, 49), np.bool_)
    single, double = (sequence_of(mesh, 1, dtype) for dtype in (np.float32, np.float64))
    dynmesh.write(tmp_path / "f0.ply", double)
    dynmesh.write(tmp_path / "f1.ply", single)
    again = dynmesh.read(tmp_path / "f%d.ply").vertices
    assert again.dtype == np.float64
    np.testing.assert_array_equal(again[1], mesh.vertices.astype(np.float32))
    masked = replace(single, known=known)
    for first, second, told in (
        (single, double, "positions are float64, but float32 in f0"),
        (single, masked, "known .*f0"),
        (masked, single, "known .*f0"),
    ):
        dynmesh.write(tmp_path / "f0.ply", first)
        dynmesh.write(tmp_path / "f1.ply", second)
        assert_refused(tmp_path / "f1.ply", told, lambda _: dynmesh.read(tmp_path / "f%d.ply"))


LOST = (3, 4, 8)
PARTIAL = sea(10, 8, share=0.5, whole=[0], start=1001, fps=None)
KNOWN: Any = PARTIAL.known


def written(folder: Path, suffix: str) -> Path:
    """The sequence in files, without those of the lost frames."""
    path = folder / f"scans/f_%04d{suffix}"
    holes = np.where(KNOWN[:, :, None], PARTIAL.vertices, np.float32(np.nan))
    missing = replace(PARTIAL, vertices=holes, known=None)
    dynmesh.write(path, missing if suffix == ".obj" else PARTIAL)
    for lost in LOST:
        path.with_name(path.name % (1001 + lost)).unlink()
    return path


@pytest.mark.parametrize("suffix", [".ply", ".obj"])
def test_lost_frames_are_frames_without_observations(tmp_path: Path, suffix: str) -> None:
    path = written(tmp_path, suffix)
    assert_refused(path, r"1004.* `gaps` lost", lambda given: dynmesh.open(given))
    read: Any = dynmesh.read(path, gaps="lost")
    kept, lost = np.setdiff1d(range(10), LOST), list(LOST)
    assert (len(read.vertices), read.start) == (10, 1001)
    assert not np.isfinite(read.vertices[lost]).any()
    seen = KNOWN[kept]
    np.testing.assert_array_equal(read.vertices[kept][seen], PARTIAL.vertices[kept][seen])
    if suffix == ".ply":
        np.testing.assert_array_equal(read.known[kept], seen)
        assert not read.known[lost].any()

    output = tmp_path / "made" / "g_%04d.ply"
    report = to_file.complete(path, output, source={"gaps": "lost"})
    assert report.empty == 3
    said = run("complete", path, tmp_path / "a.npz", "--gaps", "lost").stderr
    assert " 3 of the frames" in said
    completer = dynmesh.Completer(PARTIAL.faces, read.vertices[0], method="detail")
    made = dynmesh.read(output).vertices
    for number in range(1, 10):
        points = read.vertices[number], KNOWN[number]
        expected = completer.skip() if number in LOST else completer.push(*points)
        np.testing.assert_array_equal(made[number], expected)


def test_a_mask_cannot_make_a_lost_frame_known(tmp_path: Path) -> None:
    path = written(tmp_path, ".ply")
    everything = np.ones((10, 64), np.bool_)
    read: Any = dynmesh.read(path, gaps="lost", known=everything)
    np.testing.assert_array_equal(read.known.all(axis=1), [i not in LOST for i in range(10)])
    zeros: Any = dynmesh.read(path, gaps="lost", missing="zero")
    assert not zeros.known[list(LOST)].any()


N = 8
FIRST = 1001
TRUTH = sea(N, start=FIRST)
SHOT = sea(N, share=0.6, whole=[3], start=FIRST)
"""A shot that starts at 1001, of which only frame 1004 is whole."""


def test_completion_and_evaluation(tmp_path: Path) -> None:
    path, made, truth = (tmp_path / f"{name}.npz" for name in ("partial", "made", "truth"))
    dynmesh.write(truth, TRUTH)
    dynmesh.write(path, SHOT)
    said = run("complete", path, made, "--start", "1004").stderr
    assert "vertices, frame 1004 not counted" in said
    assert "frame 1004" in run("complete", path, tmp_path / "b.npz").stderr
    assert dynmesh.read(made).start == FIRST
    refused = run("complete", path, tmp_path / "c.npz", "--start", "3", code=2).stderr
    assert "partial.npz: --start: there is no frame 3, only 1001 to 1008" in refused
    table = tmp_path / "errors.csv"
    options = ("--frames", "1002:1005", "--csv", table, "--json")
    whole = json.loads(run("evaluate", made, truth, *options).stdout)
    with table.open() as file:
        rows = list(csv.DictReader(file))
    assert [row["frame"] for row in rows] == ["1002", "1003", "1004"]
    assert float(rows[2]["maximum"]) == 0  # the frame that was whole
    assert whole["maximum"] == max(float(row["maximum"]) for row in rows) > 0


@pytest.mark.parametrize(
    ("text", "times", "expected"),
    [
        ("1002:1005", None, [1, 2, 3]),
        ("1001:1009:3", None, [0, 3, 6]),
        ("1004.5:1006", np.arange(N) * 0.5 + 1001, None),
        ("-3:0", np.arange(N) - 4.0, [1, 2, 3]),
    ],
)
def test_ranges_are_half_open(
    text: str, times: np.ndarray | None, expected: list[int] | None
) -> None:
    numbers = replace(TRUTH, times=times).header.numbers
    if expected is None:
        with pytest.raises(ValueError, match=r"must be some of 1001:1005\.5"):
            indices_of(numbers, slice_of(text))
    else:
        assert list(indices_of(numbers, slice_of(text))) == expected
