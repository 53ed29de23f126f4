"""Opens scenes: files with several meshes, each of which is a sequence."""

from pathlib import Path
from typing import Literal

from ..frames.naming import naming
from ..frames.reader import Reader
from ..frames.scenes import Scene
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
