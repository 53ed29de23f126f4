"""PVD files, compared with VTK's own reader and writer."""

from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from meshes import Mesh
from vtk_meshes import as_array, as_cells, as_polydata, parts, point_data
from vtkmodules.vtkCommonCore import vtkLogger, vtkOutputWindow
from vtkmodules.vtkCommonDataModel import vtkCellArray
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader, vtkXMLPolyDataWriter

import dynmesh
from dynmesh import files

Adjust = Callable[[Any], object]


def moving(mesh: Mesh, n: int = 4, **more: Any) -> dynmesh.Sequence:
    vertices = mesh.vertices + np.arange(n).reshape(n, 1, 1) / 3
    return dynmesh.Sequence(vertices, mesh.faces, **more)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def write_vtp(path: Path, mesh: Any, adjust: Adjust | None = None) -> None:
    writer = vtkXMLPolyDataWriter()
    writer.SetInputData(mesh)
    writer.SetFileName(str(path))
    if adjust:
        adjust(writer)
    assert writer.Write()


def index(*entries: str) -> str:
    """Writes a PVD file whose data sets have these attributes."""
    sets = "".join(f"<DataSet {entry}/>" for entry in entries)
    return f'<VTKFile type="Collection"><Collection>{sets}</Collection></VTKFile>'


# Written by dynmesh


def test_vtk_reads_what_is_written(tmp_path: Path, mesh: Mesh) -> None:
    known = np.arange(4 * 49).reshape(4, 49) % 3 == 0
    sequence = moving(mesh, known=known, fps=25.0)
    dynmesh.write(tmp_path / "walk.pvd", sequence)
    entries = list(ElementTree.parse(tmp_path / "walk.pvd").getroot().iter("DataSet"))
    assert [entry.get("timestep") for entry in entries] == ["0.0", "0.04", "0.08", "0.12"]
    for i, entry in enumerate(entries):
        reader = vtkXMLPolyDataReader()
        reader.SetFileName(str(tmp_path / entry.get("file", "")))
        reader.Update()
        frame = reader.GetOutput()
        points, faces = parts(frame)
        np.testing.assert_array_equal(points, sequence.vertices[i])
        np.testing.assert_array_equal(faces, mesh.faces)
        values = point_data(frame, "known")
        assert values.dtype == np.uint8
        np.testing.assert_array_equal(values, known[i])


@pytest.mark.parametrize("fps", [24.0, 29.97, 1000 / 3, 60_000 / 1001, 0.1])
def test_frames_per_second_are_kept(tmp_path: Path, mesh: Mesh, fps: float) -> None:
    dynmesh.write(tmp_path / "a.pvd", moving(mesh, 20, fps=fps))
    again = dynmesh.open(tmp_path / "a.pvd").fps
    assert again == pytest.approx(fps, rel=1e-11)


@pytest.mark.parametrize(("fps", "time"), [(None, "1001.0"), (25.0, "40.04")])
def test_frames_keep_their_numbers(
    tmp_path: Path, mesh: Mesh, fps: float | None, time: str
) -> None:
    path = tmp_path / "walk.pvd"
    dynmesh.write(path, moving(mesh, 12))
    dynmesh.write(path, moving(mesh, 2, fps=fps, start=1001))
    assert names(tmp_path / "walk") == ["walk_1001.vtp", "walk_1002.vtp"]
    entry = ElementTree.parse(path).find("Collection/DataSet")
    assert entry is not None
    assert entry.get("timestep") == time
    dynmesh.write(path, moving(mesh, 1, fps=fps, start=1001))  # a single time determines nothing
    assert dynmesh.read(path).start == 0


def test_a_shorter_sequence_replaces_a_longer_one(tmp_path: Path, mesh: Mesh) -> None:
    path = tmp_path / "walk.pvd"
    dynmesh.write(path, moving(mesh, 12))
    (tmp_path / "walk" / "notes.txt").touch()
    existing = [str(file.relative_to(tmp_path)) for file in files.target_of(path).existing()]
    assert existing == ["walk.pvd", *(f"walk/walk_{i:04d}.vtp" for i in range(12))]
    dynmesh.write(path, moving(mesh, 2))
    assert names(tmp_path / "walk") == ["notes.txt", "walk_0000.vtp", "walk_0001.vtp"]
    with dynmesh.open(path) as reader:
        assert reader.n_frames == 2
        assert reader.fps is None
        assert [file.name for file in reader.files] == [
            "walk.pvd", "walk_0000.vtp", "walk_0001.vtp",
        ]  # fmt: skip


