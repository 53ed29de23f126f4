"""Every case of bad input is refused with a helpful message, which the site shows."""

from pathlib import Path

import pytest
from bad_input import commands
from bad_input.case import Case, Printed, World
from bad_input.page import prepared, python_sections

CASES = [case for cases in python_sections().values() for case in cases]


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> World:
    return prepared(tmp_path_factory.mktemp("world"))


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
