"""Sequences with one file per frame: names, numbers, gaps, and how their frames fit together."""

import csv
import json
import re
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import to_file
from commands import dynmesh_command as run
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from meshes import Mesh
from plain_files import FACE, POINTS, TRIANGLE, XYZ, ply
from sequences import assert_refused, names, sea, sequence_of

import dynmesh
from dynmesh.cli.command import slice_of
from dynmesh.formats.names import FrameNames
from dynmesh.formats.times import indices_of


@pytest.mark.parametrize("suffix", [".ply", ".obj"])
def test_every_way_to_name_the_files(tmp_path: Path, mesh: Mesh, suffix: str) -> None:
    sequence = sequence_of(mesh, 12, np.float64)
    folder = tmp_path / "frames"
    dynmesh.write(tmp_path / f"hashes/f###{suffix}", sequence)
    assert names(tmp_path / "hashes") == [f"f{i:03}{suffix}" for i in range(12)]
    dynmesh.write(tmp_path / f"two/##_##{suffix}", sequence[:1])  # two runs are no number
    assert names(tmp_path / "two") == [f"##_##{suffix}"]
    dynmesh.write(folder / f"f%d{suffix}", sequence)
    assert names(folder) == sorted(f"f{i}{suffix}" for i in range(12))
    for path in (folder / f"f%d{suffix}", folder / f"*{suffix}", folder / f"f[0-9]*{suffix}"):
        np.testing.assert_array_equal(dynmesh.read(path).vertices, sequence.vertices)
    (folder / "notes.txt").touch()
    (folder / f"._f3{suffix}").touch()  # like the hidden files of macOS
    np.testing.assert_array_equal(dynmesh.read(folder).vertices, sequence.vertices)
    one = dynmesh.read(folder / f"f10{suffix}")
    np.testing.assert_array_equal(one.vertices, sequence.vertices[10:11])
    dynmesh.write(folder / f"rest{suffix}", sequence[:1])
    assert_refused(folder, rf"several sequences, as f0\{suffix} and rest\{suffix} differ")


def test_a_folder_is_written_and_read(tmp_path: Path, mesh: Mesh) -> None:
    sequence = sequence_of(mesh)
    folder = tmp_path / "walk"
    dynmesh.write(folder, sequence, format="ply")
    assert names(folder) == ["frame_0000.ply", "frame_0001.ply", "frame_0002.ply"]
    dynmesh.write(folder, sequence_of(mesh, 2))  # the existing files determine the format
    assert names(folder) == ["frame_0000.ply", "frame_0001.ply"]
    assert names(tmp_path) == ["walk"]

    (folder / "scan.ply").touch()
    with pytest.raises(ValueError, match=r"walk: .*scan\.ply,.* frame_%04d"):
        dynmesh.write(folder, sequence)
    (folder / "scan.ply").rename(folder / "scan.obj")
    assert_refused(folder, r"\.ply and \.obj", dynmesh.open)
    assert dynmesh.open(folder, format="ply").n_frames == 2
    (tmp_path / "none").mkdir()
    assert_refused(tmp_path / "none", r"\.ply or \.obj", dynmesh.open)
    assert_refused(tmp_path / "none", r"\.obj", dynmesh.open, format="obj")


def test_a_shorter_sequence_replaces_a_longer_one(tmp_path: Path, mesh: Mesh) -> None:
    path = tmp_path / "f_%03d.ply"
    dynmesh.write(path, replace(sequence_of(mesh, 5), start=997))
    (tmp_path / "f_12.ply").touch()
    (tmp_path / "g_001.ply").touch()
    assert len([*tmp_path.glob("f_*.ply")]) == 6
    assert (tmp_path / "f_1001.ply").exists()
    dynmesh.write(path, sequence_of(mesh, 2))
    assert names(tmp_path) == ["f_000.ply", "f_001.ply", "f_12.ply", "g_001.ply"]
    assert dynmesh.read(path).vertices.shape == (2, 49, 3)


