"""The command `dynmesh`, as a user runs it."""

import contextlib
import io
import os
import subprocess
import sys
from pathlib import Path
from unittest import mock

from dynmesh import cli

Result = subprocess.CompletedProcess[str]


def dynmesh_command(*arguments: str | Path, code: int = 0) -> Result:
    """Runs it, and checks that it ends with this exit code."""
    result = run_here(*arguments)
    assert result.returncode == code, result.stderr
    return result


def run_here(*arguments: str | Path) -> Result:
    """Runs it in this process, which saves the start of another.

    The terminal is so wide that no message is broken, however long the paths in it are.
    """
    command = ["dynmesh", *map(str, arguments)]
    output, error = io.StringIO(), io.StringIO()
    with (
        mock.patch.object(sys, "argv", command),
        mock.patch.dict(os.environ, {"COLUMNS": "1000", "TERM": "dumb"}),
        contextlib.redirect_stdout(output),
        contextlib.redirect_stderr(error),
    ):
        ended = 0
        try:
            cli.main()
        except SystemExit as how:
            ended = int(how.code or 0)
    return Result(command, ended, output.getvalue(), error.getvalue())


def dynmesh_process(*arguments: str | Path, code: int = 0) -> Result:
    """Runs it in a process of its own, and checks that it ends so and without a traceback."""
    command = [sys.executable, "-m", "dynmesh", *map(str, arguments)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == code, result.stderr
    assert "Traceback" not in result.stderr
    return result
