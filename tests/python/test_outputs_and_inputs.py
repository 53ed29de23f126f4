"""An output never replaces an input, and comparing the two is quick."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import dynmesh
from dynmesh.jobs.file_completion import complete_file


def save_mask(folder: Path) -> tuple[Path, dict[str, Any]]:
    """Positions in one file and their masks in another."""
    sequence = dynmesh.synth.ocean(3)
    source, masks = folder / "in.npz", folder / "m.npy"
    dynmesh.write(source, sequence)
    np.save(masks, np.stack(list(dynmesh.degrade.random_known(3, 2500, 0.5, seed=1))))
    return masks, {"path": source, "source": {"known": masks}}


def save_faces(folder: Path) -> tuple[Path, dict[str, Any]]:
    """Positions in one file and their faces in another."""
    sequence = dynmesh.synth.ocean(3)
    points, mesh = folder / "in.npy", folder / "mesh.ply"
    np.save(points, sequence.vertices)
    dynmesh.write(mesh, replace(sequence, vertices=sequence.vertices[:1], known=None))
    return mesh, {"path": points, "source": {"faces": mesh}, "output_format": "npz"}


def test_frames_are_not_written_among_those_that_are_read(tmp_path: Path) -> None:
    folder, sequence = tmp_path / "scans", dynmesh.synth.ocean(3)
    dynmesh.write(folder / "frame_%04d.ply", sequence)
    before = sorted(folder.iterdir())
    for overwrite in (False, True):
        with pytest.raises(ValueError, match=r"out_%04d\.ply: is in the folder of the input"):
            dynmesh.complete_file(folder, folder / "out_%04d.ply", overwrite=overwrite)
        with pytest.raises(ValueError, match="is the input; writing over it would lose it"):
            dynmesh.complete_file(folder, folder / "frame_%04d.ply", overwrite=overwrite)
    assert sorted(folder.iterdir()) == before
    dynmesh.complete_file(folder, folder / "out.npz")
    dynmesh.complete_file(folder / "frame_%04d.ply", folder / "out_%04d.ply")


@pytest.mark.parametrize("save", [save_mask, save_faces])
def test_an_output_never_replaces_a_second_input(tmp_path: Path, save: Any) -> None:
    beside, arguments = save(tmp_path)
    before = beside.read_bytes()
    for output in (beside, tmp_path / "." / beside.name):
        with pytest.raises(ValueError, match="is the input; writing over it would lose it"):
            complete_file(**arguments, output=output, overwrite=True)
    assert beside.read_bytes() == before
    assert sorted(path.suffix for path in tmp_path.iterdir()) == sorted(
        [Path(arguments["path"]).suffix, beside.suffix]
    )
