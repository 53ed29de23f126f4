"""Reading and writing sequences."""

import io
import resource
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import Mesh
from sequences import GOOD, NO_SEQUENCE

import dynmesh


def sequence_of(mesh: Mesh) -> dynmesh.Sequence:
    rng = np.random.default_rng(0)
    vertices = (mesh.vertices + rng.normal(size=(5, 1, 3))).astype(np.float32)
    return dynmesh.Sequence(
        vertices, mesh.faces, rng.random((5, len(mesh.vertices))) < 0.5, fps=25.0
    )


def test_what_numpy_writes_is_read(tmp_path: Path, mesh: Mesh) -> None:
    sequence = sequence_of(mesh)
    known = sequence.known
    assert known is not None
    np.savez_compressed(
        tmp_path / "a.npz", vertices=sequence.vertices, faces=mesh.faces, known=known
    )
    np.savez(
        tmp_path / "b.npz",
        vertices=np.asfortranarray(sequence.vertices.astype(">f4")),
        faces=mesh.faces.astype(np.uint16),
        known=np.asfortranarray(known),
        fps=np.array([25]),
        more="ignored",
    )
    for name in ("a.npz", "b.npz"):
        again = dynmesh.read(tmp_path / name)
        np.testing.assert_array_equal(again.vertices, sequence.vertices)
        np.testing.assert_array_equal(again.known, known)
        assert again.vertices.dtype == np.float32


def test_memory_does_not_grow_with_the_frames(tmp_path: Path, mesh: Mesh) -> None:
    path = tmp_path / "long.npz"
    frame = np.zeros((250_000, 3))
    known = np.ones(len(frame), bool)

    def peak() -> int:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss  # kB

    before = peak()
    header = dynmesh.Header(mesh.faces, 30, len(frame), frame.dtype, has_known=True)
    with dynmesh.create(path, header) as writer:
        for _ in range(30):
            writer.append(frame, known)
    assert path.stat().st_size > 185e6
    with dynmesh.open(path) as reader:
        assert sum(bool(f.known is not None and f.known.all()) for f in reader) == 30
    assert peak() - before < 100_000


def test_unfinished_files_do_not_have_the_final_name(tmp_path: Path, mesh: Mesh) -> None:
    sequence = sequence_of(mesh)
    path = tmp_path / "a.npz"
    dynmesh.write(path, sequence)
    before = path.read_bytes()

    def write_some(n: int, error: Exception | None) -> None:
        header = dynmesh.Header(mesh.faces, 3, 49, np.dtype(np.float32))
        with dynmesh.create(path, header) as writer:
            for i in range(n):
                writer.append(sequence.vertices[i])
            if error:
                raise error

    with pytest.raises(KeyboardInterrupt):
        write_some(2, KeyboardInterrupt())  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="only 2 of 3 frames were appended"):
        write_some(2, None)
    with pytest.raises(ValueError, match="frame 3: the file was created for 3 frames only"):
        write_some(4, None)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]
    write_some(3, None)
    assert dynmesh.read(path).vertices.shape == (3, 49, 3)


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        *NO_SEQUENCE,
        (GOOD | {"vertices": np.array([None, "x"], object)}, "vertices: holds Python objects"),
    ],
)
def test_files_that_hold_no_sequence_are_refused(
    tmp_path: Path, arrays: dict[str, Any], message: str
) -> None:
    path = tmp_path / "a.npz"
    np.savez(path, **arrays)
    with pytest.raises(ValueError, match=message) as caught:
        dynmesh.read(path)
    assert str(caught.value).startswith(f"{path}: ")


def test_an_array_with_fewer_frames_than_it_announces_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "damaged.npz"
    with zipfile.ZipFile(path, "w") as archive:
        for name, array, size in (
            ("vertices", np.zeros((100, 4, 3)), 1000),
            ("faces", GOOD["faces"], None),
        ):
            buffer = io.BytesIO()
            np.save(buffer, array)
            archive.writestr(f"{name}.npy", buffer.getvalue()[:size])
    with pytest.raises(ValueError, match=r"damaged\.npz: .*ends in the middle of frame 9 of 100"):
        dynmesh.read(path)
