"""The version is written once, in CMakeLists.txt, and is the same everywhere."""

import re
import subprocess
from importlib import metadata
from pathlib import Path

import pytest
from conftest import REPOSITORY

import dynmesh


def found(pattern: str, path: Path) -> str:
    """Returns the only group of `pattern` in a file."""
    (match,) = re.findall(pattern, path.read_text(), flags=re.MULTILINE)
    return str(match)


@pytest.fixture
def version() -> str:
    return found(r"project\(dynmesh VERSION (\S+)", REPOSITORY / "CMakeLists.txt")


def test_python_package_and_citation(version: str) -> None:
    assert dynmesh.__version__ == version
    assert metadata.version("dynmesh") == version
    # The citation cannot be generated, so its version is changed by hand.
    assert found(r"^version: (\S+)$", REPOSITORY / "CITATION.cff") == version


def test_cpp_header_and_program(version: str, programs: Path) -> None:
    header = programs / "include" / "dynmesh" / "version.hpp"
    assert found(r'DYNMESH_VERSION "(\S+)"', header) == version
    parts = [found(rf"DYNMESH_VERSION_{x} (\d+)", header) for x in ("MAJOR", "MINOR", "PATCH")]
    assert ".".join(parts) == version
    shown = subprocess.run(
        [programs / "dynmesh-complete", "--version"], capture_output=True, text=True, check=True
    )
    assert shown.stdout == f"dynmesh-complete {version}\n"
