"""Inputs of which one byte has changed.

Where a format has checksums, the file is refused, or gives the same. Without checksums, another
number is as good as the right one: the file is refused, or is valid and differs by no more than the
byte.
"""

from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from damage import check_damage
from test_files_damaged import LIBRARIES, SUFFIXES, Files

import dynmesh
from dynmesh.scans import (
    PointScan,
    read_points,
    write_ply,
)


def entries(found: Any) -> dict[str, Any]:
    return {field.name: getattr(found, field.name) for field in fields(found)}


def differences(found: Any, whole: Any) -> int:
    """The number of entries in which two results differ; far too many if their kind does."""
    if isinstance(whole, list | tuple):
        if len(found) != len(whole):
            return 10**9
        return sum(differences(*pair) for pair in zip(found, whole, strict=True))
    if hasattr(whole, "__dataclass_fields__"):
        return differences(list(entries(found).values()), list(entries(whole).values()))
    if not isinstance(whole, np.ndarray):
        return int(found != whole)
    if not isinstance(found, np.ndarray) or (found.shape, found.dtype) != (
        whole.shape,
        whole.dtype,
    ):
        return 10**9
    return int(np.sum((found != whole) & ~((found != found) & (whole != whole))))


def same(found: Any, whole: Any) -> bool:
    return differences(found, whole) == 0


def same_but_for_one(found: Any, whole: Any) -> bool:
    return differences(found, whole) <= 1


def same_but_for_one_row(found: Any, whole: Any) -> bool:
    """As normals get unit length, a changed number changes all three of its row."""
    return differences(found, whole) <= 3


def valid(found: dynmesh.Sequence, _: Any) -> bool:
    return bool(found.faces.max(initial=0) < found.vertices.shape[1])


PROMISES = {"npz": same, "npy": same_but_for_one, "ply": same_but_for_one}
"""Of the other formats, a changed word may also be one that readers ignore."""


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_sequence(suffix: str, tmp_path: Path) -> None:
    if suffix in LIBRARIES:
        pytest.importorskip(LIBRARIES[suffix])
    (tmp_path / "sound").mkdir()
    sound = Files(tmp_path / "sound")
    sound.whole(suffix)
    path = sound.path(suffix).relative_to(tmp_path / "sound")
    promise: Callable[[Any, Any], bool] = PROMISES.get(suffix, valid)
    check_damage(
        tmp_path / "sound",
        lambda folder: dynmesh.read(folder / path),
        work=tmp_path / "work",
        same=promise,
        most=20,
        # Where files contradict each other, any of them may be the damaged one.
        names=lambda file: file.parent if len(sound.whole(suffix)) > 1 else file,
    )


@pytest.mark.parametrize("suffix", ["ply", "xyz"])
def test_points(suffix: str, tmp_path: Path) -> None:
    points, normals = np.random.default_rng(0).normal(size=(2, 5, 3)).astype(np.float32)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    file = tmp_path / "sound" / f"scan.{suffix}"
    file.parent.mkdir()
    if suffix == "ply":
        write_ply(file, PointScan(points, normals, points[:1]))
    else:
        np.savetxt(file, points)
    check_damage(
        file.parent,
        lambda folder: read_points(folder / file.name),
        work=tmp_path / "work",
        same=same_but_for_one_row,
        most=100,
    )
