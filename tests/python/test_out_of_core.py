"""Sequences that do not fit into memory."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from memory import own_memory
from meshes import sheet

import dynmesh
from dynmesh.completion import ways


def test_memory_does_not_grow_with_the_frames(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first = sheet(100)
    header = dynmesh.Header(first.faces, 300, len(first.vertices), np.dtype(np.float32))
    source = tmp_path / "in.h5"
    used: list[int] = []
    with dynmesh.create(source, header) as writer:
        for i in range(300):
            writer.append((first.vertices + 0.001 * i).astype(np.float32))

    def watched(frames: Iterator[Any], *_: Any) -> Iterator[Any]:
        for number, frame in enumerate(frames):
            if number % 50 == 49:
                used.append(own_memory())
            yield frame

    monkeypatch.setattr(ways, "tracked", watched)
    before = own_memory()
    dynmesh.complete_file(source, tmp_path / "out.h5", method="motion")
    assert max(used) - before < 18_000  # the frames are 36 MB
