"""Signatures for Python and editors, and errors for calls that do not match them."""

import inspect
from typing import Any

import numpy as np
import pytest
from meshes import Mesh

import dynmesh
from dynmesh import _core


def test_files_are_opened_with_the_same_options_everywhere() -> None:
    taken = inspect.signature(dynmesh.open).parameters
    options = {name: one.annotation for name, one in taken.items() if one.kind == one.KEYWORD_ONLY}
    assert options.pop("format") == str | None
    assert options == dynmesh.files.Source.__annotations__


AN_ARRAY = np.zeros((49, 3))


@pytest.mark.parametrize(
    ("name", "arguments", "keywords", "reason"),
    [
        ("Completer", [], {}, "missing a required argument: 'faces'"),
        ("Completer", [AN_ARRAY] * 2, {"speed": 1}, "got an unexpected keyword argument 'speed'"),
        ("push", [AN_ARRAY] * 3, {}, "too many positional arguments"),
        ("push", [AN_ARRAY], {"kown": AN_ARRAY}, "got an unexpected keyword argument 'kown'"),
        ("push", [AN_ARRAY], {"points": AN_ARRAY}, "multiple values for argument 'points'"),
        ("nmsve", [AN_ARRAY] * 4, {}, "too many positional arguments"),
        ("LeastSquaresMesh", [AN_ARRAY], {}, "missing a required argument: 'n_vertices'"),
    ],
)
def test_a_call_that_does_not_fit_is_refused_in_one_line(
    mesh: Mesh, name: str, arguments: list[Any], keywords: dict[str, Any], reason: str
) -> None:
    completer = dynmesh.Completer(mesh.faces, mesh.vertices)
    before = completer.state()
    callee = getattr(completer, name, None) or getattr(_core, name)
    with pytest.raises(TypeError) as refused:
        callee(*arguments, **keywords)
    taken = inspect.signature(callee)
    assert str(refused.value) == f"{name}(): {reason}; it takes {taken}"
    assert completer.state() == before


def test_a_method_of_something_else_is_refused_in_one_line() -> None:
    push: Any = dynmesh.Completer.push
    with pytest.raises(TypeError) as refused:
        push(AN_ARRAY, AN_ARRAY)
    expected = (
        "push(): an argument has the wrong type; it takes (self, points, known=None, *, out=None)"
    )
    assert str(refused.value) == expected
