"""PVD: ParaView's index of times, beside a folder with one VTP file per frame.

`walk.pvd` lists `walk/walk_0000.vtp` and so on with the time of each. A VTP file has the points,
the polygons and, if the sequence has them, the point data `known`, `generation`, `age` and
`standard_error`. The
field data `dynmesh` contains lines that state the up axis and the length of a unit.

Times are in seconds, or frame numbers if the frames per second are unknown. Therefore steps other
than 1 are read as frames per second, and the median step if they are uneven. A single time
determines nothing.
"""

import contextlib
import errno
import math
import os
import re
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from .._errors import InputError
from .._extras import require
from ..frames.attributes import ATTRIBUTES, Attribute, as_mask, with_all_needed
from ..frames.frame import Frame
from ..frames.times import Timing, frame_number, frame_seconds, rate_of, uneven
from ..polygons import Polygons, as_polygons
from .comments import Metadata, comments_of, metadata_in
from .format import Format, Gaps, Template
from .frame_files import FramesReader, FramesWriter
from .frame_names import FrameNames, single

out_of_disk_space = 20007  # vtkErrorCode::OutOfDiskSpaceError

_one_at_a_time = threading.Lock()  # VTK's error window is global


class PvdReader(FramesReader):
    """A sequence in VTP files that a PVD file lists."""

    def __init__(self, path: Path, template: Template | None, gaps: Gaps) -> None:
        """Reads the list and the first of its files."""
        self._index = path
        times, listed = _read_index(path)
        files = [file if file.exists() else None for file in listed]
        if gaps == "refuse" and None in files:
            raise FileNotFoundError(
                errno.ENOENT,
                "no such file; --gaps lost completes its frame without it (in Python, gaps='lost')",
                str(listed[files.index(None)]),
            )
        super().__init__(path, files, _timing(times), template)

    @property
    def files(self) -> list[Path]:
        """The files that are read."""
        return [self._index, *super().files]

    def _load(self, file: Path) -> tuple[Frame, Polygons, Metadata]:
        mesh = _read_mesh(file)
        for cells, what in (("Verts", "points as cells"), ("Lines", "lines"), ("Strips", "strips")):
            if getattr(mesh, f"GetNumberOf{cells}")():
                raise ValueError(f"holds {what}, but only polygons can be read")
        if mesh.GetPoints() is None:
            raise ValueError("has no vertices")
        points = _as_numpy(mesh.GetPoints().GetData())
        if points.dtype.kind != "f":
            raise ValueError(f"its positions must be float, not {points.dtype}")
        read = {name: _point_data(mesh, row) for name, row in ATTRIBUTES.items()}
        found = {name: values for name, values in read.items() if values is not None}
        attributes: dict[str, Any] = {name: found[name] for name in with_all_needed(found)}
        polygons = mesh.GetPolys()
        sizes = np.diff(_as_numpy(polygons.GetOffsetsArray()))
        corners = _as_numpy(polygons.GetConnectivityArray())
        frame = Frame(points, **attributes)
        return frame, Polygons(sizes, corners), metadata_in(_notes(mesh))


def _read_index(path: Path) -> tuple[list[float], list[Path]]:
    """Returns the times, ascending, and the file of each."""
    try:
        root = ElementTree.parse(path).getroot()
    except (ElementTree.ParseError, LookupError) as error:  # LookupError: unknown encoding
        raise ValueError(f"is damaged or not a PVD file: {error}") from error
    if root.get("type") != "Collection":
        raise ValueError(f"is not a PVD file: its type is {root.get('type')}, not Collection")
    by_time: dict[float, str] = {}
    for entry in root.iterfind("Collection/DataSet"):
        name, time = entry.get("file", ""), float(entry.get("timestep", "0"))
        if not name.lower().endswith(".vtp"):
            raise ValueError(f"lists the file '{name}', but only .vtp files can be read")
        if not math.isfinite(time):
            raise InputError(f"the time must be finite, not {time}", argument=name)
        if time in by_time:
            raise ValueError(
                f"lists {by_time[time]} and {name} for the time {time:g}; parts are not supported"
            )
        by_time[time] = name
    times = sorted(by_time)
    return times, [path.parent / by_time[time] for time in times]


