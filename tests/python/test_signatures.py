"""Signatures for Python and editors."""

import inspect
import pickle
import re
from collections.abc import Callable
from typing import Any

import pytest

import dynmesh
from dynmesh._errors import KindError


def test_files_are_opened_with_the_same_options_everywhere() -> None:
    taken = inspect.signature(dynmesh.open).parameters
    options = {name: one.annotation for name, one in taken.items() if one.kind == one.KEYWORD_ONLY}
    assert options.pop("format") == str | None
    assert options == dynmesh.files.Source.__annotations__


@pytest.mark.parametrize(
    ("function", "keyword", "meant"),
    [
        (dynmesh.complete_file, "mask", "source={'known': ...}"),
        (dynmesh.complete_file, "missing", "source={'missing': ...}"),
        (dynmesh.complete_file, "bidirektional", "bidirectional"),
        (dynmesh.complete, "mask", "known"),
        (dynmesh.complete, "iterations", "extra_iterations"),
        (dynmesh.evaluate, "input", "partial"),
        (dynmesh.view, "output", "out"),
        (dynmesh.Completer, "treads", "threads"),
        (dynmesh.Tracker, "uncertanty", "uncertainty"),
    ],
)
def test_a_keyword_that_does_not_exist_names_the_one_that_is_meant(
    function: Callable[..., Any], keyword: str, meant: str
) -> None:
    with pytest.raises(KindError, match=f"did you mean {re.escape(meant)}") as caught:
        function("a", "b", **{keyword: 1})
    assert caught.value.argument == keyword
    with pytest.raises(KindError, match=str(next(iter(inspect.signature(function).parameters)))):
        function("a", "b", quite_another=1)
    if inspect.isfunction(function):
        assert pickle.loads(pickle.dumps(function)) is function
