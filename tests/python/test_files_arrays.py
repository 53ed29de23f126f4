"""Sequences in HDF5 files and in arrays of numpy's own formats."""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import Array, sheet
from sequences import GOOD, HISTORY, NO_SEQUENCE, assert_same

import dynmesh
from dynmesh import files
from dynmesh.polygons import Polygons, triangulate

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


def test_others_read_what_is_written_to_hdf5(tmp_path: Path) -> None:
    before = sequence()
    dynmesh.write(tmp_path / "a.hdf5", before)
    with h5py.File(tmp_path / "a.hdf5") as plain:
        np.testing.assert_array_equal(plain["vertices"][:], before.vertices)
        assert plain["known"].dtype == np.bool_
        assert plain["fps"][()] == before.fps
        assert plain["name"].asstr()[()] == "/welt/Körper"
    assert dynmesh.read(tmp_path / "a.hdf5").name == before.name


@pytest.mark.parametrize("suffix", ["npz", "h5"])
def test_faces_with_four_columns_are_quads(suffix: str, tmp_path: Path) -> None:
    quads = np.array([[0, 1, 8, 7], [1, 2, 9, 8]])
    expected = dynmesh.Sequence(sheet(7).vertices[None], quads)
    arrays = {"vertices": expected.vertices, "faces": quads}

    def save(path: Path, arrays: dict[str, Any]) -> None:
        if suffix == "npz":
            np.savez(path, **arrays)
            return
        with h5py.File(path, "w") as file:
            file.update(arrays)

    given, again = tmp_path / f"given.{suffix}", tmp_path / f"again.{suffix}"
    save(given, arrays)
    assert_same(dynmesh.read(given), expected)
    dynmesh.write(again, dynmesh.read(given))
    assert_same(dynmesh.read(again), expected)
    save(given, arrays | {"polygon_sizes": np.array([4]), "polygon_corners": quads[0]})
    with pytest.raises(ValueError, match=rf"given\.{suffix}: faces: must have shape \(m, 3\)"):
        dynmesh.read(given)  # which of them is meant?


def test_npy_keeps_the_arrays(tmp_path: Path) -> None:
    path = tmp_path / "a.b.npy"
    before = sequence()
    dynmesh.write(path, before)
    np.testing.assert_array_equal(np.load(path), before.vertices)
    names = ["age", "faces", "generation", "known"]
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(
        ["a.b.npy", *(f"a.b.{name}.npy" for name in names)]
    )
    with dynmesh.open(path) as reader:
        assert sorted(reader.files) == sorted(tmp_path.iterdir())
    assert sorted(files.target_of(path).existing()) == sorted(tmp_path.iterdir())

    (tmp_path / "a.b.age.npy").unlink()
    with pytest.raises(ValueError, match="generation, age: must be given both or neither"):
        dynmesh.read(path)


def test_no_mask_of_an_older_sequence_is_left_beside_a_new_one(tmp_path: Path) -> None:
    path = tmp_path / "a.npy"
    dynmesh.write(path, sequence())
    after = dynmesh.Sequence(np.zeros((N, K, 3), np.float32), sheet(7).faces)
    dynmesh.write(path, after)
    again = dynmesh.read(path)
    assert_same(after, again, *HISTORY)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.faces.npy", "a.npy"]


def layouts(vertices: Array) -> dict[str, dict[str, Any]]:
    """Ways in which other programs write the same positions to HDF5 files."""
    return {
        "contiguous": {"data": vertices},
        "big_endian": {"data": vertices.astype(">f4")},
        "double": {"data": vertices.astype("f8")},
        "one_chunk": {"data": vertices, "chunks": vertices.shape, "compression": "gzip"},
        "odd_chunks": {"data": vertices, "chunks": (4, 10, 2), "compression": "lzf"},
        "growing": {"data": vertices, "maxshape": (None, None, 3), "shuffle": True},
        "checked": {"data": vertices, "chunks": (1, *vertices.shape[1:]), "fletcher32": True},
    }


