"""Signatures for Python and editors, and errors for calls that do not match them."""

import ast
import inspect
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import Mesh

import dynmesh
from dynmesh import _core
from dynmesh.settings import default_settings

KIND = inspect.Parameter


def parameters_of(function: ast.FunctionDef) -> list[tuple[str, Any, Any]]:
    """Returns the name, kind and default of each parameter in a stub.

    ``**settings: Unpack[Settings]`` stands for all settings, which come before other keywords.
    """
    given = function.args
    assert not given.posonlyargs
    assert given.vararg is None
    settings = default_settings if given.kwarg else {}
    if given.kwarg:
        assert ast.unparse(given.kwarg) == "settings: Unpack[Settings]"
    defaults = [None] * (len(given.args) - len(given.defaults)) + list(given.defaults)
    found = [
        *(
            (name, KIND.POSITIONAL_OR_KEYWORD, default)
            for name, default in zip(given.args, defaults, strict=True)
        ),
        *(
            (name, KIND.KEYWORD_ONLY, default)
            for name, default in zip(given.kwonlyargs, given.kw_defaults, strict=True)
        ),
    ]
    parameters = [
        (name.arg, kind, KIND.empty if default is None else ast.literal_eval(default))
        for name, kind, default in found
    ]
    expanded = [(name, KIND.KEYWORD_ONLY, default) for name, default in settings.items()]
    at = len(given.args)
    return [*parameters[:at], *expanded, *parameters[at:]]


def read_the_stub() -> Iterator[tuple[str, Any, list[tuple[str, Any, Any]]]]:
    """Returns the parameters in the stub of every function, method and constructor, by its name."""
    stub = Path(_core.__file__).parent / "_core.pyi"
    for node in ast.parse(stub.read_text()).body:
        if isinstance(node, ast.FunctionDef):
            yield node.name, getattr(_core, node.name), parameters_of(node)
        elif isinstance(node, ast.ClassDef):
            of_class = getattr(_core, node.name)
            for member in node.body:
                if not isinstance(member, ast.FunctionDef) or member.decorator_list:
                    continue
                if member.name == "__init__":
                    yield node.name, of_class, parameters_of(member)[1:]
                else:
                    name = f"{node.name}.{member.name}"
                    yield name, getattr(of_class, member.name), parameters_of(member)


IN_THE_STUB = list(read_the_stub())


@pytest.mark.parametrize(
    ("function", "expected"),
    [case[1:] for case in IN_THE_STUB],
    ids=[case[0] for case in IN_THE_STUB],
)
def test_the_compiled_part_has_the_signatures_of_its_stub(
    function: Callable[..., Any], expected: list[tuple[str, Any, Any]]
) -> None:
    found = inspect.signature(function).parameters.values()
    assert [(p.name, p.kind, p.default) for p in found] == expected
    assert not str(inspect.getdoc(function)).startswith(f"{function.__name__}(")


def test_bound_methods_have_signatures(mesh: Mesh) -> None:
    completer = dynmesh.Completer(mesh.faces, mesh.vertices)
    assert str(inspect.signature(completer.push)) == "(points, known=None, *, out=None)"


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
        ("Completer", [AN_ARRAY], {}, "missing a required argument: 'first_frame'"),
        ("Completer", [AN_ARRAY] * 3, {}, "too many positional arguments"),
        ("Completer", [AN_ARRAY] * 2, {"speed": 1}, "got an unexpected keyword argument 'speed'"),
        ("push", [], {}, "missing a required argument: 'points'"),
        ("push", [AN_ARRAY] * 3, {}, "too many positional arguments"),
        ("push", [AN_ARRAY], {"kown": AN_ARRAY}, "got an unexpected keyword argument 'kown'"),
        ("push", [AN_ARRAY], {"points": AN_ARRAY}, "multiple values for argument 'points'"),
        ("push_sparse", [AN_ARRAY], {}, "missing a required argument: 'points'"),
        ("skip", [AN_ARRAY], {}, "too many positional arguments"),
        ("reset", [AN_ARRAY], {"out": AN_ARRAY}, "got an unexpected keyword argument 'out'"),
        ("state", [AN_ARRAY], {}, "too many positional arguments"),
        ("restore", [], {}, "missing a required argument: 'state'"),
        ("cells", [AN_ARRAY], {}, "missing a required argument: 'n_vertices'"),
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
