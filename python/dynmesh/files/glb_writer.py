"""GLB: a short clip for browsers, game engines and slides, with one morph target for each frame.

The weights of the targets are animated, so that programs blend from frame to frame. glTF is in
metres, y up; the node of the mesh has the rotation and the scale that lead there.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._errors import InputError
from .._extras import require
from ..frames.frame import Frame
from .writer import Writer

_MOST_BYTES = 1 << 30
"""Programs hold all frames of a clip in memory."""

_USUAL_RATE = 24.0
_HALF = float(np.sqrt(0.5))
_TO_Y_UP = {"x": [0, 0, _HALF, _HALF], "y": None, "z": [-_HALF, 0, 0, _HALF]}
"""Quaternions, the real part last."""

_ELEMENTS = 34963
_KINDS = {1: "SCALAR", 3: "VEC3"}


class GlbWriter(Writer):
    """A clip that is being written."""

    keeps_known = False
    keeps_provenance = False
    keeps_float64 = False

    def _begin(self, kept: int) -> None:  # noqa: ARG002
        header = self.header
        self._gltf = require("pygltflib", extra="gltf")
        if self.path.suffix.lower() != ".glb":
            raise ValueError("is written as one file: name it .glb")
        if len(header.faces) == 0:
            raise ValueError("the sequence has no faces, which glTF needs")
        size = 12 * header.n_frames * header.n_vertices
        if size > _MOST_BYTES:
            raise ValueError(
                f"a clip of {size / 1e9:.2g} GB is too long, as programs hold it in memory: at "
                f"most {_MOST_BYTES // (12 * header.n_vertices)} frames of this mesh are written; "
                ".usdc and .abc can have more"
            )
        if header.up_axis is None:
            self.remarks.append("in glTF y is up, but nothing says what is up here; --up says it")
        if header.metres_per_unit is None:
            self.remarks.append(
                "in glTF lengths are in metres, but no unit is stated; --unit says it"
            )
        self._frames: list[NDArray[np.float32]] = []

    def _append(self, frame: Frame) -> None:
        if not np.isfinite(frame.points).all():
            vertex = int(np.isfinite(frame.points).all(axis=1).argmin())
            raise InputError(
                f"lacks vertex {vertex}, but glTF holds whole frames: complete it first",
                frame=self._number,
            )
        self._frames.append(np.asarray(frame.points, np.float32))

    def _finish(self) -> None:
        gltf, header = self._gltf, self.header
        n = len(self._frames)
        first, *others = self._frames
        arrays = _Arrays(gltf)
        triangles = arrays.add(header.faces.astype(np.uint32).reshape(-1), target=_ELEMENTS)
        position = arrays.add(first)
        targets = [{"POSITION": arrays.add(frame - first)} for frame in others]
        primitive = gltf.Primitive(
            attributes=gltf.Attributes(POSITION=position), indices=triangles, targets=targets
        )
        unit = header.metres_per_unit or 1.0
        node = gltf.Node(
            mesh=0,
            name=header.name or self.path.stem,
            rotation=_TO_Y_UP[header.up_axis or "y"],
            scale=None if unit == 1 else [unit] * 3,
        )
        clip = []
        if others:
            seconds = np.arange(n, dtype=np.float32) / (header.fps or _USUAL_RATE)
            weights = np.eye(n, n - 1, k=-1, dtype=np.float32)  # of each target in each frame
            sampler = gltf.AnimationSampler(
                input=arrays.add(seconds), output=arrays.add(weights.reshape(-1))
            )
            path = gltf.AnimationChannelTarget(node=0, path="weights")
            channel = gltf.AnimationChannel(sampler=0, target=path)
            clip = [gltf.Animation(samplers=[sampler], channels=[channel])]
        made = gltf.GLTF2(
            scene=0,
            scenes=[gltf.Scene(nodes=[0])],
            nodes=[node],
            meshes=[gltf.Mesh(primitives=[primitive], weights=[0.0] * (n - 1) or None)],
            animations=clip,
            accessors=arrays.accessors,
            bufferViews=arrays.views,
            buffers=[gltf.Buffer(byteLength=arrays.size)],
        )
        made.set_binary_blob(b"".join(arrays.content))
        made.save_binary(self.folder / self.path.name)

    def _close(self) -> None:
        pass


class _Arrays:
    """The arrays of a file, one behind the other in its buffer."""

    def __init__(self, gltf: Any) -> None:
        self._gltf = gltf
        self.content: list[bytes] = []
        self.size = 0
        self.views: list[Any] = []
        self.accessors: list[Any] = []

    def add(self, values: NDArray[Any], target: int | None = None) -> int:
        """Adds (n,) or (n, 3) float32 or uint32; returns the number of its accessor."""
        content = values.astype(values.dtype.newbyteorder("<")).tobytes()
        rows = values.reshape(len(values), -1)
        self.views.append(
            self._gltf.BufferView(
                buffer=0, byteOffset=self.size, byteLength=len(content), target=target
            )
        )
        self.accessors.append(
            self._gltf.Accessor(
                bufferView=len(self.views) - 1,
                componentType=self._gltf.UNSIGNED_INT
                if values.dtype.kind == "u"
                else self._gltf.FLOAT,
                count=len(values),
                type=_KINDS[rows.shape[1]],
                min=rows.min(axis=0).tolist(),
                max=rows.max(axis=0).tolist(),
            )
        )
        self.content.append(content)
        self.size += len(content)
        return len(self.accessors) - 1