@pytest.mark.parametrize("layout", layouts(np.zeros((1, 1, 3))))
def test_hdf5_of_others_is_read(tmp_path: Path, layout: str) -> None:
    before = sequence()
    options = layouts(before.vertices)[layout]
    with h5py.File(tmp_path / "a.h5", "w", libver="latest") as file:
        file.create_dataset("vertices", **options)
        file["faces"] = before.faces.astype(">u2")
        file.create_dataset("known", data=before.known, chunks=(3, 7), compression="gzip")
        file.attrs["fps"] = np.float32(25)
        file.attrs["up_axis"] = np.bytes_("y")
        file.attrs["name"] = "Körper"
        file.create_group("camera")["vertices"] = 1
    with dynmesh.open(tmp_path / "a.h5") as reader:
        assert (reader.fps, reader.header.up_axis, reader.header.name) == (25, "y", "Körper")
        first, second = reader.frames(1), reader.frames(0, None, 2)
        next(second)
        for number in range(1, N):
            frame = next(first)
            assert frame.points.dtype == reader.dtype
            assert reader.dtype == (np.float64 if layout == "double" else np.float32)
            np.testing.assert_array_equal(frame.points, before.vertices[number])
            np.testing.assert_array_equal(frame.known, before.known[number])  # type: ignore[index]
        np.testing.assert_array_equal(next(second).points, before.vertices[2])


def test_npy_of_others_is_read(tmp_path: Path) -> None:
    before = sequence()
    path = tmp_path / "a.npy"
    np.save(path, np.asfortranarray(before.vertices.astype(">f4")))
    np.save(tmp_path / "a.known.npy", np.asfortranarray(before.known))
    again = dynmesh.read(path, faces=before.faces)
    assert_same(before, again, "known")
    np.save(path, before.vertices.astype(">f8"))
    again = dynmesh.read(path, faces=before.faces.astype(np.uint16))
    assert again.vertices.dtype == np.float64
    np.testing.assert_array_equal(again.vertices, before.vertices)


def test_npz_of_others_is_read(tmp_path: Path) -> None:
    before = sequence()
    assert before.known is not None
    np.savez_compressed(
        tmp_path / "a.npz", vertices=before.vertices, faces=before.faces, known=before.known
    )
    np.savez(
        tmp_path / "b.npz",
        vertices=np.asfortranarray(before.vertices.astype(">f4")),
        faces=before.faces.astype(np.uint16),
        known=np.asfortranarray(before.known),
        fps=np.array([25]),
        more="ignored",
    )
    for name in ("a.npz", "b.npz"):
        again = dynmesh.read(tmp_path / name)
        np.testing.assert_array_equal(again.vertices, before.vertices)
        np.testing.assert_array_equal(again.known, before.known)
        assert again.vertices.dtype == np.float32


def test_npy_takes_its_faces_from_elsewhere(tmp_path: Path) -> None:
    path = tmp_path / "a.npy"
    vertices = np.zeros((N, 4, 3), np.float32)
    np.save(path, vertices)
    with pytest.raises(ValueError, match=r"no a\.faces\.npy beside it"):
        dynmesh.open(path)

    square = Polygons(np.array([4]), np.array([0, 1, 2, 3]))
    mesh = dynmesh.Sequence(vertices[:1], triangulate(square), polygons=square)
    dynmesh.write(tmp_path / "mesh.npz", mesh)
    again = dynmesh.read(path, faces=tmp_path / "mesh.npz")
    np.testing.assert_array_equal(again.faces, mesh.faces)
    assert again.polygons is not None

    dynmesh.write(tmp_path / "other.npz", sequence())
    with pytest.raises(ValueError, match="has 4 vertices, but the mesh with its faces has 49"):
        dynmesh.open(path, faces=tmp_path / "other.npz")
    with pytest.raises(ValueError, match="faces: face 1 refers to vertex 4"):
        dynmesh.open(path, faces=np.array([[0, 1, 2, 4]]))
    np.save(tmp_path / "a.faces.npy", np.zeros((2, 3)))
    with pytest.raises(ValueError, match=r"a\.faces\.npy: faces: must be integers, not float64"):
        dynmesh.open(path)


