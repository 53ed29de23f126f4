"""Small seas, comparing sequences, and arrays that are none."""

import re
from collections.abc import Callable, Iterable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import Mesh

import dynmesh


def sea(
    n: int, grid: int = 10, share: float | None = None, whole: Iterable[int] = (), **more: Any
) -> dynmesh.Sequence:
    """An ocean; with a share, one of which that share is known, and these frames wholly."""
    ocean = dynmesh.synth.ocean(n, grid=grid, seed=3)
    if share is not None:
        known = np.random.default_rng(5).random((n, grid**2)) < share
        known[list(whole)] = True
        more["known"] = known
    return replace(ocean, **more)


def assert_same(one: dynmesh.Sequence, other: dynmesh.Sequence) -> None:
    """In all that they hold, but for the times in their reports."""
    names = [field.name for field in fields(dynmesh.Sequence) if field.name != "report"]
    ours, theirs = ({name: getattr(s, name) for name in names} for s in (one, other))
    np.testing.assert_equal(ours, theirs)
    assert one.vertices.dtype == other.vertices.dtype


def assert_named(error: Exception, path: Path) -> None:
    """Checks that a file is refused by name and in one line."""
    assert str(path.parent) in str(error)
    assert "\n" not in str(error)


def assert_refused(
    path: Path, told: str = "", read: Callable[..., Any] = dynmesh.read, **options: Any
) -> None:
    """Checks that a file is refused in one line, which names it."""
    try:
        read(path, **options)
    except dynmesh.DynmeshError as error:  # which is not kept, nor what its frames hold open
        file, said = error.file, str(error)
    else:
        pytest.fail(f"{path} was read")
    assert file == path
    assert "\n" not in said
    assert re.search(told, said), said


GOOD: dict[str, Any] = {
    "vertices": np.zeros((2, 4, 3), np.float32),
    "faces": np.array([[0, 1, 2], [0, 2, 3]]),
}
"""The arrays of a sequence, by their names in a file."""

NO_SEQUENCE: list[tuple[dict[str, Any], str]] = [
    ({"faces": GOOD["faces"]}, "has no array 'vertices'.*this file holds faces"),
    (GOOD | {"vertices": np.zeros((4, 3))}, r"must have shape \(n, k, 3\), not \(4, 3\)"),
    (GOOD | {"faces": np.zeros((2, 2), int)}, "faces: polygon 0 has 2 corners, but needs"),
    (GOOD | {"known": np.ones((1, 4), bool)}, r"known: must have shape \(2, 4\) to match vert"),
    (GOOD | {"known": np.ones((2, 4))}, "known: must be bool, or .* 0 and 1, not float"),
    (GOOD | {"fps": np.nan}, "fps: must be positive and finite, not nan"),
    (GOOD | {"vertices": np.zeros((0, 4, 3))}, "has no frames"),
    (GOOD | {"age": np.ones((2, 4), int)}, "generation, age: must be given both or neither"),
    (GOOD | {"up_axis": "w"}, "up_axis: must be 'x', 'y' or 'z', not 'w'"),
    (GOOD | {"times": [1.0, 2, 3]}, r"times: must have shape \(2,\) to match vertices, not \(3,"),
    (GOOD | {"times": [2, 2]}, "must be finite and ascending, but frame 1 is at 2.0"),
    (GOOD | {"metres_per_unit": 0}, "metres_per_unit: must be positive and finite, not 0"),
]
"""Arrays that make no sequence, and what is said of them in every format that holds arrays."""


def sequence_of(mesh: Mesh, n: int = 3, dtype: Any = np.float32) -> dynmesh.Sequence:
    """A mesh that moves by a third in each frame."""
    shift = np.arange(n).reshape(n, 1, 1) / 3
    return dynmesh.Sequence((mesh.vertices + shift).astype(dtype), mesh.faces)


def names(folder: Path) -> list[str]:
    """Of all files in a folder."""
    return sorted(path.name for path in folder.iterdir())


def contents(folder: Path) -> dict[str, bytes]:
    """All files in a folder, the hidden ones included."""
    found = (file for file in folder.rglob("*") if file.is_file())
    return {str(file.relative_to(folder)): file.read_bytes() for file in found}


def left_in(folder: Path) -> dict[str, object]:
    """All that is in a folder: what files hold, where links lead, and what else there is."""

    def of(path: Path) -> object:
        if path.is_symlink():
            return path.readlink()
        return path.read_bytes() if path.is_file() else path.stat().st_mode

    return {str(path.relative_to(folder)): of(path) for path in folder.rglob("*")}
