"""A USD stage: its meshes, its files, and what surrounds a mesh."""

import itertools
from pathlib import Path
from typing import Any

from .scenes import choose_mesh
from .usd_stage import one_line, pxr, translating

_numbers = itertools.count()


class UsdScene:
    """A stage with everything that it refers to.

    The copies that USD makes of a mesh by reference (instances) count as meshes.

    Attributes:
        path: of the file.
        stage: the composed stage.
        moves: the paths of the meshes, and whether the points of each change.
    """

    def __init__(self, path: Path) -> None:
        """Composes the stage."""
        path.open("rb").close()  # gives the error message of the system
        usd, geometry = pxr("Usd"), pxr("UsdGeom")
        with translating(ValueError, "is damaged or not a USD file: "):
            # In a process, all users of a path share one layer, even if the file has been replaced
            # since it was opened. A file format argument that is unique to this reader makes it a
            # separate layer.
            unique = {"reader": str(next(_numbers))}
            layer = pxr("Sdf").Layer.FindOrOpen(str(path.absolute()), unique)
            if layer is None:
                raise ValueError("is damaged or not a USD file")
            self.stage = usd.Stage.Open(layer)
        with translating(ValueError, "is damaged: "):
            prims = usd.PrimRange.Stage(self.stage, usd.TraverseInstanceProxies())
            self._meshes = {
                str(p.GetPath()): geometry.Mesh(p) for p in prims if p.IsA(geometry.Mesh)
            }
            self.moves: dict[str, bool] = {
                name: mesh.GetPointsAttr().ValueMightBeTimeVarying()
                for name, mesh in self._meshes.items()
            }
        self.path = path

    @property
    def files(self) -> list[Path]:
        """The files of all layers that the stage is composed of; a packed stage is one file."""
        split = pxr("Ar").SplitPackageRelativePathOuter
        layers = (layer.realPath for layer in self.stage.GetUsedLayers())
        outer = (split(path)[0] for path in layers if path)
        return [Path(path) for path in dict.fromkeys(outer)] or [self.path]

    def mesh(self, prim: str | None) -> Any:
        """Returns the mesh at this path, or see :func:`choose_mesh`; refuses incomplete stages."""
        errors = self.stage.GetCompositionErrors()
        if self._meshes or not errors:
            mesh = self._meshes[choose_mesh(self.moves, prim)]
            errors = [error for error in errors if mesh.GetPath().HasPrefix(error.rootSite.path)]
        if errors:
            raise ValueError(f"is incomplete: {one_line(str(errors[0]))}")
        return mesh

    def is_moved(self, mesh: Any) -> bool:
        """Whether transforms, which are ignored, put a mesh elsewhere than its points are."""
        paths = mesh.GetPath().GetPrefixes()
        above = [pxr("UsdGeom").Xformable(self.stage.GetPrimAtPath(path)) for path in paths]
        return any(one and one.GetXformOpOrderAttr().HasAuthoredValue() for one in above)


def derived_of(mesh: Any) -> dict[str, Any]:
    """The attributes of a mesh that follow from its points, by name, of those that it has."""
    attributes = {
        "extent": mesh.GetExtentAttr(),
        "normals": mesh.GetNormalsAttr(),
        "primvars:normals": pxr("UsdGeom").PrimvarsAPI(mesh).GetPrimvar("normals").GetAttr(),
        "velocities": mesh.GetVelocitiesAttr(),
        "accelerations": mesh.GetAccelerationsAttr(),
    }
    return {name: one for name, one in attributes.items() if one and one.HasAuthoredValue()}