READ: list[tuple[list[str], str, list[float]]] = [
    (["-2", "-1", "0", "1"], "", [-2, -1, 0, 1]),
    ([f"frame-{n}" for n in range(1, 6)], "", [1, 2, 3, 4, 5]),
    (["2024-01-09", "2024-01-10"], "", [9, 10]),
    (["f-08", "f-9"], "", [8, 9]),
    (["f-2", "f-1"], "f%d.obj", [-2, -1]),
    (["f-1", "f-2"], "f-%d.obj", [1, 2]),
    (["130.86", "130.892", "130.93"], "", [130.86, 130.892, 130.93]),
    (["1305.175304", "1305.2", "1305.23"], "*.obj", [1305.175304, 1305.2, 1305.23]),
    (["1700000000.125", "1700000000.25"], "", [1700000000.125, 1700000000.25]),
    (["v2.0010", "v2.0020"], "", [10, 20]),
    (["s.1.8", "s.1.9", "s.1.10"], "", [8, 9, 10]),  # no decimal ends in 0
    (["1.2.9", "1.2.11"], "", [9, 11]),  # nor do three numbers make one
    (["frame-000000.depth", "frame-000001.depth"], "", [0, 1]),
    (["f_0", "f_1.depth", "f_2.depth"], "f_%d.depth.obj", [1, 2]),
    (["s.1.5", "s.1.25"], "s.1.%d.obj", [5, 25]),
    (["f_7"], "f_7.obj", [0]),
    (["f_20250101120000000"], "f_%d.obj", [0]),
    # Several numbers differ, or none, so that frames are counted.
    (["first", "last"], "", [0, 1]),
    (["c1_1", "c1_10", "c2_2"], "", [0, 1, 2]),
    (["m9_s59", "m10_s2", "m10_s10"], "", [0, 1, 2]),
    (["n140_9", "n140_763555584", "n141_8"], "", [0, 1, 2]),
    (["2024-12-31", "2025-01-01"], "", [0, 1]),
    (["2024-05-01_12-30-59_0007", "2024-05-01_12-30-59_0008"], "", [7, 8]),
]  # fmt: skip
"""Names in their order, and the numbers of frames; of some, the pattern that is given."""

REFUSED = [
    (["f2_1", "f2_01", "f2_3"], r"f2_01\.obj and f2_1\.obj have the same number"),
    (["f_0001", "f_0002", "last"], r"several sequences, as f_0001\.obj and last\.obj differ"),
    (["s_1", "s_2", "s_1.depth", "s_2.depth"], r"several sequences, as s_1\.depth\.obj"),
    (["t0.005", "t0.01", "t0.015"], r"t0\.01\.obj and t0\.005\.obj are in one order .* decimals"),
    (["m1_s58", "m1_s59", "m2_s00"], "differ in several numbers.* lost frames cannot be told"),
]


def put(folder: Path, names: Iterable[str]) -> None:
    """Files of which each holds its number in this list."""
    folder.mkdir(exist_ok=True)
    for number, name in enumerate(names):
        (folder / f"{name}.obj").write_text(TRIANGLE.replace("v 0 0", f"v {number} 0"))


@pytest.mark.parametrize("is_glob", [False, True])
@pytest.mark.parametrize(("names", "pattern", "expected"), READ)
def test_frames_are_in_natural_order(
    tmp_path: Path, names: list[str], pattern: str, expected: list[float], is_glob: bool
) -> None:
    put(tmp_path, names)
    path = tmp_path / (pattern or "*.obj" * is_glob)
    with dynmesh.open(path) as reader:
        assert [reader.header.number(frame) for frame in range(reader.n_frames)] == expected
        places = [frame.points[0, 0] for frame in reader]
    assert places == sorted(places)


