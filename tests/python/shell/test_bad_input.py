"""Every case of bad input is refused, what is wrong is named, and nothing changes."""

from pathlib import Path

import pytest
from bad_input import CASES, commands, files
from bad_input.case import Case, Printed, World


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> World:
    made = World(tmp_path_factory.mktemp("world"))
    files.prepare(made)
    commands.prepare(made)
    return made


def check(case: Case, world: World, capfd: pytest.CaptureFixture[str]) -> None:
    """Checks that a call is refused as expected, prints nothing and changes nothing."""
    before = world.snapshot()
    capfd.readouterr()
    error = case.answer(world)
    assert capfd.readouterr() == ("", "")
    assert isinstance(error, case.error), repr(error)
    assert isinstance(error, (ValueError, TypeError, IndexError, OSError, Printed)), repr(error)
    for name in case.names:
        assert name in str(error)
    assert world.snapshot() == before


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case.call}: {case.given}")
def test_bad_input_is_refused_and_changes_nothing(
    case: Case, world: World, capfd: pytest.CaptureFixture[str]
) -> None:
    check(case, world, capfd)


def test_the_compiled_program_reports_it_too(
    programs: Path, world: World, capfd: pytest.CaptureFixture[str]
) -> None:
    for case in commands.compiled(programs):
        check(case, world, capfd)
