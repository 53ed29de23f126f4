"""Cases of scenes: USD stages and Alembic archives with several meshes, and layers over them."""

from typing import Any

import dynmesh

from .case import World
from .functions import of


def prepare(world: World) -> None:
    """Creates the scenes that the cases read."""
    folder, sequence = world.folder, world.sequence
    dynmesh.write(folder / "scene.usda", sequence)
    dynmesh.write(folder / "scene.abc", sequence)
    twice = "".join(f'def "{name}" (references = @scene.usda@) {{}}\n' for name in ("one", "two"))
    (folder / "two.usda").write_text(f"#usda 1.0\n{twice}")


_complete = of("complete_file")
_open = of("open")
_convert = of("convert_file")


def _over(path: str = "scene.usda", output: str = "new.usda", **options: Any) -> Any:
    return dynmesh.complete_file(path, output, **options)


cases = [
    _open("a mesh that is not there", lambda _: dynmesh.open("scene.abc", prim="/no"), ValueError, "scene.abc:", "'/no'", "/mesh"),
    _complete("a layer over itself", lambda _: _over(output="scene.usda", overwrite=True), ValueError, "scene.usda:", "input"),
    _convert("a scene, to a format for a single mesh", lambda _: dynmesh.convert_file("two.usda", "new.npz"), ValueError, "two.usda:", "choose one", "/one, /two"),
]  # fmt: skip