def test_a_failed_write_leaves_nothing(tmp_path: Path, mesh: Mesh) -> None:
    (tmp_path / "walk").touch()
    for name, message in (
        ("walk.pvd", "walk exists and is not a folder"),
        ("other", r"must end in \.pvd"),
    ):
        with pytest.raises(ValueError, match=message):
            dynmesh.write(tmp_path / name, moving(mesh), format="pvd")
    assert names(tmp_path) == ["walk"]
    dynmesh.write(tmp_path / "100%d.pvd", moving(mesh))  # no pattern
    assert dynmesh.read(tmp_path / "100%d.pvd").vertices.shape == (4, 49, 3)


# Written by other programs


@pytest.mark.parametrize(
    "adjust",
    [
        lambda writer: writer.SetDataModeToAscii(),
        lambda writer: writer.SetDataModeToBinary(),
        lambda writer: writer.SetDataModeToAppended(),
        lambda writer: writer.SetCompressorTypeToLZMA(),
        lambda writer: writer.SetCompressorTypeToLZ4(),
        lambda writer: writer.SetByteOrderToBigEndian(),
        lambda writer: writer.SetHeaderTypeToUInt64(),
    ],
)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_every_encoding_of_vtk_is_read(
    tmp_path: Path,
    mesh: Mesh,
    adjust: Adjust,
    dtype: Any,
    capfd: pytest.CaptureFixture[str],
) -> None:
    vertices = mesh.vertices.astype(dtype)
    vertices[3] = np.nan
    write_vtp(tmp_path / "a.vtp", as_polydata(vertices, mesh.faces), adjust)
    capfd.readouterr()
    (tmp_path / "a.pvd").write_text(index('file="a.vtp" timestep="7" part="0" group=""'))
    again = dynmesh.read(tmp_path / "a.pvd")
    assert capfd.readouterr() == ("", "")
    assert again.vertices.dtype == dtype
    if "Ascii" in str(adjust.__code__.co_names):  # VTK writes eleven digits
        np.testing.assert_allclose(again.vertices[0], vertices, rtol=1e-10)
    else:
        np.testing.assert_array_equal(again.vertices[0], vertices)
    np.testing.assert_array_equal(again.faces, mesh.faces)
    assert again.known is None


@pytest.mark.parametrize(
    ("times", "fps", "start"),
    [
        (["0", "1", "2"], None, 0),
        (["7", "8", "9"], None, 7),
        (["0", "0.0333333", "0.0666667"], 30, 0),
        (["10", "10.5", "11"], 2, 20),
        (["0.2", "0.3", "0.5"], 10, 2),
        (["1", "2", "7"], None, 1),
    ],
)
def test_steps_are_frames_per_second(
    tmp_path: Path, mesh: Mesh, times: list[str], fps: float | None, start: float
) -> None:
    entries = []
    for i, time in enumerate(times):
        write_vtp(tmp_path / f"{i}.vtp", as_polydata(mesh.vertices + i, mesh.faces))
        entries.append(f'file="{i}.vtp" timestep="{time}"')
    (tmp_path / "a.pvd").write_text(index(*reversed(entries)))
    again = dynmesh.read(tmp_path / "a.pvd")
    assert (again.fps is None) == (fps is None)
    assert fps is None or again.fps == pytest.approx(fps, rel=1e-5)
    assert again.start == start
    if again.times is not None:
        np.testing.assert_array_equal(again.times / (fps or 1), np.array(times, np.float64))
    np.testing.assert_array_equal(again.vertices[:, 0, 1], [0, 1, 2])  # in the order of time


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "damaged or not a PVD file: no element found"),
        ('<VTKFile type="PolyData"/>', "not a PVD file: its type is PolyData, not Collection"),
        (index(), "does not name a file"),
        (index('timestep="0"'), "lists the file '', but only .vtp"),
        (index('timestep="0" file="a.vtu"'), "lists the file 'a.vtu', but only .vtp"),
        (index('timestep="soon" file="a.vtp"'), "could not convert string to float: 'soon'"),
        (index('timestep="nan" file="a.vtp"'), "a.vtp: the time must be finite"),
        (
            index('timestep="1" part="0" file="a.vtp"', 'timestep="1" part="1" file="b.vtp"'),
            "lists a.vtp and b.vtp for the time 1; parts are not supported",
        ),
    ],
)
def test_damaged_indices_are_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "a.pvd"
    path.write_text(text)
    with pytest.raises(ValueError, match=message) as caught:
        dynmesh.open(path)
    assert str(caught.value).startswith(f"{path}: ")
    path.write_text(index('timestep="0" file="none.vtp"'))
    with pytest.raises(FileNotFoundError, match=r"none\.vtp"):
        dynmesh.open(path)


