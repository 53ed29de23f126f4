"""Files with randomly changed bytes: every reader yields a sequence, or raises an error that names
the file, and allocates no more memory than the file can require."""

import math
import random
import tracemalloc
import zipfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest
from conftest import LONGER
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from meshes import sheet

import dynmesh

SUFFIXES = {name: name for name in ("npz", "npy", "ply", "obj", "pc2", "usda", "usdc")} | {
    "h5": "hdf5"
}
LIBRARIES = {"h5": "h5py", "usda": "pxr", "usdc": "pxr"}
# Without Alembic, whose library ends the process for some damaged files.

WORDS = [
    b"\xff\xff\xff\xff", b"\x7f\xff\xff\xff", b"\xff\xff\xff\x7f", b"\0\0\0\0", b"\0\0\0\x80",
    b"nan", b"-1", b"2147483648", b"99999999999999999999", b"1e999", b"\n", b" ", b"'", b"(", b"}",
]  # fmt: skip

Change = tuple[str, float, bytes]


def changes() -> st.SearchStrategy[list[Change]]:
    """Draws changes of a file: what, where and by which bytes."""
    kinds = st.sampled_from(["cut", "insert", "overwrite", "remove", "splice"])
    place = st.one_of(st.floats(0, 1), st.floats(0, 0.05))
    words = st.one_of(st.sampled_from(WORDS), st.binary(max_size=6))
    return st.lists(st.tuples(kinds, place, words), min_size=1, max_size=4)


