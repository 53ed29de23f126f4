"""Errors that know which argument, frame and file they are about."""

import pickle
from pathlib import Path

import numpy as np
import pytest
from meshes import Mesh

import dynmesh
from dynmesh._errors import InputError, KindError, SettingError, locating


def test_an_error_in_a_frame_knows_the_frame(mesh: Mesh) -> None:
    frames = [mesh.vertices, mesh.vertices, mesh.vertices[:3]]
    with pytest.raises(dynmesh.DynmeshError) as refused:
        list(dynmesh.complete(mesh.faces, frames))
    assert isinstance(refused.value, ValueError)
    assert refused.value.frame == 2
    assert str(refused.value) == f"frame 2: {refused.value.reason}"
    with pytest.raises(dynmesh.DynmeshError) as of_a_kind:
        list(dynmesh.complete(mesh.faces, [mesh.vertices, mesh.vertices.astype(int)]))
    assert isinstance(of_a_kind.value, TypeError)
    assert of_a_kind.value.frame == 1


def test_an_error_in_a_file_knows_the_file_argument_and_frame(tmp_path: Path, mesh: Mesh) -> None:
    path = tmp_path / "a.npz"
    header = dynmesh.Header(mesh.faces, 2, 49, np.dtype(np.float64), has_known=True)
    with pytest.raises(dynmesh.DynmeshError) as refused, dynmesh.create(path, header) as writer:
        writer.append(mesh.vertices, np.ones(48, bool))
    error = refused.value
    assert (error.file, error.frame, error.argument) == (path, 0, "known")
    assert str(error) == f"{path}: frame 0: known: {error.reason}"


def test_the_file_that_is_damaged_is_named_alone(tmp_path: Path, mesh: Mesh) -> None:
    vertices = np.zeros((1, 49, 3), np.float32)
    dynmesh.write(tmp_path / "a.pc2", dynmesh.Sequence(vertices, mesh.faces))
    beside = tmp_path / "a.obj"
    beside.write_text("v 1 2\n")
    with pytest.raises(dynmesh.DynmeshError) as refused:
        dynmesh.open(tmp_path / "a.pc2")
    assert refused.value.file == beside
    assert str(refused.value).count("a.obj") == 1


def test_the_innermost_place_stays() -> None:
    error = KindError("must be float32", argument="points")
    with pytest.raises(KindError), locating(frame=7, file=Path("b")), locating(frame=3):
        raise error
    assert str(error) == "b: frame 3: points: must be float32"


@pytest.mark.parametrize("kind", [InputError, KindError, SettingError])
def test_errors_survive_another_process(kind: type[dynmesh.DynmeshError]) -> None:
    error = kind("is empty", argument="faces", frame=3, file=Path("a.npz"))
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is kind
    assert str(again) == str(error) == "a.npz: frame 3: faces: is empty"