def store(path: Path, arrays: dict[str, Any]) -> None:
    if path.suffix == ".npz":
        np.savez(path, **arrays)
        return
    with h5py.File(path, "w") as file:
        for name, array in arrays.items():
            file[name] = array


def in_a_file_of_its_own(path: Path, flags: Array) -> dynmesh.Sequence:
    np.save(path / "mask.npy", flags)
    dynmesh.write(path / "a.npz", dynmesh.Sequence(GOOD["vertices"], GOOD["faces"], start=1001))
    return dynmesh.read(path / "a.npz", known=path / "mask.npy")


def beside_the_positions(path: Path, flags: Array) -> dynmesh.Sequence:
    for name, array in {"a": GOOD["vertices"], "a.faces": GOOD["faces"], "a.known": flags}.items():
        np.save(path / f"{name}.npy", array)
    return dynmesh.read(path / "a.npy")


def stored_as(suffix: str) -> Any:
    def read(path: Path, flags: Array) -> dynmesh.Sequence:
        store(path / f"a{suffix}", GOOD | {"known": flags, "start": 1001})
        return dynmesh.read(path / f"a{suffix}")

    return read


@pytest.mark.parametrize("kind", ["u1", "i8", ">u4"])
@pytest.mark.parametrize(
    ("read", "place"),
    [
        (in_memory, "a.npz: frame 1002: known: must be 0 or 1, but vertex 3 has 7"),
        (in_a_file_of_its_own, "mask.npy: frame 1002: known: must be 0 or 1, but vertex 3 has 7"),
        (beside_the_positions, "a.npy: frame 1: known: must be 0 or 1, but vertex 3 has 7"),
        (stored_as(".npz"), "a.npz: frame 1002: known: must be 0 or 1, but vertex 3 has 7"),
        (stored_as(".h5"), "a.h5: frame 1002: known: must be 0 or 1, but vertex 3 has 7"),
    ],
)
def test_masks_of_integers_are_read(tmp_path: Path, read: Any, place: str, kind: str) -> None:
    flags = np.array([[1, 1, 1, 1], [0, 1, 0, 1]], kind)
    known = read(tmp_path, flags).known
    assert known.dtype == np.bool_
    np.testing.assert_array_equal(known, flags == 1)
    flags[1, 3] = 7
    with pytest.raises(ValueError, match=place):
        read(tmp_path, flags)


@pytest.mark.parametrize(
    ("suffix", "arrays", "message"),
    [
        *((suffix, *case) for case in NO_SEQUENCE for suffix in (".npz", ".h5")),
        (".npz", GOOD | {"vertices": np.array([None, "x"], object)}, "holds Python objects"),
        (".h5", {}, "has no array 'vertices'.*this file holds none"),
        (".h5", GOOD | {"vertices": np.float32(1)}, r"must have shape \(n, k, 3\), not \(\)"),
        (".h5", GOOD | {"vertices": h5py.Empty("f4")}, r"must have shape \(n, k, 3\), not \(\)"),
        (".h5", GOOD | {"vertices": "two"}, "must be float32 or float64, not object"),
        (".h5", GOOD | {"faces": "0 1 2"}, "faces: must be integers"),
        (".h5", GOOD | {"fps": "25"}, "fps: must be one number"),
        (".h5", GOOD | {"times": "one, two"}, "times: must be numbers, not <U"),
    ],
)
def test_files_without_a_sequence_are_refused(
    tmp_path: Path, suffix: str, arrays: dict[str, Any], message: str
) -> None:
    path = tmp_path / f"a{suffix}"
    store(path, arrays)
    with pytest.raises(ValueError, match=message) as caught:
        dynmesh.read(path)
    assert str(caught.value).startswith(f"{path}: ")