def _timing(times: list[float]) -> Timing:
    if len(times) < 2:
        return Timing(None, 0)
    step = (times[-1] - times[0]) / (len(times) - 1)
    if not np.allclose(np.diff(times), step, rtol=1e-3, atol=0):
        return uneven(times)
    fps = rate_of(step)
    return Timing(fps, frame_number(times[0], fps))


def _read_mesh(file: Path) -> Any:
    """A vtkPolyData."""
    _check_counts(file)
    reader = require("vtkmodules.vtkIOXML", extra="view").vtkXMLPolyDataReader()
    reader.SetFileName(str(file))
    with _listening() as complaints:
        reader.Update()
    if complaints:
        raise ValueError(f"is damaged or not a VTP file: {complaints[0]}")
    return reader.GetOutput()


def _check_counts(file: Path) -> None:
    """Refuses counts for which VTK would end the process."""
    content = file.read_bytes()
    for name, count in re.findall(
        rb"""(NumberOf\w+)=["']\s*(.*?)\s*["']""", content.partition(b"<AppendedData")[0]
    ):
        # Even compressed, a vertex takes at least a hundredth of a byte.
        if not count.isdigit() or int(count) > 1000 * len(content):
            raise ValueError(f"is damaged: {name.decode()} is {count.decode('latin-1')}")


@contextlib.contextmanager
def _listening() -> Iterator[list[str]]:
    """Yields a list that holds VTK's errors and warnings afterwards; none is printed."""
    core = require("vtkmodules.vtkCommonCore", extra="view")
    complaints: list[str] = []
    with _one_at_a_time:
        window, usual = core.vtkStringOutputWindow(), core.vtkOutputWindow.GetInstance()
        verbosity = core.vtkLogger.GetCurrentVerbosityCutoff()
        core.vtkOutputWindow.SetInstance(window)
        core.vtkLogger.SetStderrVerbosity(core.vtkLogger.VERBOSITY_OFF)
        try:
            yield complaints
        finally:
            core.vtkLogger.SetStderrVerbosity(verbosity)
            core.vtkOutputWindow.SetInstance(usual)
    for text in re.split(r"(?m)^.*: In .*, line [0-9]+\n", window.GetOutput()):
        what = re.sub(r"^\w+ \(0x[0-9a-f]+\): ", "", text.strip().partition("\n")[0])
        if what and "InformationKey" not in what:  # VTK cannot read the range of NaN that it writes
            complaints.append(what)


def _as_numpy(array: Any) -> NDArray[Any]:
    return np.asarray(require("vtkmodules.util.numpy_support", extra="view").vtk_to_numpy(array))


def _as_vtk(array: NDArray[Any], name: str | None = None) -> Any:
    support = require("vtkmodules.util.numpy_support", extra="view")
    result = support.numpy_to_vtk(np.ascontiguousarray(array), deep=True)
    if name is not None:
        result.SetName(name)
    return result


def _point_data(mesh: Any, row: Attribute) -> NDArray[Any] | None:
    name = row.name
    array = mesh.GetPointData().GetArray(name)
    if array is None:
        return None
    values = _as_numpy(array)
    kinds, what = ("f", "float") if row.dtype.kind == "f" else ("iu", "integer")
    fits = values.shape == (mesh.GetNumberOfPoints(),) and values.dtype.kind in kinds
    if not fits or (kinds == "iu" and not np.array_equal(values, values.astype(np.int32))):
        raise ValueError(f"its point data '{name}' must have one {what} per vertex")
    if row.dtype.kind == "b":
        return as_mask(values)
    return values if kinds == "f" else values.astype(row.dtype)


