"""Sequences in HDF5, in arrays of numpy's own formats, and in point caches with meshes beside."""

import struct
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import Array, sheet
from sequences import GOOD, NO_SEQUENCE, assert_refused, assert_same

import dynmesh
from dynmesh.formats.rows import Rows

h5py = pytest.importorskip("h5py", reason="h5py is not installed")

N, K = 6, 49


def sequence() -> dynmesh.Sequence:
    """A sheet with missing vertices, provenance and all optional attributes."""
    rng = np.random.default_rng(3)
    mesh = sheet(7)
    known = rng.random((N, K)) < 0.5
    vertices = (mesh.vertices + rng.normal(size=(N, 1, 3))).astype(np.float32)
    vertices[~known] = np.nan
    return dynmesh.Sequence(
        vertices,
        mesh.faces,
        known,
        fps=30000 / 1001,
        name="/welt/Körper",
        generation=rng.integers(-1, 9, (N, K)).astype(np.int32),
        age=rng.integers(0, 2**31 - 1, (N, K)).astype(np.int32),
    )


def store(path: Path, arrays: dict[str, Any], **layout: Any) -> Path:
    """Writes arrays as other programs do; the layout is that of the positions in HDF5."""
    if path.suffix == ".npz":
        (np.savez_compressed if layout else np.savez)(path, **arrays)
    elif path.suffix == ".npy":
        for name, array in arrays.items():
            np.save(path if name == "vertices" else path.with_suffix(f".{name}.npy"), array)
    else:
        with h5py.File(path, "w", libver="latest") as file:
            for name, array in arrays.items():
                file.create_dataset(name, data=array, **(layout if name == "vertices" else {}))
    return path


def test_others_read_what_is_written(tmp_path: Path) -> None:
    before = sequence()
    dynmesh.write(tmp_path / "a.hdf5", before)
    with h5py.File(tmp_path / "a.hdf5") as plain:
        np.testing.assert_array_equal(plain["vertices"][:], before.vertices)
        assert plain["known"].dtype == np.bool_
        assert plain["fps"][()] == before.fps
        assert plain["name"].asstr()[()] == "/welt/Körper"
    path = tmp_path / "a.pc2"
    before = cached(fps=24.0)
    dynmesh.write(path, before)
    data = path.read_bytes()
    assert data[:32] == struct.pack("<12siiffi", b"POINTCACHE2\0", 1, K, 0.0, 1.0, 10)
    assert data[32:] == before.vertices.astype("<f4").tobytes()
    with dynmesh.open(path) as reader:
        assert reader.files == [path, tmp_path / "a.obj"]
        assert next(iter(reader)).points.dtype.isnative


@pytest.mark.parametrize("suffix", ["npz", "h5"])
def test_faces_with_four_columns_are_quads(suffix: str, tmp_path: Path) -> None:
    quads = np.array([[0, 1, 8, 7], [1, 2, 9, 8]])
    expected = dynmesh.Sequence(sheet(7).vertices[None], quads)
    arrays = {"vertices": expected.vertices, "faces": quads}
    given, again = tmp_path / f"given.{suffix}", tmp_path / f"again.{suffix}"
    dynmesh.write(again, dynmesh.read(store(given, arrays)))
    for path in (given, again):
        assert_same(dynmesh.read(path), expected)
    store(given, arrays | {"polygon_sizes": np.array([4]), "polygon_corners": quads[0]})
    assert_refused(given, r"faces: .*\(m, 3\)")  # which of them is meant?


def test_npy_keeps_the_arrays(tmp_path: Path) -> None:
    path = tmp_path / "a.b.npy"
    before = sequence()
    dynmesh.write(path, before)
    np.testing.assert_array_equal(np.load(path), before.vertices)
    names = ["a.b.npy", *(f"a.b.{name}.npy" for name in ("age", "faces", "generation", "known"))]
    assert {p.name for p in tmp_path.iterdir()} == {*names}
    with dynmesh.open(path) as reader:
        assert {*reader.files} == {*tmp_path.iterdir()}
    (tmp_path / "a.b.age.npy").unlink()
    assert_refused(path, "generation, age: ")
    after = dynmesh.Sequence(np.zeros((N, K, 3), np.float32), before.faces)
    dynmesh.write(path, after)  # beside which no mask of the older one is left
    assert_same(after, dynmesh.read(path))
    assert {p.name for p in tmp_path.iterdir()} == {"a.b.faces.npy", "a.b.npy"}


