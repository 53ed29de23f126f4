"""Writes a USD layer over a stage: it changes the points of one mesh and nothing else."""

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .scenes import listed
from .usd_scene import UsdScene, derived_of
from .usd_stage import primvars, pxr
from .usd_writer import UsdWriter

_of_layers = ("subLayers", "subLayerOffsets", "primChildren", "comment", "documentation")
"""What a layer says of itself, not of the stage of which it is the root."""


class UsdOverlayWriter(UsdWriter):
    """A layer that is being written, with the mesh file of its header, a stage, as its sublayer.

    It only has opinions on one mesh: its points, and what no longer fits them, which it blocks.
    Everything else is that of the stage, whose time codes, units and default prim are repeated, as
    USD takes them from the root layer alone. The sublayer is named relative to the layer, so that
    both files can be moved together.
    """

    def _describe_stage(self) -> None:
        assert self.header.mesh_file is not None
        self._scene = UsdScene(self.header.mesh_file.path)
        self._original = self._scene.mesh(self.header.name)
        original = self._scene.stage.GetRootLayer().pseudoRoot
        for name in original.ListInfoKeys():
            if name not in _of_layers:
                self._layer.pseudoRoot.SetInfo(name, original.GetInfo(name))

    def _time_codes(self, rate: float) -> NDArray[np.float64]:
        """Returns the times of the samples themselves, which the conversion may round."""
        codes = super()._time_codes(rate)
        samples = np.array(self._original.GetPointsAttr().GetTimeSamples())
        if len(samples) == 0:
            return codes
        after = np.searchsorted(samples, codes).clip(1, max(1, len(samples) - 1)) % len(samples)
        before = samples[after - 1]
        nearest = np.where(codes - before < samples[after] - codes, before, samples[after])
        return np.where(np.isclose(codes, nearest, rtol=1e-9, atol=1e-9), nearest, codes)

    def _make_mesh(self) -> Any:
        geometry, stage = pxr("UsdGeom"), self._stage
        path = self._original.GetPath()
        instances = []
        for prim in map(self._scene.stage.GetPrimAtPath, path.GetPrefixes()):
            if prim.IsInstanceable():  # otherwise nothing below it can be changed
                stage.OverridePrim(prim.GetPath()).SetInstanceable(False)
                instances.append(str(prim.GetPath()))
            hint = prim.GetAttribute("extentsHint")
            if hint and hint.HasAuthoredValue():
                self._block(hint)
        if instances:
            self.remarks.append(f"no longer instances: {listed(instances)}")
        mesh = geometry.Mesh(stage.OverridePrim(path))
        derived = derived_of(self._original)
        for attribute in derived.values():
            self._block(attribute)
        if derived:
            self.remarks.append(
                f"{listed(list(derived))} of {self._scene.path.name} are blocked, since they no "
                "longer fit the points, and are not computed anew"
            )
        for name in primvars:
            stale = geometry.PrimvarsAPI(self._original).GetPrimvar(name)
            if stale.HasAuthoredValue() and name not in self.header.attributes:
                self._block(stale.GetAttr())
        return mesh

    def _block(self, original: Any) -> None:
        """Hides the value of an attribute of the stage."""
        over = self._stage.OverridePrim(original.GetPrim().GetPath())
        over.CreateAttribute(original.GetName(), original.GetTypeName(), custom=False).Block()

    def _complete_layer(self) -> None:
        scene = self._scene.path
        try:  # without following links, as USD does
            relative = f"./{Path(os.path.relpath(scene, self.path.parent)).as_posix()}"
        except ValueError:  # on another drive of Windows
            relative = scene.absolute().as_posix()
        self._layer.subLayerPaths.append(relative)

    def _close(self) -> None:
        super()._close()
        self._scene = self._original = None  # type: ignore[assignment]
