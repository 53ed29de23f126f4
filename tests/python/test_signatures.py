"""Signatures for Python and editors, and errors for calls that do not match them."""

import inspect
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from meshes import Mesh

import dynmesh
from dynmesh import _core

KIND = inspect.Parameter


def test_every_keyword_is_named_where_editors_look() -> None:
    functions = [f for f in map(dynmesh.__dict__.get, dynmesh.__all__) if inspect.isfunction(f)]
    assert len(functions) > 8
    for function in functions:
        kinds = {p.kind for p in inspect.signature(function).parameters.values()}
        assert KIND.VAR_KEYWORD not in kinds, function.__name__


@pytest.mark.parametrize("function", [dynmesh.read, dynmesh.diagnose])
def test_files_are_opened_with_the_same_options_everywhere(function: Callable[..., Any]) -> None:
    taken = inspect.signature(function).parameters
    options = inspect.signature(dynmesh.open).parameters.items()
    for name, option in options:
        if option.kind == KIND.KEYWORD_ONLY:
            assert taken[name] == option


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


def test_an_option_that_there_is_not_is_refused_by_its_name_alone() -> None:
    wrong: Any = {"axes": "y"}
    with pytest.raises(TypeError, match=r"^got an unexpected keyword argument 'axes'$"):
        dynmesh.track_file("scans", "out.npz", template="body.ply", **wrong)
    with pytest.raises(TypeError, match=r"^got an unexpected keyword argument 'axes'$"):
        dynmesh.convert_file("in.npz", "out.npz", **wrong)
