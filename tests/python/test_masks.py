"""Which vertices are known, as a file beside the sequence says."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from commands import dynmesh_command as run

import dynmesh
from dynmesh._errors import DynmeshError


@pytest.fixture
def ocean() -> dynmesh.Sequence:
    """Six frames, whose numbers begin with 10."""
    return replace(dynmesh.synth.ocean(6, grid=10), start=10)


def test_damaged_vertices_are_listed_in_lines_of_text(
    ocean: dynmesh.Sequence, tmp_path: Path
) -> None:
    spoilt = ocean.vertices.copy()
    spoilt[:, [3, 4]] += 9
    spoilt[2, 70:72] += 9
    dynmesh.write(tmp_path / "in.npz", replace(ocean, vertices=spoilt))
    whole = replace(ocean[:1], start=0)
    dynmesh.write(tmp_path / "whole.obj", whole)
    mask = tmp_path / "damaged.txt"
    mask.write_text("# found by eye\n* 3 4\n\n12 70 71\n")
    known = dynmesh.read(tmp_path / "in.npz", known=mask).known
    assert known is not None
    expected = np.ones(known.shape, np.bool_)
    expected[:, [3, 4]] = expected[2, 70:72] = False
    np.testing.assert_array_equal(known, expected)
    words = ("complete", tmp_path / "in.npz", tmp_path / "out.npz", "--mask", mask)
    run(*words, "--template", tmp_path / "whole.obj")
    made = dynmesh.read(tmp_path / "out.npz").vertices
    assert np.abs(made - ocean.vertices).max() < 0.2


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("12 3\n12 x\n", "line 2: must be a frame"),
        ("3.5.1 2\n", "line 1: must be a frame"),
        ("* 100\n", "line 1: there is no vertex 100, only 0 to 99"),
        ("PK\xe5\x04", "line 1: must be a frame"),
        ("9 1\n", "there is no frame 9"),
    ],
)
def test_a_wrong_line_is_named(
    ocean: dynmesh.Sequence, tmp_path: Path, text: str, told: str
) -> None:
    dynmesh.write(tmp_path / "in.npz", ocean)
    (tmp_path / "mask.txt").write_text(text, "latin-1")
    with pytest.raises(DynmeshError, match=told) as caught:
        dynmesh.open(tmp_path / "in.npz", known=tmp_path / "mask.txt")
    assert caught.value.file == tmp_path / "mask.txt"


@pytest.mark.parametrize("inverted", [False, True])
def test_an_inverted_mask_is_asked_about(
    ocean: dynmesh.Sequence, tmp_path: Path, inverted: bool
) -> None:
    known = np.stack(list(dynmesh.degrade.random_known(6, 100, 0.89)))
    dynmesh.write(tmp_path / "in.npz", ocean)
    np.save(tmp_path / "mask.npy", ~known if inverted else known)
    dynmesh.write(tmp_path / "whole.obj", ocean[:1])
    words = ("complete", tmp_path / "in.npz", tmp_path / "out.npz", "--mask")
    said = run(*words, tmp_path / "mask.npy", "--template", tmp_path / "whole.obj").stderr
    assert ("11%" in said) == inverted


def test_zeros_are_missing_in_the_first_frame_as_well(
    ocean: dynmesh.Sequence, tmp_path: Path
) -> None:
    known = np.stack(list(dynmesh.degrade.random_known(7, 100, 0.6)))[1:]
    zeros = np.where(known[..., None], ocean.vertices + 5, np.float32(0))
    dynmesh.write(tmp_path / "in.npz", replace(ocean, vertices=zeros))
    run("complete", tmp_path / "in.npz", tmp_path / "out.npz", "--missing", "zero")
    made = dynmesh.read(tmp_path / "out.npz").vertices
    assert np.abs(made - 5 - ocean.vertices).max() < 0.5
