"""Requirements for all file formats, including their errors."""

import math
import random
import re
import resource
import tracemalloc
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import to_file
from commands import dynmesh_command, run_here
from conftest import LONGER
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from meshes import sheet
from sequences import assert_named, assert_refused, sea

import dynmesh
from dynmesh import formats
from dynmesh.formats.format import STATED
from dynmesh.polygons import Polygons, split_polygons

KEPT = {name: format.keeps for name, format in formats.FORMATS.items() if format.write}
FORMATS = [*KEPT]
SINGLE_PRECISION = {name for name, keeps in KEPT.items() if "float64" not in keeps}
MASKED = {name for name, keeps in KEPT.items() if "known" in keeps}
TRACED = {name for name, keeps in KEPT.items() if "provenance" in keeps}
NUMBERED = {name for name in FORMATS if "gaps" in formats.FORMATS[name].takes}
TIMED = {"npz", "hdf5", "usd", "alembic"}


def place(folder: Path, format: str, name: str = "body") -> Path:
    """Returns a path for a sequence of this format."""
    suffix = formats.FORMATS[format].suffixes[0]
    return folder / (f"{name}_%04d{suffix}" if format in NUMBERED else f"{name}{suffix}")


def quads(n: int) -> Polygons:
    """A grid of n by n vertices, its first square cut in two."""
    v = np.arange(n * n).reshape(n, n)
    squares = np.stack([v[:-1, :-1], v[1:, :-1], v[1:, 1:], v[:-1, 1:]], axis=-1).reshape(-1, 4)
    a, b, c, d = squares[0]
    corners = np.concatenate([[a, b, c, a, c, d], squares[1:].ravel()]).astype(np.int32)
    sizes = np.concatenate([[3, 3], np.full(len(squares) - 1, 4)]).astype(np.int32)
    return Polygons(sizes, corners)


def _partial() -> dynmesh.Sequence:
    polygons = quads(12)
    about: Any = {"fps": 24.0, "up_axis": "y", "name": "/world/body", "metres_per_unit": 0.01}
    faces, _ = split_polygons(polygons)
    whole = sea(7, 12, share=0.5, whole=[0], faces=faces, polygons=polygons, **about)
    known = np.array(whole.known)
    known[5] = False
    return replace(whole, known=known, vertices=np.where(known[..., None], whole.vertices, np.nan))


PARTIAL = _partial()
KNOWN: Any = PARTIAL.known
"""Moving quads with missing vertices, which are NaN, and a frame without any other."""


@pytest.fixture(params=FORMATS)
def format(request: pytest.FixtureRequest) -> str:
    """Each format that can be written."""
    return str(request.param)


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


@settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
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
    for name, value in vars(as_kept(sequence, format)).items():
        if name == "fps" and value is not None:
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
    "times", [[1.0, 2, 3, 7, 8, 9, 10], [-4.5, -3.5, 1001, 1002, 1003.25, 1004, 1005]]
)
@pytest.mark.parametrize("format", sorted(TIMED))
def test_times_of_frames_survive_completion(
    tmp_path: Path, format: str, times: list[float]
) -> None:
    source, target = place(tmp_path, format), place(tmp_path, format, "completed")
    dynmesh.write(source, replace(PARTIAL, start=times[0], times=np.array(times)))
    to_file.complete(source, target)
    for path in (source, target):
        again = dynmesh.read(path)
        np.testing.assert_allclose(np.array(again.times), times, rtol=1e-9)
        assert (again.start, again.fps) == (np.array(again.times)[0], 24)


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


def result_of(path: Path) -> dynmesh.Sequence | str:
    """Reads a sequence in little memory; returns it, or else why it is refused."""
    tracemalloc.start()
    try:
        sequence = dynmesh.read(path)
        assert sequence.faces.max(initial=0) < sequence.vertices.shape[1]
        return sequence
    except (ValueError, OSError) as error:
        assert_named(error, path)
        return str(error)
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < 32 << 20


def differences(found: dynmesh.Sequence, whole: dynmesh.Sequence) -> float:
    """The number of entries in which two sequences differ; infinity if their kinds do."""
    count: float = 0
    for values in zip(vars(found).values(), vars(whole).values(), strict=True):
        one, other = map(np.asarray, values)
        if (one.shape, one.dtype) != (other.shape, other.dtype):
            return np.inf
        count += np.count_nonzero((one != other) & ((one == one) | (other == other)))
    return count


