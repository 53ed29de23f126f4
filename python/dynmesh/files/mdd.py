"""MDD, the point cache of LightWave and Blender.

int32 frames, int32 vertices, a float32 time in seconds for each frame, then float32 positions; all
big-endian. The frames per second and the number of the first frame are derived from evenly spaced
times, as exactly as float32 allows. If the frames per second are unknown, the numbers of the frames
are written as times and read back as such. A single frame determines neither.
"""

import struct
from collections.abc import Iterator
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from ..frames.times import broadcast, shortened
from .format import Format
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

    def _read_timing(self, file: IO[bytes], n_frames: int) -> tuple[float | None, float]:
        times = np.frombuffer(file.read(n_frames * dtype.itemsize), dtype).astype(np.float64)
        return timing(times)


def timing(times: NDArray[np.float64]) -> tuple[float | None, float]:
    """Finds the simplest frame rate that explains float32 `times`, and the first frame's number.

    The frame rate is None if the times are uneven or are frame numbers.
    """
    if len(times) < 2 or not np.isfinite(times).all():
        return None, 0
    steps, duration = np.arange(len(times)), times[-1] - times[0]
    tolerance = 2 * np.spacing(np.float32(np.abs(times).max()))

    def explained(fps: float, first: float) -> bool:
        return np.allclose(times, (first + steps) / fps, rtol=0, atol=tolerance)

    rate = steps[-1] / duration if duration > 0 else 0
    if not (rate and explained(rate, times[0] * rate)):
        return None, float(times[0])
    fps, first = next(one for one in _candidates(rate, times[0]) if explained(*one))
    return (None if fps == 1 else fps), first


def _candidates(rate: float, time: float) -> Iterator[tuple[float, float]]:
    """Yields frame rates and first frames, from simple numbers to the measured ones.

    Times that are close together, but far from 0, match many rates, but few with an integer start.
    """
    rates = (*shortened(rate), *broadcast)
    for fps in rates:
        yield fps, float(round(time * fps))
    for fps in rates:
        for first in shortened(time * fps):
            yield fps, first


class MddWriter(PointCacheWriter):
    """An MDD file that is being written."""

    dtype_in_file = dtype

    def _header_bytes(self) -> bytes:
        header = self.header
        times: NDArray[Any] = (header.start + np.arange(header.n_frames)) / (header.fps or 1)
        return counts.pack(header.n_frames, header.n_vertices) + times.astype(dtype).tobytes()


mdd = Format(
    "mdd",
    (".mdd",),
    "point cache of LightWave and Blender",
    MddReader,
    MddWriter,
    frozenset({"faces"}),
)