def _notes(mesh: Any) -> list[str]:
    """Returns the field data that is text."""
    array = mesh.GetFieldData().GetAbstractArray("dynmesh")
    if array is None or not array.IsA("vtkStringArray"):
        return []
    return [array.GetValue(i) for i in range(array.GetNumberOfValues())]


class PvdWriter(FramesWriter):
    """A PVD file and a folder of VTP files that are being written, binary and uncompressed."""

    suffix = ".pvd"

    @classmethod
    def _names_of(cls, path: Path) -> FrameNames:
        if path.suffix.lower() != cls.suffix:
            raise ValueError("must end in .pvd; the rest of the name becomes a folder beside it")
        return FrameNames(path.with_suffix(""), f"{path.stem.replace('%', '_')}_%04d.vtp")

    @classmethod
    def names(cls, path: Path) -> list[FrameNames]:
        """Returns the names of the index and of the frames."""
        return [single(path), *super().names(path)]

    def _begin(self, kept: int) -> None:
        super()._begin(kept)
        sizes, corners = as_polygons(self.header.faces, self.header.polygons)
        offsets = np.concatenate([[0], np.cumsum(sizes)])
        self._model = require("vtkmodules.vtkCommonDataModel", extra="view")
        self._notes = require("vtkmodules.vtkCommonCore", extra="view").vtkStringArray()
        self._notes.SetName("dynmesh")
        for line in comments_of(self.header):
            self._notes.InsertNextValue(line)
        self._polygons = self._model.vtkCellArray()
        self._polygons.SetData(_as_vtk(offsets.astype(np.int32)), _as_vtk(corners.astype(np.int32)))

    def _save(self, file: Path, frame: Frame) -> None:
        points = require("vtkmodules.vtkCommonCore", extra="view").vtkPoints()
        points.SetData(_as_vtk(frame.points))
        mesh = self._model.vtkPolyData()
        mesh.SetPoints(points)
        mesh.SetPolys(self._polygons)
        for name, values in frame.attributes().items():
            dtype = ATTRIBUTES[name].dtype
            stored = values.astype(np.uint8 if dtype.kind == "b" else dtype)
            mesh.GetPointData().AddArray(_as_vtk(stored, name))
        if self._notes.GetNumberOfValues():
            mesh.GetFieldData().AddArray(self._notes)
        writer = require("vtkmodules.vtkIOXML", extra="view").vtkXMLPolyDataWriter()
        writer.SetInputData(mesh)
        writer.SetFileName(str(file))
        writer.SetDataModeToAppended()
        writer.EncodeAppendedDataOff()
        writer.SetCompressorTypeToNone()
        with _listening():
            written = writer.Write()
        if not written:
            code = writer.GetErrorCode()  # an error number of the system, with one exception
            code = errno.ENOSPC if code == out_of_disk_space else code
            raise OSError(code, os.strerror(code), str(file))

    def _finish(self) -> None:
        root = ElementTree.Element(
            "VTKFile", type="Collection", version="0.1", byte_order="LittleEndian"
        )
        collection = ElementTree.SubElement(root, "Collection")
        for number, time in zip(self._numbers, frame_seconds(self.header).tolist(), strict=True):
            ElementTree.SubElement(
                collection,
                "DataSet",
                timestep=str(time),
                part="0",
                file=f"{self._names.folder.name}/{self._names.name(number)}",
            )
        ElementTree.indent(root)
        index = ElementTree.ElementTree(root)
        index.write(self.folder / self.path.name, encoding="utf-8", xml_declaration=True)

    def _destinations(self) -> dict[str, Path]:
        return {**super()._destinations(), self.path.name: self.path}  # the index is moved last


pvd = Format(
    "pvd",
    (".pvd",),
    "ParaView's index of a folder of VTP files",
    PvdReader,
    PvdWriter,
    library=("vtkmodules.vtkIOXML", "view"),
    per_frame=True,
)
