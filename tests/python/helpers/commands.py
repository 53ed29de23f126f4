"""Runs the command `dynmesh` as a user does."""

import contextlib
import io
import os
import subprocess
import sys
from pathlib import Path
from unittest import mock

import pytest

from dynmesh import cli

Result = subprocess.CompletedProcess[str]


def dynmesh_command(*arguments: str | Path, code: int = 0, columns: int = 1000) -> Result:
    """Runs the command and checks its exit code."""
    result = run_here(*arguments, columns=columns)
    assert result.returncode == code, result.stderr
    return result


def run_here(*arguments: str | Path, columns: int = 1000) -> Result:
    """Runs the command in this process, which is faster.

    The terminal is so wide that no message is wrapped, even with long paths, unless `columns` is
    given.
    """
    command = ["dynmesh", *map(str, arguments)]
    output, error = io.StringIO(), io.StringIO()
    with (
        mock.patch.object(sys, "argv", command),
        mock.patch.dict(os.environ, {"COLUMNS": str(columns), "TERM": "dumb"}),
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
    """Runs the command in a separate process; checks the exit code and for tracebacks."""
    command = [sys.executable, "-m", "dynmesh", *map(str, arguments)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == code, result.stderr
    assert "Traceback" not in result.stderr
    return result


def hide(monkeypatch: pytest.MonkeyPatch, module: str) -> None:
    """Makes a module impossible to import."""
    for name in [*sys.modules]:
        if name == module or name.startswith(f"{module}."):
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, module, None)