LAYOUTS: dict[str, tuple[str, Any, dict[str, Any]]] = {
    "npz": ("npz", ">f4", {}),
    "npy": ("npy", ">f4", {}),
    "double npy": ("npy", ">f8", {}),
    "big endian": ("h5", ">f4", {}),
    "one chunk": ("h5", "f4", {"chunks": (N, K, 3), "compression": "gzip"}),
    "odd chunks": ("h5", "f4", {"chunks": (4, 10, 2), "compression": "lzf"}),
    "checked": ("h5", "f4", {"chunks": (1, K, 3), "fletcher32": True}),
}
"""Ways in which other programs write the same positions: suffix, dtype, and options of HDF5."""


@pytest.mark.parametrize("layout", LAYOUTS)
def test_arrays_of_others_are_read(tmp_path: Path, layout: str) -> None:
    suffix, dtype, options = LAYOUTS[layout]
    before = sequence()
    arrays: dict[str, Any] = {
        "vertices": np.asfortranarray(before.vertices.astype(dtype)),
        "faces": before.faces.astype(">u2"),
        "known": np.asfortranarray(before.known),
    }
    path, about = tmp_path / f"a.{suffix}", {"fps": np.array([25], np.float32), "name": "Körper"}
    if suffix == "npz":
        arrays |= about | {"more": np.array("ignored")}
    store(path, arrays, **options)
    if suffix == "h5":
        with h5py.File(path, "r+") as file:
            file.attrs.update(about | {"up_axis": np.bytes_("y")})
            file.create_group("camera")["vertices"] = 1
    with dynmesh.open(path) as reader:
        described = (reader.fps, reader.header.name)
        assert described == ((None, None) if suffix == "npy" else (25, "Körper"))
        assert reader.header.up_axis == ("y" if suffix == "h5" else None)
        assert reader.dtype == np.dtype(dtype).newbyteorder("=")
        first, second = reader.frames(1), reader.frames(0, None, 2)
        next(second)
        for number in range(1, N):
            frame = next(first)
            assert frame.points.dtype == reader.dtype
            np.testing.assert_array_equal(frame.points, before.vertices[number])
            np.testing.assert_array_equal(frame.known, before.known[number])  # type: ignore[index]
        np.testing.assert_array_equal(next(second).points, before.vertices[2])


@pytest.mark.parametrize(
    ("suffix", "arrays", "message"),
    [
        *((suffix, *case) for case in NO_SEQUENCE for suffix in (".npz", ".h5")),
        (".npz", GOOD | {"vertices": np.array([None, "x"], object)}, "holds Python objects"),
        (".h5", GOOD | {"vertices": np.float32(1)}, r"must have shape \(n, k, 3\), not \(\)"),
        (".h5", GOOD | {"vertices": "two"}, "must be float32 or float64, not object"),
        (".h5", GOOD | {"times": "one, two"}, "times: must be numbers, not <U"),
    ],
)
def test_files_without_a_sequence_are_refused(
    tmp_path: Path, suffix: str, arrays: dict[str, Any], message: str
) -> None:
    assert_refused(store(tmp_path / f"a{suffix}", arrays), message)


