"""PC2, the point cache of 3ds Max and Blender.

`POINTCACHE2` and a zero byte, int32 version 1, int32 vertices, float32 start frame, float32 sample
rate, int32 frames, then float32 positions; all little-endian. The rate counts samples per frame of
a scene, not per second, so frames per second cannot be stored.
"""

import struct
from typing import IO

import numpy as np

from .format import Format
from .pointcache import PointCacheReader, PointCacheWriter

signature = b"POINTCACHE2\0"
layout = struct.Struct("<12siiffi")


class Pc2Reader(PointCacheReader):
    """A sequence in a PC2 file."""

    dtype_in_file = np.dtype("<f4")

    def _read_shape(self, file: IO[bytes]) -> tuple[tuple[int, int, int], int]:
        begin = file.read(layout.size)
        if not begin.startswith(signature):
            raise ValueError("is not a PC2 file, as it does not begin with POINTCACHE2")
        if len(begin) < layout.size:
            raise ValueError(f"ends in its header, after {len(begin)} of {layout.size} bytes")
        _, version, n_vertices, self._start, _, n_frames = layout.unpack(begin)
        if version != 1:
            raise ValueError(f"is a PC2 file of version {version}, but only version 1 is supported")
        return (n_frames, n_vertices, 3), layout.size

    def _read_timing(self, file: IO[bytes], n_frames: int) -> tuple[float | None, float]:  # noqa: ARG002
        return None, float(str(np.float32(self._start)))  # the shortest digits of the float32


class Pc2Writer(PointCacheWriter):
    """A PC2 file that is being written."""

    dtype_in_file = np.dtype("<f4")

    def _header_bytes(self) -> bytes:
        header = self.header
        return layout.pack(signature, 1, header.n_vertices, header.start, 1.0, header.n_frames)


pc2 = Format(
    "pc2",
    (".pc2",),
    "point cache of 3ds Max and Blender",
    Pc2Reader,
    Pc2Writer,
    frozenset({"faces"}),
)
