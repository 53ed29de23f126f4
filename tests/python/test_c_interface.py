"""The C interface, called from another language, and the C example, compared with the package."""

import ctypes
import re
import subprocess
from ctypes import POINTER, byref, c_char_p, c_double, c_int32, c_int64, c_void_p
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import REPOSITORY
from meshes import Mesh, join, sheet, turned
from numpy.typing import NDArray

import dynmesh

Array = NDArray[Any]


class View(ctypes.Structure):
    """A dynmesh_points or dynmesh_output, which have the same fields."""

    _fields_ = (
        ("data", c_void_p),
        ("count", c_int64),
        ("row_stride", c_int64),
        ("column_stride", c_int64),
        ("type", c_int32),
    )


class Mask(ctypes.Structure):
    """A dynmesh_mask."""

    _fields_ = (("data", c_void_p), ("count", c_int64), ("stride", c_int64))


class Settings(ctypes.Structure):
    """A dynmesh_settings."""

    _fields_ = (
        ("size", c_int64),
        ("method", c_int32),
        ("revisit", c_int32),
        ("extra_iterations", c_int32),
        ("disconnected", c_int32),
        ("noise", c_double),
        ("reject_outliers", c_int32),
        ("threads", c_int32),
        ("learn", c_int32),
        ("uncertainty", c_int32),
    )


class Report(ctypes.Structure):
    """A dynmesh_frame_report."""

    _fields_ = (
        ("known", c_int64),
        ("filled", c_int64),
        ("disconnected", c_int64),
        ("rejected", c_int64),
        ("iterations", c_int64),
        ("seconds", c_double),
        ("blend", c_double),
        ("prior_weight", c_double),
        ("prior_share", c_double),
        ("standard_error", c_double),
    )