# A checksum notices every change. Without one, another number is as good as the right one. In other
# formats, a changed word may also be one that readers ignore.
MOST_CHANGED = {"npz": 0, "npy": 1, "ply": 1}


# Without Alembic, whose library ends the process for some damaged files.
@pytest.mark.parametrize("format", [*sorted({*FORMATS} - {"alembic"}), "usda"])
def test_a_changed_byte_is_noticed_or_changes_one_number(tmp_path: Path, format: str) -> None:
    path = tmp_path / "body.usda" if format == "usda" else place(tmp_path, format)
    mesh, known = sheet(4), np.random.default_rng(0).random((4, 16)) < 0.7
    vertices = (mesh.vertices + np.arange(4)[:, None, None] / 3).astype(np.float32)
    generation = np.where(known, 0, 1).astype(np.int32)
    traces: Any = {"known": known, "generation": generation, "age": generation}
    kept = traces if format in {*TRACED, "usda"} else {}
    dynmesh.write(path, dynmesh.Sequence(vertices, mesh.faces, fps=25.0, **kept))
    generator, whole = random.Random(format), dynmesh.read(path)
    for file in sorted(file for file in tmp_path.rglob("*") if file.is_file()):
        content = file.read_bytes()
        places = range(len(content))
        drawn = places if LONGER > 1 else generator.sample(places, 20)
        for changed in {0, *drawn, len(content) - 1}:
            damaged = bytearray(content)
            damaged[changed] ^= generator.choice((1 << generator.randrange(8), 0xFF))
            file.write_bytes(damaged)
            found = result_of(path)
            most = MOST_CHANGED.get(format, np.inf)
            assert isinstance(found, str) or differences(found, whole) <= most, (file, changed)
        file.write_bytes(content)


RARELY_DRAWN: dict[str, tuple[str, str, Callable[[bytes], bytes]]] = {
    "a huge header": ("npy", ".faces", lambda c: c.replace(b"Y\x01\x00", b"Y\x02\x00", 1)),
    "a header that ends in its middle": ("npy", "", lambda c: c.replace(b"}", b" ", 1)),
    "members that begin before the archive": (
        "npz", "", lambda c: c[:-4] + bytes([c[-4] + 1]) + c[-3:]
    ),
}  # fmt: skip


@pytest.mark.parametrize("damage", RARELY_DRAWN)
def test_damage_that_is_rarely_drawn(tmp_path: Path, damage: str) -> None:
    format, part, change = RARELY_DRAWN[damage]
    path = place(tmp_path, format)
    dynmesh.write(path, PARTIAL)
    damaged = path.with_name(f"{path.stem}{part}{path.suffix}")
    damaged.write_bytes(change(damaged.read_bytes()))
    assert str(result_of(path)).startswith(f"{damaged}: ")


def claiming_npz(path: Path, name: str) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        for array, shape, kind in (("vertices", (2, 9, 3), "<f4"), ("faces", (8, 3), "<i4")):
            claimed = (2**31, *shape[1:]) if array == name else shape
            header = {"descr": kind, "fortran_order": False, "shape": claimed}
            with archive.open(f"{array}.npy", "w") as member:
                np.lib.format.write_array_header_1_0(member, header)
                member.write(bytes(4 * math.prod(shape)))


def claiming_hdf5(path: Path, name: str) -> None:
    with pytest.importorskip("h5py").File(path, "w") as file:
        for array, shape, kind in (("vertices", (2, 3, 3), "f4"), ("faces", (1, 3), "i4")):
            claimed = (2, 2**31 - 1, 3)[-len(shape) :] if array == name else shape
            file.create_dataset(array, claimed, kind, chunks=True)


@pytest.mark.parametrize("name", ["vertices", "faces"])
@pytest.mark.parametrize("claim", [claiming_npz, claiming_hdf5])
def test_an_array_that_claims_billions_is_named(tmp_path: Path, claim: Any, name: str) -> None:
    path = place(tmp_path, claim.__name__.partition("_")[2])
    claim(path, name)
    assert re.search(rf"{path.name}: {name}: .* bytes", str(result_of(path)))