def with_array(name: str, values: Any) -> Adjust:
    return lambda mesh: mesh.GetPointData().AddArray(as_array(values, name))


def with_provenance(values: Any) -> Adjust:
    return lambda mesh: [with_array(name, values)(mesh) for name in ("generation", "age")]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda mesh: mesh.SetVerts(as_cells([[0]])), "holds points as cells, but only polygons"),
        (lambda mesh: mesh.SetLines(as_cells([[0, 1]])), "holds lines, but only polygons"),
        (lambda mesh: mesh.SetStrips(as_cells([[0, 1, 2, 3]])), "holds strips, but only polygons"),
        (lambda mesh: mesh.SetPolys(as_cells([[0, 1, 49]])), "face 0: refers to vertex 49"),
        (lambda mesh: mesh.SetPolys(as_cells([[0, 1]])), "face 0: has 2 corners, but needs 3"),
        (lambda mesh: mesh.SetPolys(vtkCellArray()), "only points, but the first frame needs"),
        (lambda mesh: mesh.Initialize(), "has no vertices"),
        (with_array("known", np.full(49, 2)), "known: must be 0 or 1, but vertex 0 has 2"),
        (with_array("known", np.ones(49)), "'known' must have one integer per vertex"),
        (with_provenance(np.full(49, 2**40)), "'generation' must have one integer per vertex"),
        (
            with_provenance(np.ones((49, 3), np.int32)),
            "'generation' must have one integer per vertex",
        ),
    ],
)
def test_other_meshes_are_refused(tmp_path: Path, mesh: Mesh, change: Adjust, message: str) -> None:
    polydata = as_polydata(mesh.vertices, mesh.faces)
    change(polydata)
    write_vtp(tmp_path / "a.vtp", polydata)
    (tmp_path / "a.pvd").write_text(index('timestep="0" file="a.vtp"'))
    with pytest.raises(ValueError, match=message) as caught:
        dynmesh.open(tmp_path / "a.pvd")
    assert str(tmp_path / "a.vtp") in str(caught.value)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda _: b"", "damaged or not a VTP file: Error parsing XML"),
        (lambda data: data[: len(data) * 2 // 3], "damaged or not a VTP file: "),
        (lambda data: data.replace(b"PolyData", b"ImageData"), "Cannot find PolyData element"),
        (lambda data: data.replace(b'Points="49"', b'Points="-5"'), "NumberOfPoints is -5"),
        (
            lambda data: data.replace(b'Points="49"', b'Points="4900000000000"'),
            "NumberOfPoints is 4900000000000",
        ),
        (lambda data: data.replace(b'Polys="72"', b'Polys="7200"'), "not long enough"),
    ],
)
def test_damaged_meshes_are_refused_in_silence(
    tmp_path: Path,
    mesh: Mesh,
    spoil: Callable[[bytes], bytes],
    message: str,
    capfd: pytest.CaptureFixture[str],
) -> None:
    dynmesh.write(tmp_path / "a.pvd", moving(mesh))
    file = tmp_path / "a" / "a_0002.vtp"
    data = file.read_bytes()
    spoilt = spoil(data)
    assert spoilt != data
    file.write_bytes(spoilt)
    window, verbosity = vtkOutputWindow.GetInstance(), vtkLogger.GetCurrentVerbosityCutoff()
    with pytest.raises(ValueError, match=message) as caught:
        dynmesh.read(tmp_path / "a.pvd")
    assert vtkOutputWindow.GetInstance() is window  # VTK's settings are unchanged
    assert vtkLogger.GetCurrentVerbosityCutoff() == verbosity
    assert str(file) in str(caught.value)
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")
