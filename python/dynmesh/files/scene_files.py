"""Opens scenes: files with several meshes, each of which is a sequence."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

from .._errors import DynmeshError
from ..frames.naming import naming
from ..frames.reader import Reader
from ..frames.scenes import Scene, every_mesh
from .choice import format_of, formats, listed
from .masks import MaskedReader


def open_scene(path: Path, format: str | None = None) -> Scene:
    """Opens a file with all its meshes.

    Raises:
        OSError: the file cannot be opened.
        ImportError: the library for this format is not installed; the message names its extra.
        ValueError: the file is damaged, or its format holds a single mesh.
    """
    with naming(path):
        chosen = format_of(path, format)
        if chosen.scene is None:
            able = [name for name, one in formats.items() if one.scene is not None]
            raise ValueError(f"holds a single mesh, as only {listed(able)} hold several")
        return chosen.scene(path)


def open_if_whole(path: Path, source: Mapping[str, Any]) -> Scene | None:
    """Opens the scene of a file with several meshes, if none of them is chosen; else returns None.

    The keywords are those of :func:`dynmesh.open`. Faces and masks are of one mesh.
    """
    prim, format = source.get("prim"), source.get("format")
    of_one = any(source.get(name) is not None for name in ("faces", "known"))
    if prim not in (None, every_mesh) or of_one or source.get("gaps", "refuse") != "refuse":
        return None
    if format_of(path, format).scene is None:
        return None
    scene = open_scene(path, format)
    return scene if len(scene.moves) > (prim is None) else None


@contextmanager
def naming_mesh(mesh: str) -> Iterator[None]:
    """Adds the path of a mesh to errors, which name the file of the scene."""
    try:
        yield
    except DynmeshError as error:
        error.reason = f"{mesh}: {error.reason}"
        raise


def open_mesh(scene: Scene, mesh: str, missing: Literal["zero"] | None = None) -> Reader:
    """Opens one mesh of a scene, which must stay open; see :func:`dynmesh.open`.

    Raises:
        ValueError: the mesh is not a valid sequence.
    """
    with naming(scene.path):
        open_one = formats[scene.format].mesh_reader
        assert open_one is not None
        reader = open_one(scene, mesh)
    return reader if missing is None else MaskedReader(reader, None, zero_is_missing=True)
