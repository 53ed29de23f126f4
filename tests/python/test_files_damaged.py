"""Files with randomly changed bytes: every reader yields a sequence, or raises an error that names
the file, and allocates no more memory than the file can require."""

import math
import random
import re
import tracemalloc
import zipfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import LONGER
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
    """A sequence of each format, in folders of their own, and its sound bytes."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.contents: dict[str, dict[Path, bytes]] = {}

    def path(self, suffix: str) -> Path:
        name = f"body_%04d.{suffix}" if suffix in ("ply", "obj") else f"body.{suffix}"
        return self.folder / suffix / name

    def whole(self, suffix: str) -> dict[Path, bytes]:
        """Returns the files of the format, and restores the originals."""
        if suffix not in self.contents:
            mesh, known = sheet(4), np.random.default_rng(0).random((4, 16)) < 0.7
            vertices = (mesh.vertices + np.arange(4)[:, None, None] / 3).astype(np.float32)
            traces: dict[str, Any] = {}
            if suffix not in ("obj", "pc2"):
                generation = np.where(known, 0, 1).astype(np.int32)
                traces = {"known": known, "generation": generation, "age": generation}
            path = self.path(suffix)
            dynmesh.write(path, dynmesh.Sequence(vertices, mesh.faces, fps=25.0, **traces))
            found = (file for file in path.parent.rglob("*") if file.is_file())
            self.contents[suffix] = {file: file.read_bytes() for file in sorted(found)}
        for file, content in self.contents[suffix].items():
            file.write_bytes(content)
        return self.contents[suffix]


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Files:
    return Files(tmp_path_factory.mktemp("damaged"))


def result_of(path: Path) -> dynmesh.Sequence | str:
    """Reads a sequence in little memory; returns it, or else why it is refused."""
    tracemalloc.start()
    try:
        sequence = dynmesh.read(path)
        assert sequence.faces.max(initial=0) < sequence.vertices.shape[1]
        return sequence
    except (ValueError, OSError) as error:
        assert str(path.parent) in str(error)  # noqa: PT017
        assert "\n" not in str(error)  # noqa: PT017
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
            found = result_of(files.path(suffix))
            most = MOST_CHANGED.get(suffix, np.inf)
            assert isinstance(found, str) or differences(found, whole) <= most, (file, place)
        file.write_bytes(content)


def claiming_npz(path: Path, name: str) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        for array, shape, kind in (("vertices", (2, 9, 3), "<f4"), ("faces", (8, 3), "<i4")):
            claimed = (2**31, *shape[1:]) if array == name else shape
            header = {"descr": kind, "fortran_order": False, "shape": claimed}
            with archive.open(f"{array}.npy", "w") as member:
                np.lib.format.write_array_header_1_0(member, header)
                member.write(bytes(4 * math.prod(shape)))


def claiming_h5(path: Path, name: str) -> None:
    shapes = {"vertices": (2, 3, 3), "faces": (1, 3)}
    shapes[name] = (2, 2**31 - 1, 3)[-len(shapes[name]) :]
    with pytest.importorskip("h5py").File(path, "w") as file:
        for dataset, shape in shapes.items():
            dtype = "f4" if dataset == "vertices" else "i4"
            file.create_dataset(dataset, shape, dtype, chunks=True)


@pytest.mark.parametrize("name", ["vertices", "faces"])
@pytest.mark.parametrize("claim", [claiming_npz, claiming_h5])
def test_an_array_that_claims_billions_is_named(
    tmp_path: Path, claim: Callable[[Path, str], None], name: str
) -> None:
    path = tmp_path / f"claims.{claim.__name__.partition('_')[2]}"
    claim(path, name)
    assert re.search(
        rf"{path.name}: {name}: .*(declares|would have) .* bytes", str(result_of(path))
    )


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [("body.faces.npy", b"NUMPY\x01\x00", b"NUMPY\x02\x00"), ("body.npy", b"}", b" ")],
    ids=["a huge header", "a header that ends in its middle"],
)
def test_damage_that_is_rarely_drawn(files: Files, name: str, old: bytes, new: bytes) -> None:
    damaged = files.path("npy").with_name(name)
    content = files.whole("npy")[damaged]
    damaged.write_bytes(content.replace(old, new, 1))
    assert str(result_of(files.path("npy"))).startswith(f"{damaged}: ")


def test_an_archive_whose_members_begin_before_it(files: Files) -> None:
    path = files.path("npz")
    content = bytearray(files.whole("npz")[path])
    content[-4] += 1  # the offset of the list of members
    path.write_bytes(content)
    assert str(result_of(path)).startswith(f"{path}: ")