def view(rows: Array) -> View:
    """Describes the rows of an array with any strides."""
    row, column = (stride // rows.itemsize for stride in rows.strides)
    return View(rows.ctypes.data, len(rows), row, column, 8 * rows.itemsize)


@pytest.fixture(scope="session")
def library(shared_library: Path) -> ctypes.CDLL:
    """The shared library with the result types of its functions."""
    library = ctypes.CDLL(str(shared_library))
    library.dynmesh_last_message.restype = c_char_p
    library.dynmesh_version.restype = c_char_p
    for name in ("dynmesh_generation", "dynmesh_age"):
        getattr(library, name).restype = POINTER(c_int32)
    return library


class Twins:
    """A completer and its counterpart in the C interface, which must agree in everything."""

    def __init__(
        self,
        library: ctypes.CDLL,
        mesh: Mesh,
        dtype: type[np.floating[Any]],
        extra_iterations: int = 0,
    ) -> None:
        self.library = library
        self.first_frame = mesh.vertices.astype(dtype)
        self.completer = dynmesh.Completer(
            mesh.faces,
            self.first_frame,
            method="motion" if extra_iterations else "detail",
            extra_iterations=extra_iterations,
        )
        settings = Settings()
        self.call("default_settings", byref(settings), c_int64(ctypes.sizeof(settings)))
        settings.method = 0 if extra_iterations else 1
        settings.extra_iterations = extra_iterations
        self.handle = c_void_p()
        faces = np.ascontiguousarray(mesh.faces, np.int32)
        frame = view(self.first_frame)
        self.call(
            "create",
            faces.ctypes.data_as(POINTER(c_int32)),
            c_int64(len(faces)),
            byref(frame),
            byref(settings),
            byref(self.handle),
        )

    def call(self, name: str, *arguments: Any) -> None:
        status = getattr(self.library, f"dynmesh_{name}")(*arguments)
        assert status == 0, self.library.dynmesh_last_message()

    def check(self, expected: Array, name: str, *arguments: Any) -> None:
        completed = np.empty_like(expected)
        report = Report()
        self.call(name, self.handle, *arguments, byref(view(completed)), byref(report))
        assert completed.tobytes() == expected.tobytes()
        theirs = self.completer.report
        for field in ("known", "filled", "disconnected", "rejected", "iterations"):
            assert getattr(report, field) == getattr(theirs, field)
        k = len(expected)
        for field in ("generation", "age"):
            ours = getattr(self.library, f"dynmesh_{field}")(self.handle)
            assert np.array_equal(np.ctypeslib.as_array(ours, (k,)), getattr(self.completer, field))

    def step(self, number: int) -> None:
        """Completes frames by mask, by NaN, sparsely, or not at all, in turn."""
        rng = np.random.default_rng(number)
        points = turned(self.first_frame, 0.05 * number).astype(self.first_frame.dtype)
        known = rng.random(len(points)) < rng.uniform(0.05, 0.9)
        if number % 4 == 0:
            planar = np.asfortranarray(points)
            mask = known.view(np.uint8)
            given = Mask(mask.ctypes.data, len(mask), 1)
            self.check(
                self.completer.push(points, known), "push", byref(view(planar)), byref(given)
            )
        elif number % 4 == 1:
            points[~known] = np.nan
            self.check(self.completer.push(points), "push", byref(view(points)), None)
        elif number % 4 == 2:
            indices = rng.permutation(np.flatnonzero(known)).astype(np.int32)
            observed = points[indices]
            self.check(
                self.completer.push_sparse(indices, observed),
                "push_sparse",
                indices.ctypes.data_as(POINTER(c_int32)),
                c_int64(len(indices)),
                byref(view(observed)),
            )
        else:
            self.check(self.completer.skip(), "skip")

    def state(self) -> bytes:
        size = c_int64()
        self.call("state_size", self.handle, byref(size))
        buffer = ctypes.create_string_buffer(size.value)
        self.call("state", self.handle, buffer, size)
        return buffer.raw

    def destroy(self) -> None:
        self.library.dynmesh_destroy(self.handle)


@pytest.mark.parametrize(("dtype", "extra_iterations"), [(np.float32, 0), (np.float64, 3)])
def test_c_completes_as_python_does(
    library: ctypes.CDLL, dtype: type[np.floating[Any]], extra_iterations: int
) -> None:
    mesh = join(sheet(15), sheet(4, 20.0))
    twins, others = (Twins(library, mesh, dtype, extra_iterations) for _ in range(2))
    for number in range(1, 20):
        twins.step(number)
    # Each continues from the state of the other.
    ours, theirs = twins.state(), twins.completer.state()
    assert ours == theirs
    others.completer.restore(ours)
    others.call("restore", others.handle, c_char_p(theirs), c_int64(len(theirs)))
    for number in range(20, 28):
        twins.step(number)
        others.step(number)
    assert twins.completer.skip().tobytes() == others.completer.skip().tobytes()
    twins.destroy()
    others.destroy()


def test_default_settings_and_version(library: ctypes.CDLL) -> None:
    settings = Settings()
    size = ctypes.sizeof(settings)
    assert library.dynmesh_default_settings(byref(settings), c_int64(size)) == 0
    assert settings.size == size
    assert library.dynmesh_version().decode() == dynmesh.__version__
    header = (REPOSITORY / "cpp" / "include" / "dynmesh" / "dynmesh.h").read_text()
    constants = {"DYNMESH_METHOD_DETAIL": "1", "DYNMESH_DISCONNECTED_FOLLOW": "1"}
    documented = [constants.get(x, x) for x in re.findall(r"/// Default: (\w+)", header)]
    actual = [getattr(settings, name) for name, _ in Settings._fields_[1:]]
    np.testing.assert_array_equal(actual, [float(x) for x in documented])


class TestExample:
    """The C example complete_stream against dynmesh-complete."""

    @pytest.fixture
    def template(self, tmp_path: Path) -> Path:
        """A sheet of 49 vertices."""
        mesh = sheet(7)
        path = tmp_path / "sheet.obj"
        rows = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in mesh.vertices]
        rows += [f"f {a} {b} {c}" for a, b, c in mesh.faces + 1]
        path.write_text("\n".join(rows) + "\n")
        return path

    @pytest.fixture
    def frames(self, rng: np.random.Generator) -> NDArray[np.float32]:
        """Thirty partial frames of it."""
        vertices = sheet(7).vertices
        frames = np.stack([turned(vertices, 0.04 * i) for i in range(1, 31)]).astype(np.float32)
        frames[rng.random(frames.shape[:2]) < 0.7] = np.nan
        return frames

    def run(
        self, programs: Path, template: Path, data: bytes, code: int = 0
    ) -> subprocess.CompletedProcess[bytes]:
        program = programs / "examples" / "c" / "complete_stream"
        result = subprocess.run(
            [program, template], input=data, capture_output=True, check=False, timeout=60
        )
        assert result.returncode == code, result.stderr
        return result

    def test_same_bytes_as_the_program(
        self, programs: Path, template: Path, frames: NDArray[np.float32]
    ) -> None:
        command: list[str | Path] = [programs / "dynmesh-complete", "--template", template]
        command += ["--input", "-", "--output", "-"]
        expected = subprocess.run(command, input=frames.tobytes(), capture_output=True, check=True)
        result = self.run(programs, template, frames.tobytes())
        assert result.stdout == expected.stdout
        assert result.stderr.startswith(b"30 frames completed; ")

    def test_a_bad_frame_does_not_end_the_show(
        self, programs: Path, template: Path, frames: NDArray[np.float32]
    ) -> None:
        frames[3, 5] = 1e30
        result = self.run(programs, template, frames.tobytes())
        assert result.stderr.startswith(b"frame 4: points: row 5 is at (1.00000002e+30, ")
        shown = np.frombuffer(result.stdout, np.float32).reshape(frames.shape)
        completer = dynmesh.Completer(sheet(7).faces, sheet(7).vertices.astype(np.float32))
        for number, frame in enumerate(frames):
            expected = completer.skip() if number == 3 else completer.push(frame)
            assert shown[number].tobytes() == expected.tobytes()

    def test_errors(self, programs: Path, template: Path, frames: NDArray[np.float32]) -> None:
        cut = self.run(programs, template, frames.tobytes()[:-4], code=1)
        assert b"standard input ends within a frame" in cut.stderr
        assert len(cut.stdout) == frames[:-1].nbytes
        missing = self.run(programs, template.with_name("none.obj"), b"", code=1)
        assert missing.stderr.endswith(b"none.obj: cannot be opened\n")
        alone = subprocess.run(
            [programs / "examples" / "c" / "complete_stream"], capture_output=True, check=False
        )
        assert alone.returncode == 2
