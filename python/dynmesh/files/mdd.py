"""MDD, the point cache of LightWave and Blender.

int32 frames, int32 vertices, a float32 time in seconds for each frame, then float32 positions; all
big-endian. Times in even steps tell the frames per second, as exactly as float32 can. Where nobody
said them, the times are the numbers of the frames, 0, 1, 2, ..., and so are read; one frame alone
tells nothing.
"""

import struct
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from .interface import Format
from .pointcache import PointCacheReader, PointCacheWriter

counts = struct.Struct(">ii")
dtype = np.dtype(">f4")


class MddReader(PointCacheReader):
    """A sequence in an MDD file."""

    dtype_in_file = dtype

    def _read_shape(self, file: IO[bytes]) -> tuple[tuple[int, int, int], int]:
        begin = file.read(counts.size)
        if len(begin) < counts.size:
            raise ValueError(f"ends in its header, after {len(begin)} of {counts.size} bytes")
        n_frames, n_vertices = counts.unpack(begin)
        return (n_frames, n_vertices, 3), counts.size + n_frames * dtype.itemsize

    def _read_fps(self, file: IO[bytes], n_frames: int) -> float | None:
        times = np.frombuffer(file.read(n_frames * dtype.itemsize), dtype).astype(np.float64)
        return frames_per_second(times)


def frames_per_second(times: NDArray[np.float64]) -> float | None:
    """The shortest number that explains float32 `times`, or None: uneven, or mere frame numbers."""
    steps = np.arange(len(times))
    if len(times) < 2 or np.array_equal(times, steps) or not np.isfinite(times).all():
        return None
    duration = times[-1] - times[0]
    if duration <= 0:
        return None
    tolerance = 2 * np.spacing(np.float32(np.abs(times).max()))
    for digits in range(1, 18):
        fps = float(f"{steps[-1] / duration:.{digits}g}")
        if np.allclose(times, times[0] + steps / fps, rtol=0, atol=tolerance):
            return fps
    return None


class MddWriter(PointCacheWriter):
    """An MDD file in the making."""

    dtype_in_file = dtype

    def _header_bytes(self) -> bytes:
        header = self.header
        times: NDArray[Any] = np.arange(header.n_frames) / (header.fps or 1)
        return counts.pack(header.n_frames, header.n_vertices) + times.astype(dtype).tobytes()


mdd = Format("mdd", (".mdd",), "point cache of LightWave and Blender", MddReader, MddWriter)