def test_damaged_hdf5_is_refused_quietly_in_any_thread(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.h5"
    dynmesh.write(path, sequence())
    path.write_bytes(path.read_bytes()[:1000])
    with ThreadPoolExecutor(1) as thread, pytest.raises(ValueError, match="cannot be read as HDF5"):
        thread.submit(dynmesh.read, path).result()
    assert capfd.readouterr() == ("", "")


def test_unreadable_frames_of_an_hdf5_file_are_reported(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        vertices = np.arange(24, dtype=np.float32).reshape(2, 4, 3)
        file.create_dataset("vertices", data=vertices, chunks=(1, 4, 3), fletcher32=True)
        file["faces"] = GOOD["faces"]
    data = path.read_bytes()
    place = data.index(vertices[1].tobytes())
    path.write_bytes(data[:place] + b"\xff" + data[place + 1 :])
    with dynmesh.open(path) as reader:
        frames = iter(reader)
        np.testing.assert_array_equal(next(frames).points, vertices[0])
        with pytest.raises(ValueError, match=r"a\.h5: cannot be read as HDF5: ") as caught:
            next(frames)
    assert "\n" not in str(caught.value)


def test_an_hdf5_file_that_is_being_written_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    dynmesh.write(path, sequence())
    script = "import h5py, sys; file = h5py.File(sys.argv[1], 'r+'); print(flush=True); input()"
    with subprocess.Popen(
        [sys.executable, "-c", script, path], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as capture:
        assert capture.stdout is not None
        capture.stdout.readline()
        with pytest.raises(OSError, match=r"a\.h5: is open for writing in another program$"):
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
        with pytest.raises(ValueError, match=r"a\.h5: vertices: is not in this file"):
            dynmesh.read(tmp_path / "a.h5")
    with h5py.File(tmp_path / "other.h5", "r+") as file:
        file["times"] = h5py.ExternalLink("no.h5", "/times")  # what is lost is not ignored
    with pytest.raises(ValueError, match=r"read as HDF5: .*can't open file"):
        dynmesh.read(tmp_path / "other.h5")


def npy_of(vertices: Any, path: Path) -> bytes:
    np.save(path, vertices)
    return path.read_bytes()


def test_damaged_npy_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.npy"
    faces = GOOD["faces"]
    whole = npy_of(np.zeros((10, 4, 3), np.float32), path)
    for data, message in (
        (b"", "magic string"),
        (b"solid body", "magic string"),
        (whole[:50], "EOF"),
        (whole + b"\0", "its header declares 608 bytes, but the file has 609"),
        (whole.replace(b"(10, 4, 3)", b"(-1, 4, 3)"), r"array of shape \(-1, 4, 3\)"),
        (npy_of(np.zeros((4, 3)), path), r"must have shape \(n, k, 3\), not \(4, 3\)"),
        (npy_of(np.zeros((2, 4, 3), int), path), "float32 or float64, not int64"),
        (npy_of(np.array([None]), path), "holds Python objects"),
        (npy_of(np.float32(1), path), r"must have shape \(n, k, 3\), not \(\)"),
        (npy_of(np.zeros((0, 4, 3)), path), "has no frames"),
    ):
        path.write_bytes(data)
        with pytest.raises(ValueError, match=message) as caught:
            dynmesh.read(path, faces=faces)
        assert str(caught.value).startswith(f"{path}: ")
    np.save(path, np.zeros((10, 4, 3)))
    np.save(tmp_path / "a.known.npy", np.ones((9, 4), bool))
    with pytest.raises(ValueError, match=r"a\.known\.npy: known: must have shape \(10, 4\)"):
        dynmesh.read(path, faces=faces)
