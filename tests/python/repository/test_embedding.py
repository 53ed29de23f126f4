"""The code in docs/embedding.md compiles and runs, and its statements hold."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import REPOSITORY
from documents import PROGRAMS, blocks, build, run

import dynmesh

pytestmark = pytest.mark.slow

DOCUMENT = (REPOSITORY / "docs" / "embedding.md").read_text()


@pytest.fixture
def library_folder(shared_library: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of the shared library, where programs look for it."""
    monkeypatch.setenv("LD_LIBRARY_PATH", str(shared_library.parent))
    return shared_library.parent


def install(built: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Installs the build to $P, the prefix in the document."""
    monkeypatch.setenv("P", str(tmp_path / "installed"))
    run("cmake", "--install", built, "--prefix", tmp_path / "installed", cwd=tmp_path)


def copy_project(folder: Path) -> None:
    """Copies the project of the document."""
    project = blocks("cmake", DOCUMENT)[0]
    (folder / "CMakeLists.txt").write_text(project)
    for name in re.findall(r"\w+\.c(?:pp)?\b", project):
        shutil.copy(PROGRAMS / name, folder)


@pytest.fixture
def strict_compilers(monkeypatch: pytest.MonkeyPatch) -> None:
    """CMake treats warnings as errors."""
    strict = "-Wall -Wextra -Wpedantic -Wconversion -Werror"
    monkeypatch.setenv("CFLAGS", f"-std=c11 {strict}")
    monkeypatch.setenv("CXXFLAGS", strict)


@pytest.mark.usefixtures("strict_compilers")
def test_cpp_and_c(tmp_path: Path, programs: Path) -> None:
    copy_project(tmp_path)
    built = build(tmp_path, programs)
    for name in ("in_place", "in_place_c"):
        assert run(built / name, cwd=tmp_path) == "3 filled in; vertex 0 is at height 5\n"
    assert run(built / "packets", cwd=tmp_path).splitlines() == [
        "frame 4 refused: indices: position 0 holds 9, but the mesh has 4 vertices, counted from 0",
        "vertex 3 is at height 3, disconnected for 4 frames",
    ]


def built_alone(program: Path, programs: Path) -> Path:
    """Builds a program as the document does those of its project."""
    before, _, _ = blocks("cmake", DOCUMENT)[0].partition("add_executable")
    (program.parent / "CMakeLists.txt").write_text(
        f"{before}add_executable(alone {program.name})\n"
        "target_link_libraries(alone PRIVATE dynmesh::dynmesh)\n"
    )
    return build(program.parent, programs) / "alone"


@pytest.mark.usefixtures("strict_compilers")
def test_the_program_of_the_readme(tmp_path: Path, programs: Path) -> None:
    (text,) = blocks("cpp")
    (tmp_path / "readme.cpp").write_text(text)
    body = dynmesh.synth.ocean(2, grid=10)
    dynmesh.write(tmp_path / "body.obj", body[:1])
    frame = body.vertices[1].astype(np.float32)
    frame[:40] = np.nan
    command = [built_alone(tmp_path / "readme.cpp", programs)]
    given = frame.tobytes()
    shown = subprocess.run(command, cwd=tmp_path, input=given, check=True, capture_output=True)
    assert shown.stdout.startswith(b"40 filled in\n")


@pytest.mark.usefixtures("strict_compilers")
@pytest.mark.parametrize(("number", "program"), [(0, "track_points.cpp"), (1, "track_image.c")])
def test_the_trackers(number: int, program: str, tmp_path: Path, programs: Path) -> None:
    shutil.copy(PROGRAMS / program, tmp_path)
    shown = run(built_alone(tmp_path / program, programs), cwd=tmp_path)
    assert shown == blocks("text", DOCUMENT)[number]


@pytest.mark.parametrize("kind", ["shared", "static"])
def test_a_compiler_and_pkg_config(
    kind: str,
    tmp_path: Path,
    programs: Path,
    shared_library: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    shutil.copy(PROGRAMS / "in_place.c", tmp_path)
    shared, static = blocks("bash", DOCUMENT)[:2]
    install(shared_library.parent if kind == "shared" else programs, tmp_path, monkeypatch)
    run("bash", "-euc", shared if kind == "shared" else static, cwd=tmp_path)
    shown = run(tmp_path / "in_place", cwd=tmp_path)
    assert shown == "3 filled in; vertex 0 is at height 5\n"


def test_the_frame_budget(
    tmp_path: Path, shared_library: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install(shared_library.parent, tmp_path, monkeypatch)
    (tmp_path / "examples").symlink_to(REPOSITORY / "examples")
    copy_project(tmp_path)
    run("bash", "-euc", 'cmake -S . -B build -DCMAKE_PREFIX_PATH="$P"', cwd=tmp_path)
    run("cmake", "--build", "build", cwd=tmp_path)
    record, compare, measure = blocks("bash", DOCUMENT)[2:]
    record = record.replace("walker.npz\n", "walker.npz --frames 20\n", 1)
    run("bash", "-euc", record, cwd=tmp_path)
    shown = run("bash", "-euc", compare, cwd=tmp_path)
    assert re.findall(r"^(\w+): (\d+) frames, longest ", shown, flags=re.MULTILINE) == [
        ("motion", "19"),
        ("detail", "19"),
    ]
    shown = run("bash", "-euc", measure, cwd=tmp_path)
    completed, dropped = map(int, re.findall(r"(\d+) frames completed, (\d+) dropped", shown)[0])
    assert completed + dropped == 19  # all but frame 0
    partial, again, detail = (
        np.fromfile(tmp_path / f"{name}.raw", "<f4") for name in ("partial", "again", "detail")
    )
    assert np.isnan(partial).mean() > 0.2
    assert len(again) == len(detail) == len(partial)
    assert np.isfinite(again).all()
    assert np.isfinite(detail).all()
    known = np.isfinite(partial)
    assert (again[known] == partial[known]).all()


@pytest.mark.usefixtures("library_folder")
def test_python(tmp_path: Path) -> None:
    shown = run(sys.executable, PROGRAMS / "complete.py", cwd=tmp_path)
    assert shown == "vertex 0 is at height 5\nout: is a null pointer\n"


def test_rust(tmp_path: Path, library_folder: Path) -> None:
    if shutil.which("rustc") is None:
        pytest.skip("rustc is not here")
    compiler = ("rustc", "--edition", "2021", "-D", "warnings", "-L", library_folder)
    run(*compiler, PROGRAMS / "complete.rs", cwd=tmp_path)
    assert run(tmp_path / "complete", cwd=tmp_path) == "3 filled in; vertex 0 is at height 5.000\n"
