"""Damaged files, full disks and long sequences, in all formats."""

import math
import random
import re
import resource
import tracemalloc
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import dynmesh_command, run_here
from conftest import LONGER
from every_format import (
    FORMATS,
    MASKED,
    NUMBERED,
    PARTIAL,
    TRACED,
    place,
)
from meshes import sheet
from sequences import assert_named

import dynmesh
from dynmesh._errors import DynmeshError


def result_of(path: Path) -> dynmesh.Sequence | str:
    """Reads a sequence in little memory; returns it, or else why it is refused."""
    tracemalloc.start()
    try:
        sequence = dynmesh.read(path)
        assert sequence.faces.max(initial=0) < sequence.vertices.shape[1]
        return sequence
    except (DynmeshError, OSError) as error:
        assert_named(error, path)
        return str(error)
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < 32 << 20


def differences(found: dynmesh.Sequence, whole: dynmesh.Sequence) -> float:
    """The number of entries in which two sequences differ; infinity if their kinds do."""
    count: float = 0
    for field in fields(dynmesh.Sequence):
        one, other = (np.asarray(getattr(each, field.name)) for each in (found, whole))
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


@pytest.mark.parametrize("format", FORMATS)
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
    masks = ["known"] * (format in MASKED)
    header = dynmesh.Header(faces, n_frames, len(points), points.dtype, attributes=masks)

    def frames() -> Iterator[dynmesh.Frame]:
        for _ in range(n_frames):
            points[0] += 1  # equal frames would be stored only once
            yield dynmesh.Frame(points, known)
            used.append(own_memory())

    dynmesh.write(path, dynmesh.frames.Run(header, frames))
    assert path.stat().st_size > n_frames * points.nbytes
    assert max(used) - used[0] < 20_000
    with dynmesh.open(path) as reader:
        used = [own_memory() for _ in reader]
    assert max(used) - used[0] < 10_000
