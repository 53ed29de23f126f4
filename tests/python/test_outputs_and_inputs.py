"""An output never replaces an input, and comparing the two is quick."""

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import Mesh

import dynmesh
from dynmesh import files
from dynmesh.jobs.batch import Job, complete_files
from dynmesh.jobs.file_completion import complete_file


@pytest.fixture
def partial(tmp_path: Path) -> Path:
    """A short ocean with missing vertices, in a folder of its own."""
    path = tmp_path / "in" / "partial.npz"
    path.parent.mkdir()
    ocean = dynmesh.synth.ocean(3, seed=3)
    known = np.stack(list(dynmesh.degrade.random_known(3, 2500, 0.3, seed=1)))
    dynmesh.write(path, dynmesh.Sequence(ocean.vertices, ocean.faces, known))
    return path


def test_many_files_are_compared_in_linear_time(
    tmp_path: Path, mesh: Mesh, monkeypatch: pytest.MonkeyPatch
) -> None:
    stat = os.stat
    looked_at: list[object] = []

    def counted(path: Any, *arguments: Any, **more: Any) -> os.stat_result:
        looked_at.append(path)
        return stat(path, *arguments, **more)

    def calls(n: int, **options: Any) -> int:
        """Counts the system calls about files when n frames are completed over older ones."""
        vertices = np.repeat(mesh.vertices[None], n, axis=0)
        source, output = tmp_path / f"in{n}" / "f_%02d.ply", tmp_path / f"out{n}" / "f_%02d.ply"
        for path in (source, output):
            dynmesh.write(path, dynmesh.Sequence(vertices, mesh.faces))
        looked_at.clear()
        with monkeypatch.context() as patch:
            patch.setattr(os, "stat", counted)
            if options:
                complete_file(source, output, **options)
            else:
                with pytest.raises(FileExistsError):
                    complete_file(source, output)
        return len(looked_at)

    for options in ({}, {"overwrite": True}):
        few = calls(5, **options)
        assert few >= 5
        assert calls(20, **options) <= 4 * few


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


def test_the_format_of_a_path_is_chosen_once(
    tmp_path: Path, partial: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    chosen: list[Path] = []

    def choose(path: Path, *rest: Any) -> Any:
        chosen.append(path)
        return original(path, *rest)

    original = files.choice.choose
    for module in (files.choice, files.target):
        monkeypatch.setattr(module, "choose", choose)
    output = tmp_path / "out.npz"
    complete_file(partial, output)
    assert chosen == [output, partial]
    chosen.clear()
    assert [r.status for r in complete_files([Job(partial, tmp_path / "two.npz")])] == ["done"]
    # The outputs of all jobs are compared before the first begins, perhaps on another machine.
    assert chosen == [tmp_path / "two.npz", tmp_path / "two.npz", partial]
