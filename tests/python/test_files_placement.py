"""Up axis and unit in files whose formats have no field for them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from commands import dynmesh_command

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


PLY = """ply
format ascii 1.0
{comment}element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
3 0 1 2
"""
OBJ = "{comment}v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


@pytest.mark.parametrize(("suffix", "text", "mark"), [(".ply", PLY, "comment"), (".obj", OBJ, "#")])
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
    tmp_path: Path,
    suffix: str,
    text: str,
    mark: str,
    words: list[str],
    expected: tuple[str | None, float | None],
) -> None:
    path = tmp_path / f"a{suffix}"
    path.write_text(text.format(comment="".join(f"{mark} {line}\n" for line in words)))
    sequence = dynmesh.read(path)
    assert (sequence.up_axis, sequence.metres_per_unit) == expected