@pytest.mark.parametrize(("names", "told"), REFUSED)
def test_names_that_cannot_be_compared_are_refused(
    tmp_path: Path, names: list[str], told: str
) -> None:
    put(tmp_path, names)
    for path in (tmp_path, tmp_path / "*.obj"):
        assert_refused(path, told, gaps="lost")


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (["c1_1", "c1_10", "c2_2"], ["frame_0000", "frame_0001", "frame_0002"]),
        (["Scan_08", "Scan_09", "Scan_10"], ["Scan_08", "Scan_09", "Scan_10"]),
    ],
)
def test_files_in_a_folder_keep_names_that_a_pattern_gives(
    tmp_path: Path, given: list[str], expected: list[str]
) -> None:
    put(tmp_path / "in", given)
    for _ in range(2):  # the second time, they are replaced
        dynmesh.write(tmp_path / "out", dynmesh.open(tmp_path / "in"))
        assert names(tmp_path / "out") == [f"{name}.obj" for name in expected]
    with pytest.raises(FileExistsError, match=re.escape(expected[0])):
        dynmesh.write(tmp_path / "out", dynmesh.open(tmp_path / "in"), overwrite=False)


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_any_numbers_are_read_in_their_order(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    """By the pattern that wrote them; in a folder and a glob, they are so or refused."""
    conversion = data.draw(st.sampled_from(["%d", "%04d", "%.2f", "%07.2f"]))
    hundredths = st.integers(-3000, 3000).map(lambda n: n if "d" not in conversion else n * 100)
    drawn = data.draw(st.lists(hundredths, min_size=2, max_size=7, unique=True))
    numbers = [n // 100 if n % 100 == 0 else n / 100 for n in drawn]
    before = data.draw(st.sampled_from(["", "sim_", "sim.", "a b_", "f-", "f", "2_"]))
    if before == "f" and max(numbers) < 0:
        before = "f_"  # after a letter, a hyphen is no sign
    pattern = before + conversion + data.draw(st.sampled_from(["", "_depth", ".depth"])) + ".obj"
    folder = tmp_path_factory.mktemp("some")
    put(folder, [FrameNames(folder, pattern).name(number)[:-4] for number in numbers])
    expected = [(number, drawn.index(round(number * 100))) for number in sorted(numbers)]

    def read(path: Path, gaps: Any) -> Any:
        with dynmesh.open(path, gaps=gaps) as reader:
            found = [(reader.header.number(n), f.points[0, 0]) for n, f in enumerate(reader)]
        return [(number, x) for number, x in found if np.isfinite(x)]

    assert read(folder / pattern, "lost") == expected
    for path in (folder, folder / "*.obj"):
        try:
            found = read(path, "lost")
        except ValueError as error:
            told = str(error)
            assert "d" not in conversion or before == "f"
            if "lost frames cannot be told" in told:
                assert [x for _, x in read(path, "refuse")] == [x for _, x in expected]
        else:
            assert [x for _, x in found] == [x for _, x in expected]
            assert found == expected or "d" not in conversion


@pytest.mark.parametrize(
    ("numbers", "lost"),
    [
        ("0018 0019 0021", "0020"),
        ("8 9 11", "10"),
        ("0 2 4", None),
        ("1000 1033 1067", None),  # milliseconds
        ("0.5 1 2", "1.5"),
        ("1.0 1.034 1.066 1.132 1.166", "1.099"),
        ("-4 -2 2", "0"),
    ],
)
def test_a_gap_is_judged_by_the_usual_distance(
    tmp_path: Path, numbers: str, lost: str | None
) -> None:
    put(tmp_path, [f"f2_{number}" for number in numbers.split()])
    for path in (tmp_path, tmp_path / "f*.obj"):
        if lost:
            told = rf": f2_{lost}\.obj is missing, as its frames are usually .* apart"
            assert_refused(path, told)
        else:
            dynmesh.open(path).close()
        with dynmesh.open(path, gaps="lost") as reader:
            found = [reader.header.number(frame) for frame in range(reader.n_frames)]
        expected = [float(number) for number in [*numbers.split(), *([lost] if lost else [])]]
        assert found == pytest.approx(sorted(expected))
    put(tmp_path, ["f2_90000000"])
    assert_refused(tmp_path, "more than 1000000 frames would be missing", gaps="lost")


@pytest.mark.parametrize(
    ("numbers", "pattern", "expected"),
    [
        ([-2, -1, 0], "f_%03d.ply", ["f_-02", "f_-01", "f_000"]),
        ([0.5, 0.75, 1], "f_%.2f.ply", ["f_0.50", "f_0.75", "f_1.00"]),
        ([100, 102, 104], "f_%d.ply", ["f_100", "f_102", "f_104"]),
        ([0.5, 0.75, 1], "f_%.1f.ply", None),
        ([0.5, 0.75, 1], "f_%d.ply", None),
        ([1, 2, 7], "f_%d.ply", None),
    ],
)
def test_frames_keep_their_numbers_on_the_way_out(
    tmp_path: Path, mesh: Mesh, numbers: list[float], pattern: str, expected: list[str] | None
) -> None:
    """Or are counted from 0, with a remark."""
    times = np.array(numbers, np.float64)
    dynmesh.write(tmp_path / "a.npz", replace(sequence_of(mesh), start=numbers[0], times=times))
    made = to_file.convert(tmp_path / "a.npz", tmp_path / "out" / pattern)
    counted = [FrameNames(tmp_path, pattern).name(n)[:-4] for n in range(3)]
    assert sorted(names(tmp_path / "out")) == sorted(f"{n}.ply" for n in expected or counted)
    assert [("numbered from 0" in remark) for remark in made.remarks] == [True] * (expected is None)


def test_a_failed_write_leaves_nothing(tmp_path: Path, mesh: Mesh) -> None:
    sequence = sequence_of(mesh)
    for path, message in (
        ("a.#.ply", "one file holds one frame"),  # one hash, or two runs of them, are no number
        ("##_##.ply", "one file holds one frame"),
        ("body.ply", r"one file holds one frame, not 3: write body_%04d\.ply"),
        ("shot2.0101.ply", r"write shot2\.%04d\.ply"),
        ("a*.ply", r"a glob can only be read; write to frame_%04d\.ply"),
        ("a%d.npz", r"a%d\.npz: stands for several files, but one \.npz file holds all frames"),
        ("a.####.npz", "stands for several files"),
        ("a?.npy", "stands for several files"),
    ):
        with pytest.raises(ValueError, match=message):
            dynmesh.write(tmp_path / path, sequence)
    with pytest.raises(ValueError, match=r"a%d\.ply: .*faces"):
        dynmesh.write(tmp_path / "a%d.ply", dynmesh.Sequence(sequence.vertices, mesh.faces[:0]))
    (tmp_path / "a").touch()
    with pytest.raises(NotADirectoryError):
        dynmesh.write(tmp_path / "a" / "where" / "f%d.ply", sequence)
    assert names(tmp_path) == ["a"]


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
