"""The command `dynmesh`, as a user runs it."""

import subprocess
import sys
from pathlib import Path


def dynmesh_command(*arguments: str | Path, code: int = 0) -> subprocess.CompletedProcess[str]:
    """Runs it, and checks that it ends with this exit code and without a traceback."""
    command = [sys.executable, "-m", "dynmesh", *map(str, arguments)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == code, result.stderr
    assert "Traceback" not in result.stderr
    return result
