"""Writes a USD layer over a scene: it changes the meshes that were completed and nothing else."""

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._errors import InputError
from ..frames.scenes import Origin, listed
from .usd_scene import UsdScene
from .usd_stage import frame_times, primvars, pxr, timing
from .usd_writer import UsdWriter

_of_layers = ("subLayers", "subLayerOffsets", "primChildren", "comment", "documentation")
"""What a layer says of itself, not of the stage of which it is the root."""


class UsdOverlayWriter(UsdWriter):
    """A layer that is being written, with the scene as its sublayer.

    It only has opinions on the meshes that are written: their points and what follows from them.
    Everything else is that of the scene, whose time codes, units and default prim are repeated, as
    USD takes them from the root layer alone. The sublayer is named relative to the layer, so that
    both files can be moved together.
    """

    keeps_scene_of = "usd"

    def _describe_stage(self) -> None:
        self._instances: dict[str, None] = {}
        original = _scene_of(self.origin).stage.GetRootLayer().pseudoRoot
        for name in original.ListInfoKeys():
            if name not in _of_layers:
                self._layer.pseudoRoot.SetInfo(name, original.GetInfo(name))

    def _time_codes(self, rate: float) -> NDArray[np.float64]:
        """Returns the times of the samples themselves, which the conversion may round."""
        points = self._original_mesh().GetPointsAttr()
        fps = timing(_scene_of(self.origin).stage, frame_times(points)).fps
        if self.header.fps != fps:
            raise InputError(
                f"an overlay has the times of its stage ({fps} frames per second), so they cannot "
                f"be {self.header.fps}; leave out fps",
                argument="fps",
            )
        codes = super()._time_codes(rate)
        samples = np.array(points.GetTimeSamples())
        if len(samples) == 0:
            return codes
        after = np.searchsorted(samples, codes).clip(1, max(1, len(samples) - 1)) % len(samples)
        before = samples[after - 1]
        nearest = np.where(codes - before < samples[after] - codes, before, samples[after])
        return np.where(np.isclose(codes, nearest, rtol=1e-9, atol=1e-9), nearest, codes)

    def _make_mesh(self) -> Any:
        geometry, stage = pxr("UsdGeom"), self._stage
        original = self._original_mesh()
        path = original.GetPath()
        above = [original.GetPrim().GetStage().GetPrimAtPath(p) for p in path.GetPrefixes()]
        for prim in above:
            if prim.IsInstanceable():  # otherwise nothing below it can be changed
                stage.OverridePrim(prim.GetPath()).SetInstanceable(False)
                self._instances[str(prim.GetPath())] = None
            hint = prim.GetAttribute("extentsHint")
            if hint and hint.HasAuthoredValue():
                over = stage.OverridePrim(prim.GetPath())
                over.CreateAttribute(hint.GetName(), hint.GetTypeName(), custom=False).Block()
        mesh = geometry.Mesh(stage.OverridePrim(path))
        for name in primvars:
            stale = geometry.PrimvarsAPI(original).GetPrimvar(name)
            if stale.HasAuthoredValue() and name not in self.header.attributes:
                api = geometry.PrimvarsAPI(mesh)
                api.CreatePrimvar(name, stale.GetTypeName()).GetAttr().Block()
        return mesh

    def _original_mesh(self) -> Any:
        return _scene_of(self.origin).mesh(self.header.name)

    def _complete_layer(self) -> None:
        if self._instances:
            self.remarks.append(f"no longer instances: {listed(list(self._instances))}")
        scene = _scene_of(self.origin).path
        try:  # without following links, as USD does
            relative = f"./{Path(os.path.relpath(scene, self.path.parent)).as_posix()}"
        except ValueError:  # on another drive of Windows
            relative = scene.absolute().as_posix()
        self._layer.subLayerPaths.append(relative)


def _scene_of(origin: Origin | None) -> UsdScene:
    if origin is None or not isinstance(origin.scene, UsdScene):
        raise ValueError(
            "an overlay changes a mesh in a USD stage, so the input must be USD (.usd, .usda, "
            ".usdc or .usdz)"
        )
    return origin.scene
