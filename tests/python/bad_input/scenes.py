"""Cases of scenes: USD stages and Alembic archives, completed as a whole or by a layer over them."""

from typing import Any

import numpy as np

import dynmesh

from .case import Printed, World
from .functions import failed_job, of


def prepare(world: World) -> None:
    """Creates the scenes that the cases read."""
    folder, sequence = world.folder, world.sequence
    dynmesh.write(folder / "scene.usda", sequence)
    dynmesh.write(folder / "scene.abc", sequence)
    still = dynmesh.Sequence(sequence.vertices[:1], sequence.faces)
    dynmesh.write(folder / "still.usda", still)
    nothing = np.nan * sequence.vertices
    dynmesh.write(folder / "no_start.usda", dynmesh.Sequence(nothing, sequence.faces))
    dynmesh.write(folder / "old.usda", sequence)
    twice = "".join(f'def "{name}" (references = @scene.usda@) {{}}\n' for name in ("one", "two"))
    (folder / "two.usda").write_text(f"#usda 1.0\n{twice}")


_complete = of("complete_file")
_scene = of("complete_scene")
_open = of("open")
_convert = of("convert_file")
_view = of("view")
_batch = of("batch.complete_files")


def _all(path: str = "scene.usda", output: str = "new.usda", **options: Any) -> Any:
    return dynmesh.complete_scene(path, output, **options)


def _over(path: str = "scene.usda", output: str = "new.usda", **options: Any) -> Any:
    return dynmesh.complete_file(path, output, overlay=True, **options)


cases = [
    _open("`prim='all'`", lambda _: dynmesh.open("scene.usda", prim="all"), ValueError, "scene.usda:", "complete_scene", "/mesh"),
    _open("a mesh that is not there", lambda _: dynmesh.open("scene.abc", prim="/no"), ValueError, "scene.abc:", "'/no'", "/mesh"),
    _complete("`prim='all'`", lambda _: dynmesh.complete_file("scene.usda", "new.usda", source={"prim": "all"}), ValueError, "scene.usda:", "complete_scene"),
    _complete("`overlay` over what is not USD", lambda _: _over("body.npz"), ValueError, "new.usda:", "must be USD"),
    _complete("`overlay` over Alembic", lambda _: _over("scene.abc"), ValueError, "new.usda:", "must be USD"),
    _complete("`overlay` in a format without layers", lambda _: _over(output="new.npz"), ValueError, "new.npz:", ".usda"),
    _complete("`overlay` as `.usdz`", lambda _: _over(output="new.usdz"), ValueError, "new.usdz:", "only be read"),
    _complete("`overlay` over itself", lambda _: _over(output="scene.usda", overwrite=True), ValueError, "scene.usda:", "input"),
    _complete("`overlay` and `fps`", lambda _: _over(fps=25), ValueError, "new.usda:", "fps:", "be 25"),
    _scene("a path that is a number", lambda _: dynmesh.complete_scene(3, "new.usda"), TypeError, "path:", "int"),  # type: ignore[arg-type]
    _scene("a file that is not there", lambda _: _all("none.usda"), FileNotFoundError, "none.usda"),
    _scene("a file with a single mesh", lambda _: _all("body.npz"), ValueError, "body.npz:", "usd"),
    _scene("an output for a single mesh", lambda _: _all(output="new.npz"), ValueError, "new.npz:", "USD or Alembic"),
    _scene("an output that exists", lambda _: _all(output="old.usda"), FileExistsError, "old.usda:", "overwrite=True"),
    _scene("the input as output", lambda _: _all(output="scene.usda", overwrite=True), ValueError, "scene.usda:", "input"),
    _scene("no mesh that moves", lambda _: _all("still.usda"), ValueError, "still.usda:", "/mesh", "nothing to complete"),
    _scene("no mesh with a known vertex", lambda _: _all("no_start.usda"), ValueError, "no_start.usda:", "/mesh: frames: no vertex is known"),
    _scene("`overlay` over Alembic", lambda _: _all("scene.abc", overlay=True), ValueError, "scene.abc:", "must be USD"),
    _scene("`source` with a mask", lambda w: _all(source={"known": w.known}), ValueError, "known:", "one mesh"),
    _scene("`source` with faces", lambda w: _all(source={"faces": w.faces}), ValueError, "faces:", "one mesh"),
    _scene("`source` with one mesh", lambda _: _all(source={"prim": "/mesh"}), ValueError, "prim:", "'/mesh'", "complete_file"),
    _batch("all meshes of which none can be completed (the job's reason)", lambda _: failed_job("no_start.usda", source={"prim": "all"}), Printed, "no_start.usda: no mesh", "/mesh"),
    _batch("all meshes, and `fps` (the job's reason)", lambda _: failed_job("scene.usda", source={"prim": "all"}, fps=25), Printed, "scene.usda: fps:", "one mesh"),
    _convert("a scene, to a format for a single mesh", lambda _: dynmesh.convert_file("two.usda", "new.npz"), ValueError, "two.usda:", "choose one", "/one, /two"),
    _convert("`prim='all'`, to a format for a single mesh", lambda _: dynmesh.convert_file("two.usda", "new.npz", source={"prim": "all"}), ValueError, "new.npz:", "--prim", "single mesh"),
    _convert("a scene, over itself", lambda _: dynmesh.convert_file("two.usda", "two.usda", overwrite=True), ValueError, "two.usda:", "input"),
    _convert("a scene, and an output that exists", lambda _: dynmesh.convert_file("two.usda", "old.usda"), FileExistsError, "old.usda:", "overwrite=True"),
    _view("`colour='mesh'` of a single mesh", lambda _: dynmesh.view("body.npz", colour="mesh"), ValueError, "body.npz:", "one mesh"),
    _scene("`watch`: a number", lambda _: _all(watch=3), TypeError, "watch:", "3"),
]  # fmt: skip
