"""The help of the command line, and what a shell completes with the tab key."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from commands import dynmesh_command as run
from commands import dynmesh_process

import dynmesh
from dynmesh import files

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

    reading = {"--format", "--faces", "--prim", "--mask", "--missing", "--gaps"}
    for command in ("info", "degrade", "complete", "convert", "view", "picture"):
        assert reading <= options_of(command)


@pytest.mark.parametrize(
    ("line", "values"),
    [
        ("dynmesh comp", {"complete"}),
        ("dynmesh complete --method ", {"motion", "detail"}),
        ("dynmesh info --format ", set(files.formats)),
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
