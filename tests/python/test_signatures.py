"""Signatures for Python and editors."""

import inspect

import dynmesh


def test_files_are_opened_with_the_same_options_everywhere() -> None:
    taken = inspect.signature(dynmesh.open).parameters
    options = {name: one.annotation for name, one in taken.items() if one.kind == one.KEYWORD_ONLY}
    assert options.pop("format") == str | None
    assert options == dynmesh.files.Source.__annotations__