def changed(content: bytes, changes: list[Change]) -> bytes:
    """Applies all these changes to the content."""
    for kind, share, word in changes:
        place = int(share * len(content))
        before, after = content[:place], content[place:]
        if kind == "cut":
            content = before
        elif kind == "insert":
            content = before + word + after
        elif kind == "overwrite":
            content = before + word + after[len(word) :]
        elif kind == "remove":
            content = before + after[len(word) + 1 :]
        else:
            content = before + content[len(content) // 3 :]
    return content


class Files:
    """A sequence of each format, and a folder for damaged ones."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.contents: dict[str, dict[Path, bytes]] = {}

    def sequence(self, suffix: str) -> dynmesh.Sequence:
        mesh = sheet(4)
        steps = np.linspace(0, 1, 4)[:, None, None]
        vertices = (mesh.vertices + steps).astype(np.float32)
        known = np.random.default_rng(0).random(vertices.shape[:2]) < 0.7
        known[0] = True
        generation = np.where(known, 0, 1).astype(np.int32)
        traced = suffix not in ("obj", "pc2")
        return dynmesh.Sequence(
            vertices,
            mesh.faces.astype(np.int32),
            known if traced else None,
            fps=None if suffix in ("npy", "ply", "obj", "pc2") else 25.0,
            generation=generation if traced else None,
            age=generation.copy() if traced else None,
        )

    def path(self, suffix: str) -> Path:
        name = f"body_%04d.{suffix}" if suffix in ("ply", "obj") else f"body.{suffix}"
        return self.folder / suffix / name

    def whole(self, suffix: str) -> dict[Path, bytes]:
        """Returns the files of the format, and restores the originals."""
        if suffix not in self.contents:
            path = self.path(suffix)
            path.parent.mkdir()
            dynmesh.write(path, self.sequence(suffix))
            files = sorted(file for file in path.parent.rglob("*") if file.is_file())
            self.contents[suffix] = {file: file.read_bytes() for file in files}
        for file, content in self.contents[suffix].items():
            file.write_bytes(content)
        return self.contents[suffix]


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Files:
    return Files(tmp_path_factory.mktemp("damaged"))


def check(files: Files, suffix: str) -> dynmesh.Sequence | None:
    """Reads the current files; returns the sequence, or None if it is refused."""
    tracemalloc.start()
    try:
        sequence = dynmesh.read(files.path(suffix))
        assert sequence.faces.max(initial=0) < sequence.vertices.shape[1]
        return sequence
    except (ValueError, OSError) as error:
        assert str(files.folder / suffix) in str(error)  # noqa: PT017
        assert "\n" not in str(error)  # noqa: PT017
        return None
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < 32 << 20


@pytest.mark.parametrize("suffix", SUFFIXES)
@settings(
    max_examples=25 * LONGER,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(victim=st.integers(0, 99), changes=changes())
@example(victim=0, changes=[])
def test_any_bytes(suffix: str, files: Files, victim: int, changes: list[Change]) -> None:
    if suffix in LIBRARIES:
        pytest.importorskip(LIBRARIES[suffix])
    contents = list(files.whole(suffix).items())
    file, content = contents[victim % len(contents)]
    file.write_bytes(changed(content, changes))
    check(files, suffix)


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


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_changed_byte_is_noticed_or_changes_one_number(suffix: str, files: Files) -> None:
    if suffix in LIBRARIES:
        pytest.importorskip(LIBRARIES[suffix])
    generator = random.Random(suffix)
    contents = files.whole(suffix)
    whole = dynmesh.read(files.path(suffix))
    for file, content in contents.items():
        places: Iterable[int] = range(len(content))
        if LONGER == 1:
            places = generator.sample(range(len(content)), 20)
        for place in {0, *places, len(content) - 1}:
            damaged = bytearray(content)
            damaged[place] ^= generator.choice((1 << generator.randrange(8), 0xFF))
            file.write_bytes(damaged)
            found = check(files, suffix)
            most = MOST_CHANGED.get(suffix, np.inf)
            assert found is None or differences(found, whole) <= most, (file, place)
        file.write_bytes(content)


@pytest.mark.parametrize(
    ("suffix", "name", "old", "new", "message"),
    [
        ("npy", "body.faces.npy", b"NUMPY\x01\x00", b"NUMPY\x02\x00", "its header would have"),
        ("npy", "body.npy", b"}", b" ", "its header cannot be read"),
    ],
    ids=["a huge header", "a header that ends in its middle"],
)
def test_damage_that_is_rarely_drawn(
    files: Files, suffix: str, name: str, old: bytes, new: bytes, message: str
) -> None:
    files.whole(suffix)
    damaged = files.path(suffix).with_name(name)
    content = damaged.read_bytes()
    assert old in content
    damaged.write_bytes(content.replace(old, new, 1))
    check(files, suffix)
    with pytest.raises(ValueError, match=message):
        dynmesh.read(files.path(suffix))


@pytest.mark.parametrize("name", ["vertices", "faces"])
def test_an_archive_that_claims_billions(tmp_path: Path, name: str) -> None:
    path = tmp_path / "claims.npz"
    with zipfile.ZipFile(path, "w") as archive:
        for array, shape, kind in (("vertices", (2, 9, 3), "<f4"), ("faces", (8, 3), "<i4")):
            claimed = (2**31, *shape[1:]) if array == name else shape
            header = {"descr": kind, "fortran_order": False, "shape": claimed}
            with archive.open(f"{array}.npy", "w") as member:
                np.lib.format.write_array_header_1_0(member, header)
                member.write(bytes(4 * math.prod(shape)))
    tracemalloc.start()
    try:
        with pytest.raises(ValueError, match=rf"claims\.npz: {name}: .*its header declares"):
            dynmesh.read(path)
        assert tracemalloc.get_traced_memory()[1] < 32 << 20
    finally:
        tracemalloc.stop()


def test_an_archive_whose_members_begin_before_it(tmp_path: Path) -> None:
    mesh = sheet(3)
    path = tmp_path / "places.npz"
    np.savez(path, vertices=mesh.vertices[None], faces=mesh.faces)
    content = bytearray(path.read_bytes())
    content[-4] += 1  # the offset of the list of members
    path.write_bytes(content)
    with pytest.raises(ValueError, match=r"places\.npz: is damaged or not an \.npz archive"):
        dynmesh.read(path)


@pytest.mark.parametrize("name", ["vertices", "faces"])
def test_a_dataset_that_claims_billions(tmp_path: Path, name: str) -> None:
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "claims.h5"
    shapes = {"vertices": (2, 3, 3), "faces": (1, 3)}
    shapes[name] = (2, 2**31 - 1, 3)[-len(shapes[name]) :]
    with h5py.File(path, "w") as file:
        for dataset, shape in shapes.items():
            dtype = "f4" if dataset == "vertices" else "i4"
            file.create_dataset(dataset, shape, dtype, chunks=True)
    with pytest.raises(ValueError, match=rf"claims\.h5: {name}: would have .* bytes, but the file"):
        dynmesh.read(path)
