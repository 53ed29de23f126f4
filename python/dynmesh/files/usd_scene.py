"""A USD stage as a scene: its meshes, its files, and what a layer over it has to repeat."""

from pathlib import Path
from typing import Any

from ..frames.scenes import Scene, choose_mesh
from .usd_stage import composed, files_of, one_line, pxr, translating


class UsdScene(Scene):
    """A stage with everything that it refers to.

    The copies that USD makes of a mesh by reference (instances) count as meshes.
    """

    format = "usd"

    def __init__(self, path: Path) -> None:
        """Composes the stage."""
        path.open("rb").close()  # gives the error message of the system
        with translating(ValueError, "is damaged or not a USD file: "):
            self.stage = composed(path)
        with translating(ValueError, "is damaged: "):
            usd, geometry = pxr("Usd"), pxr("UsdGeom")
            prims = usd.PrimRange.Stage(self.stage, usd.TraverseInstanceProxies())
            self._meshes = {
                str(p.GetPath()): geometry.Mesh(p) for p in prims if p.IsA(geometry.Mesh)
            }
            moves = {
                name: mesh.GetPointsAttr().ValueMightBeTimeVarying()
                for name, mesh in self._meshes.items()
            }
        super().__init__(path, moves)

    @property
    def files(self) -> list[Path]:
        """The files of all layers that the stage is composed of."""
        return files_of(self.stage) or [self.path]

    def mesh(self, prim: str | None) -> Any:
        """Returns the mesh at this path, or see :func:`choose_mesh`; refuses incomplete stages."""
        errors = self.stage.GetCompositionErrors()
        if self._meshes or not errors:
            mesh = self._meshes[choose_mesh(self.moves, prim)]
            errors = [error for error in errors if mesh.GetPath().HasPrefix(error.rootSite.path)]
        if errors:
            raise ValueError(f"is incomplete: {one_line(str(errors[0]))}")
        return mesh
