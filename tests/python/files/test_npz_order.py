"""Archives whose frames are not read from the first to the last."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dynmesh
from dynmesh.formats.rows import Rows

N, K = 60, 2000
VERTICES = np.random.default_rng(0).normal(size=(N, K, 3)).astype(np.float32).round(2)
KNOWN = np.random.default_rng(1).random((N, K)) < 0.5
SAVE: dict[str, Callable[..., None]] = {"stored": np.savez, "compressed": np.savez_compressed}
BY_COLUMNS = np.asfortranarray(VERTICES)
ORDERS: dict[str, list[int]] = {
    "backwards": [*reversed(range(N))],
    "any": np.random.default_rng(2).permutation(N).tolist(),
    "blocks": [at for end in range(N, 0, -7) for at in range(max(end - 7, 0), end)],
}


@pytest.fixture(params=SAVE)
def archive(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    path = tmp_path / "a.npz"
    SAVE[request.param](path, vertices=VERTICES, faces=np.array([[0, 1, 2]]), known=KNOWN)
    return path


@pytest.mark.parametrize("order", ORDERS)
def test_frames_are_the_same_in_any_order(archive: Path, order: str) -> None:
    with dynmesh.open(archive) as frames:
        others = frames.frames()
        for at in ORDERS[order]:
            frame, other = frames[at], next(others)
            np.testing.assert_array_equal(frame.points, VERTICES[at])
            np.testing.assert_array_equal(frame.known, KNOWN[at])
            assert other.points.shape == (K, 3)


@pytest.mark.parametrize("suffix", [".npz", ".npy"])
def test_an_array_by_columns_is_read_once(
    tmp_path: Path, suffix: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / f"a{suffix}"
    if suffix == ".npz":
        np.savez_compressed(path, vertices=BY_COLUMNS, faces=np.array([[0, 1, 2]]))
    else:
        np.save(path, BY_COLUMNS)
        np.save(tmp_path / "a.faces.npy", np.array([[0, 1, 2]]))
    read, whole = list[int](), Rows.whole

    def counted(rows: Rows) -> Any:
        read.append(rows.shape[0])
        return whole(rows)

    monkeypatch.setattr(Rows, "whole", counted)
    with dynmesh.open(path) as frames:
        for at in reversed(range(N)):
            np.testing.assert_array_equal(frames[at].points, VERTICES[at])
    assert read.count(N) == 1