SPOILT: dict[str, Callable[[bytes], bytes]] = {
    "truncated": lambda content: content[: len(content) * 3 // 5],
    "shortened": lambda content: content[:-9],
    "emptied": lambda _: b"",
    "mislabelled": lambda _: b"%PDF-1.4 this is a letter, not a mesh\n" * 50,
    "zeros": lambda _: bytes(5000),
}


@pytest.mark.parametrize("how", SPOILT)
def test_damaged_files_are_refused_in_one_line(
    tmp_path: Path,
    format: str,
    how: str,
    capfd: pytest.CaptureFixture[str],
) -> None:
    source = place(tmp_path, format)
    dynmesh.write(source, PARTIAL)
    file = source.with_name(source.name % 2) if "%" in source.name else source
    file.write_bytes(SPOILT[how](file.read_bytes()))
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    result = dynmesh_command("complete", source, tmp_path / "out.npz", code=1)
    error = result.stderr
    assert result.stdout == ""
    assert capfd.readouterr() == ("", "")  # of the libraries
    assert len(error.strip().splitlines()) == 1, error
    assert error.startswith("dynmesh: ")
    assert file.name in error or source.name in error, error
    assert before == {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}


@pytest.mark.parametrize("format", [*FORMATS, "usda"])
def test_a_full_disk_leaves_nothing_half_done(
    tmp_path: Path,
    format: str,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    several = format in NUMBERED
    shape = (3 if several else 40, 2000 if format == "usda" else 10_000, 3)
    vertices = np.random.default_rng(0).normal(size=shape)
    source = tmp_path / "in.npz"
    target = tmp_path / "out.usda" if format == "usda" else place(tmp_path, format, "out")
    sequence = dynmesh.Sequence(vertices.astype(np.float32), np.array([[0, 1, 2]]))
    dynmesh.write(source, sequence)
    monkeypatch.chdir(tmp_path)
    # Text is made of binary data, which must be complete.
    largest = 1_100_000 if format == "usda" else 100_000 if several else 2_500_000
    # Beyond the limit, writing fails as on a full disk.
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (largest, hard))
    try:
        result = run_here("convert", source, target)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert (result.returncode, result.stdout) == (1, "")
    assert capfd.readouterr() == ("", "")  # of the libraries
    assert len(result.stderr.strip().splitlines()) == 1, result.stderr
    assert "out" in result.stderr
    assert "File too large" in result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["in.npz"]


def own_memory() -> int:
    """The resident memory in kB, without mapped files, which the system can reclaim."""
    status = Path("/proc/self/status").read_text()
    return int(status.partition("RssAnon:")[2].split()[0])


@pytest.mark.parametrize("format", sorted({*FORMATS} - NUMBERED))
def test_memory_does_not_grow_with_the_frames(tmp_path: Path, format: str) -> None:
    path = place(tmp_path, format)
    points = np.random.default_rng(0).random((100_000, 3)).astype(np.float32)
    known = np.ones(len(points), bool) if format in MASKED else None
    n_frames, faces, used = 30, np.array([[0, 1, 2]]), []
    header = dynmesh.Header(faces, n_frames, len(points), points.dtype, has_known=format in MASKED)

    def frames() -> Iterator[dynmesh.Frame]:
        for _ in range(n_frames):
            points[0] += 1  # equal frames would be stored only once
            yield dynmesh.Frame(points, known)
            used.append(own_memory())

    dynmesh.write(path, dynmesh.ComputedFrames(header, frames))
    assert path.stat().st_size > n_frames * points.nbytes
    assert max(used) - used[0] < 20_000
    with dynmesh.open(path) as reader:
        used = [own_memory() for _ in reader]
    assert max(used) - used[0] < 10_000


@pytest.mark.parametrize("format", ["npz", "hdf5", "alembic"])
def test_the_suffix_can_be_overridden(tmp_path: Path, format: str) -> None:
    """The other formats have several files, or libraries that insist on the suffix."""
    path = tmp_path / "scan.dat"
    dynmesh.write(path, PARTIAL, format=format)
    np.testing.assert_array_equal(dynmesh.read(path, format=format).vertices, PARTIAL.vertices)
    with pytest.raises(ValueError, match=r"'\.dat'.* \.npz"):
        dynmesh.read(path)


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
