"""The faces of files that hold only positions: given, or from a file beside them."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

from .._errors import InputError
from .format import Template
from .naming import naming


class NoFacesError(InputError):
    """The file holds no faces, and none were given."""


def find_template(
    given: Template | None, n_vertices: int, beside: Mapping[Path, Callable[[Path], Template]]
) -> Template:
    """Returns the mesh that provides the faces of a file with so many vertices.

    If none is given, it is read from the first of the files `beside` that exists.

    Raises:
        OSError: a file beside it cannot be read.
        ValueError: there is no mesh, or it has another number of vertices.
    """
    template = given if given is not None else _first(beside)
    if template.n_vertices not in (None, n_vertices):
        raise ValueError(
            f"has {n_vertices} vertices, but the mesh with its faces has {template.n_vertices}"
        )
    return template


def _first(beside: Mapping[Path, Callable[[Path], Template]]) -> Template:
    for path, load in beside.items():
        if path.exists():
            with naming(path):
                return replace(load(path), files=(path,))
    names = " or ".join(path.name for path in beside)
    raise NoFacesError(
        f"holds only positions{f', and there is no {names} beside it' if names else ''}; "
        "give a mesh with its faces"
    )
