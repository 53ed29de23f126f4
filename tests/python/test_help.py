"""The help and the version of the command line, and what a shell completes with the tab key."""

import inspect
import re
import subprocess
from importlib import metadata
from pathlib import Path

import docstring_parser
import pytest
from commands import dynmesh_command as run
from commands import dynmesh_process
from conftest import REPOSITORY

import dynmesh
from dynmesh import cli, files

COMMANDS = (
    *("info", "synth", "degrade", "complete", "track", "evaluate"),
    *("view", "picture", "convert", "batch"),
)


def test_help_and_version() -> None:
    assert dynmesh_process("--version").stdout.strip() == f"dynmesh {dynmesh.__version__}"
    shown = run("--help").stdout
    assert run("-h").stdout == shown
    assert all(name in shown for name in (*files.formats, *COMMANDS))


def test_every_command_that_reads_has_the_same_options_of_reading() -> None:
    def options_of(command: str) -> set[str]:
        return set(re.findall(r"^│[* ]+(--\w+)", run(command, "-h").stdout, flags=re.MULTILINE))

    reading = {"--faces", "--prim", "--mask", "--missing", "--gaps"}
    for command in ("info", "degrade", "complete", "convert", "view", "picture"):
        assert reading <= options_of(command)


@pytest.mark.parametrize("command", ["complete", "track"])
def test_the_help_and_the_docstring_say_the_same(command: str) -> None:
    function = cli.function_of(command)
    shown = run(command, "--help", columns=100).stdout
    words = re.sub(r"[\s│]+", " ", shown)
    for parameter in docstring_parser.parse(inspect.getdoc(function) or "").params:
        if parameter.arg_name not in ("source", "progress"):
            said = re.sub(r"\s+", " ", (parameter.description or "").replace("`", ""))
            assert said in words, parameter.arg_name


def test_the_shell_completes(tmp_path: Path) -> None:
    script = cli.app.generate_completion(shell="bash")
    assert {"complete", "--method", "motion"} <= set(re.findall(r"[\w-]+", script))
    (tmp_path / "complete.bash").write_text(script)
    subprocess.run(["bash", "-n", tmp_path / "complete.bash"], check=True)


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
