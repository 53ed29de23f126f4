"""The help of the command line, and what a shell completes with the tab key."""

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import get_args

import pytest
from commands import dynmesh_command as run
from commands import dynmesh_process

import dynmesh
from dynmesh import files
from dynmesh.draw.quantities import Colour

COMMANDS = (
    *("info", "synth", "degrade", "complete", "track", "evaluate"),
    *("view", "picture", "convert", "batch", "reproduce"),
)


def test_help_and_version() -> None:
    assert dynmesh_process("--version").stdout.strip() == f"dynmesh {dynmesh.__version__}"
    shown = run("--help").stdout
    assert run("-h").stdout == shown
    assert all(name in shown for name in (*files.formats, *COMMANDS))


@pytest.mark.parametrize("command", COMMANDS)
def test_the_help_of_a_command_fits_the_terminal(command: str) -> None:
    assert run(command, "-h").stdout == run(command, "--help").stdout
    for width in (80, 120):
        lines = run(command, "-h", columns=width).stdout.splitlines()
        assert max(map(len, lines)) <= width
        options = [line for line in lines if re.match(r"│ [* ]*--", line)]
        assert options
        for line in options:
            assert not re.search(r"<(bool|int|float|str|list|path)", line)
            what_it_does = re.split(r"\s{2,}", line.rstrip(" │"))[-1]
            assert line.index(what_it_does) <= width - 30, line


def test_every_command_that_reads_has_the_same_options_of_reading() -> None:
    def options_of(command: str) -> set[str]:
        return set(re.findall(r"^│[* ]+(--\w+)", run(command, "-h").stdout, flags=re.MULTILINE))

    reading = {"--format", "--faces", "--prim", "--mask", "--missing", "--gaps"}
    for command in ("info", "degrade", "complete", "convert", "view", "picture"):
        assert reading <= options_of(command)


@pytest.mark.parametrize(
    ("line", "values"),
    [
        ("dynmesh comp", {"complete"}),
        ("dynmesh complete --method ", {"motion", "detail"}),
        ("dynmesh info --format ", set(files.formats)),
        ("dynmesh convert --output-format h", {"hdf5"}),
        (
            "dynmesh view --colour ",
            {"error", "generation", "age", "standard_error", "known", "plain"},
        ),
    ],
)
def test_the_shell_completes(line: str, values: set[str]) -> None:
    asked = {"COMP_WORDS": line, "COMP_CWORD": str(line.count(" "))}
    result = subprocess.run(
        [Path(sys.executable).parent / "dynmesh"],
        env=os.environ | asked | {"_DYNMESH_COMPLETE": "complete_bash"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert set(result.stdout.split()) == values, result.stderr


@pytest.mark.parametrize("command", ["view", "picture"])
def test_the_help_names_every_colour(command: str) -> None:
    shown = " ".join(run(command, "-h").stdout.replace("│", " ").split())
    (names,) = re.findall(r"--colour,--color NAME ([\w, ]+)\. \[", shown)
    assert set(re.split(r", | or ", names)) == set(get_args(Colour))
