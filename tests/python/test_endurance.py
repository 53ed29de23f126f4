"""Short runs of script/soak and script/kill-test, and checks that they find faults."""

import subprocess
import sys

import pytest
from conftest import REPOSITORY

ENDURANCE = REPOSITORY / "tests" / "endurance"


def run(script: str, *arguments: str) -> str:
    command = [sys.executable, str(ENDURANCE / script), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
def test_a_short_soak() -> None:
    shown = run("soak.py", "--frames", "1000")
    assert "1000 frames in" in shown
    assert shown.endswith("\n0 violations\n")


def test_ended_commands_lose_nothing() -> None:
    assert run("kills.py", "--moments", "17").endswith(" ended, 0 corruptions\n")