def test_unreadable_frames_of_an_hdf5_file_are_reported_quietly_in_any_thread(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    vertices = np.arange(24, dtype=np.float32).reshape(2, 4, 3)
    path = store(
        tmp_path / "a.h5", GOOD | {"vertices": vertices}, chunks=(1, 4, 3), fletcher32=True
    )
    data = path.read_bytes()
    place = data.index(vertices[1].tobytes())
    path.write_bytes(data[:place] + b"\xff" + data[place + 1 :])
    assert_refused(path)
    with dynmesh.open(path) as reader:
        np.testing.assert_array_equal(next(iter(reader)).points, vertices[0])
    path.write_bytes(data[:1000])
    with ThreadPoolExecutor(1) as thread, pytest.raises(ValueError, match=r"a\.h5: "):
        thread.submit(dynmesh.read, path).result()
    assert capfd.readouterr() == ("", "")


def test_an_hdf5_file_that_is_being_written_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    dynmesh.write(path, sequence())
    script = "import h5py, sys; file = h5py.File(sys.argv[1], 'r+'); print(flush=True); input()"
    with subprocess.Popen(
        [sys.executable, "-c", script, path], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as capture:
        assert capture.stdout is not None
        capture.stdout.readline()
        with pytest.raises(OSError, match=r"a\.h5: "):
            dynmesh.open(path)
        capture.communicate(b"\n")
    assert dynmesh.read(path).vertices.shape == (N, K, 3)


def test_hdf5_data_in_other_files_are_refused(tmp_path: Path) -> None:
    dynmesh.write(tmp_path / "other.h5", sequence())
    sequence().vertices.tofile(tmp_path / "raw.bin")
    shape = (N, K, 3)
    layout = h5py.VirtualLayout(shape, "f4")
    layout[:] = h5py.VirtualSource("other.h5", "vertices", shape)
    linked = h5py.ExternalLink("other.h5", "/vertices")
    raw = [(str(tmp_path / "raw.bin"), 0, h5py.h5f.UNLIMITED)]

    def linked_twice(file: Any) -> None:
        file["group"] = h5py.ExternalLink("other.h5", "/")
        file["vertices"] = h5py.SoftLink("/group/vertices")

    for refer in (
        lambda file: file.update({"vertices": linked}),
        linked_twice,
        lambda file: file.create_virtual_dataset("vertices", layout),
        lambda file: file.create_dataset("vertices", shape, "f4", external=raw),
    ):
        with h5py.File(tmp_path / "a.h5", "w") as file:
            file["faces"] = sheet(7).faces
            file["unused"] = linked
            refer(file)
        assert_refused(tmp_path / "a.h5", "vertices: ")


def cached(n: int = 10, **more: Any) -> dynmesh.Sequence:
    mesh = sheet(7)
    vertices = mesh.vertices + np.random.default_rng(0).normal(size=(n, 1, 3))
    return dynmesh.Sequence(vertices.astype(np.float32), mesh.faces, **more)


def pc2(frames: Array, version: int = 1, n: int | None = None, k: int | None = None) -> bytes:
    n, k = len(frames) if n is None else n, frames.shape[1] if k is None else k
    header = struct.pack("<12siiffi", b"POINTCACHE2\0", version, k, 7.0, 0.5, n)
    return header + frames.astype("<f4").tobytes()


def test_an_existing_mesh_with_the_same_faces_is_kept(tmp_path: Path) -> None:
    path, mesh = tmp_path / "a.pc2", tmp_path / "a.obj"
    dynmesh.write(path, cached())
    text = mesh.read_text().replace("f ", "vt 0.5 0.5\nf ", 1)
    mesh.write_text(text)
    (remark,) = dynmesh.write(path, cached(3, up_axis="z")).remarks
    assert remark == "not written, as a.obj is kept as it is: up axis"
    assert mesh.read_text() == text

    other = dynmesh.Sequence(cached().vertices, sheet(7).faces[::-1])
    dynmesh.write(path, other)
    np.testing.assert_array_equal(dynmesh.read(path).faces, other.faces)
    assert sorted(tmp_path.iterdir()) == [mesh, path]
    for axis in ("z", "y"):
        dynmesh.write(tmp_path / "b.pc2", replace(other, up_axis=axis))
        assert dynmesh.read(tmp_path / "b.pc2").up_axis == axis


FRAMES = np.arange(10 * K * 3, dtype=np.float32).reshape(10, K, 3)


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (pc2(FRAMES, version=2), "version 2"),
        (pc2(FRAMES) + b"\0", "5912 bytes, but .* 5913"),
        (pc2(FRAMES, n=-1), r"\(-1, 49, 3\)"),
        (pc2(FRAMES, n=2**31 - 1, k=2**31 - 1), "55340232\\d+ bytes"),
    ],
)
def test_damaged_caches_are_refused(tmp_path: Path, data: bytes, told: str) -> None:
    path = tmp_path / "a.pc2"
    path.write_bytes(data)
    assert_refused(path, told, faces=np.array([[0, 1, 2]]))


@pytest.mark.parametrize("suffix", [".npz", ".npy"])
@pytest.mark.parametrize("by_columns", [False, True])
def test_frames_are_the_same_in_any_order_and_an_array_by_columns_is_read_once(
    tmp_path: Path, suffix: str, by_columns: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    n, made = 60, cached(60).vertices
    vertices = np.asfortranarray(made) if by_columns else made
    arrays = {"vertices": vertices, "faces": np.array([[0, 1, 2]])}
    path = store(tmp_path / f"a{suffix}", arrays, compression="any")
    read, whole = list[int](), Rows.whole

    def counted(rows: Rows) -> Any:
        read.append(rows.shape[0])
        return whole(rows)

    monkeypatch.setattr(Rows, "whole", counted)
    with dynmesh.open(path) as frames:
        others = frames.frames()
        for at in np.random.default_rng(0).permutation(n).tolist():
            np.testing.assert_array_equal(frames[at].points, made[at])
            assert next(others).points.shape == (K, 3)
    assert read.count(n) == by_columns
