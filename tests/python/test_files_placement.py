"""Up axis and unit in files whose formats have no field for them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from commands import dynmesh_command
from plain_files import FACE, POINTS, TRIANGLE, XYZ, ply

import dynmesh

FACES = np.array([[0, 1, 2], [0, 2, 3]])
SAID = dynmesh.Sequence(
    np.random.default_rng(0).random((2, 4, 3)),
    FACES,
    up_axis="z",
    metres_per_unit=0.0254,
)


def test_nothing_is_guessed_if_the_file_states_it(tmp_path: Path) -> None:
    dynmesh.write(tmp_path / "a_%d.ply", SAID)
    shown = dynmesh_command("info", tmp_path / "a_%d.ply").stdout
    assert "; probably" not in shown
    assert "0.0254 m" in shown
    dynmesh.write(tmp_path / "b_%d.ply", replace(SAID, up_axis=None))
    assert "; probably" in dynmesh_command("info", tmp_path / "b_%d.ply").stdout


@pytest.mark.parametrize("suffix", [".ply", ".obj"])
@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["up_axis z"], ("z", None)),
        (["Made by hand", "  up_axis   y  ", "metres_per_unit 1e-2"], ("y", 0.01)),
        (["up_axis x"], ("x", None)),
        # comments of other programs, which are ignored
        (["up_axis w"], (None, None)),
        (["up_axis"], (None, None)),
        (["the up_axis z"], (None, None)),
        (["up_axis z or y"], (None, None)),
        (["metres_per_unit much", "metres_per_unit -1", "metres_per_unit nan"], (None, None)),
        (["metres_per_unit inf", "metres_per_unit 0"], (None, None)),
    ],
)
def test_other_comments_are_ignored(
    tmp_path: Path, suffix: str, words: list[str], expected: tuple[str | None, float | None]
) -> None:
    path = tmp_path / f"a{suffix}"
    if suffix == ".ply":
        head = "\n".join(f"comment {line}" for line in words)
        mesh = ply(f"vertex 3: {XYZ}; face 1: {FACE}", POINTS + b"3 0 1 2\n", head=head)
    else:
        mesh = "".join([*(f"# {line}\n" for line in words), TRIANGLE]).encode()
    path.write_bytes(mesh)
    sequence = dynmesh.read(path)
    assert (sequence.up_axis, sequence.metres_per_unit) == expected
