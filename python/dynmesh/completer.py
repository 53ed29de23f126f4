"""Completion of a dynamic mesh, one frame at a time."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Literal, TypedDict

import numpy as np
from numpy.typing import NDArray

from . import _arrays, _core
from ._arrays import Integers, Mask, Positions
from ._stream import Stream
from .frame import Frame
from .polygons import Faces, Mesh

__all__ = ["Completer", "FrameReport", "Settings"]


class Settings(TypedDict, total=False):
    """The keywords of :class:`dynmesh.Completer`, which explains them."""

    method: Literal["motion", "detail"]
    revisit: bool
    extra_iterations: int
    disconnected: Literal["follow", "hold"]
    noise: float | None
    reject_outliers: bool
    learn: bool
    uncertainty: bool
    threads: int


@dataclass(frozen=True, kw_only=True)
class FrameReport:
    """Statistics of one frame.

    Attributes:
        known: the number of vertices that were observed.
        filled: the number of vertices that the method estimated.
        disconnected: the number of vertices that no chain of edges connects to a known one. known +
            filled + disconnected = k.
        iterations: the number of iterations of the method.
        rejected: the number of vertices that were observed but rejected as outliers.
        seconds: the wall time of the completion.
        blend: b of method "detail", the weight of the shape of frame 0; 0 for "motion".
        prior_weight: with `training`, how much the training frames are used, from 0 to 1. With
            `learn`, 1 as soon as something is learned. Else 0.
        prior_share: with either, the share of the residual that they explain, from 0 to 1; see
            docs/method.md, "Training frames". Else 0.
        first_order_share: how far the estimated vertices keep the lengths of their edges, as cloth
            does, rather than their shape: the mean, from 0 to 1; see docs/method.md, "The
            first-order steps". Else 0.
        standard_error: with `uncertainty`, the root mean square of the standard errors of the
            estimated vertices, in the unit of the positions; else 0.
        factor_seconds: the time of the factorisation, a stage of "detail"; 0 for "motion".
        rotation_seconds: the time in which rotations were fitted.
        solve_seconds: the time of everything else.
        quality: "good"; "ruined" if many edges are far longer or shorter than in frame 0, as of
            points that belong to other vertices, or if it is a mirror image of the frame before or
            of another subject, once a few frames have shown what is usual; no later frame follows
            from a ruined one, unless three that agree follow each other. "doubtful" if frame 0
            seems to be in another unit of length, a mirror image, of another subject or in another
            order of vertices, which the first frames show, or if nothing is known. A part that is
            estimated wrongly with edges of the right lengths is not noticed.
        reason: why the quality is not good; empty if it is.
    """

    known: int
    filled: int
    disconnected: int
    iterations: int
    rejected: int
    seconds: float
    blend: float = field(repr=False)
    prior_weight: float = field(repr=False)
    prior_share: float = field(repr=False)
    first_order_share: float = field(repr=False)
    standard_error: float = field(repr=False)
    factor_seconds: float = field(repr=False)
    rotation_seconds: float = field(repr=False)
    solve_seconds: float = field(repr=False)
    quality: Literal["good", "doubtful", "ruined"]
    reason: str


class Completer(Stream):
    """Completes a dynamic mesh, one frame at a time.

        completer = dynmesh.Completer(faces, first_frame)
        for points, known in sensor:
            frame = completer.push(points, known)

    Each frame is completed from the frame itself and earlier frames only. `push`, `push_sparse` and
    `skip` return the completed frame, an array (k, 3) with the dtype of `first_frame`. Known
    vertices are returned exactly as given, and all others are estimated. With `noise`, known
    vertices move as well; vertices rejected by `reject_outliers` are estimated. These methods
    release the GIL. Bad input raises ValueError, or TypeError for a wrong type, with a message that
    says what is wrong, where, and with which value. The completer is then unchanged.

    A completer may be used by one thread at a time: a call while another thread is using it raises
    RuntimeError. Only `report`, `n_frames` and what never changes (`topology`, `settings`, `dtype`,
    `n_vertices` and `n_edges`) may be read at any time. It can be pickled and copied, also into
    another process, and continues there with the same results. For that, it keeps the faces, the
    first frame and the training frames: 12 bytes for each triangle, and 3 numbers for each vertex
    and frame.

    Args:
        faces: the triangles, (m, 3) integers, or other polygons: (m, 4) quads, a list of lists of
            vertices, or Polygons. Each is cut into triangles around its first corner, as those of
            files are. Triangles that a half-edge mesh cannot represent are listed in `topology`;
            their edges are still used. Or a mesh with positions, without `first_frame`: a
            `trimesh.Trimesh` or a `pyvista.PolyData`.
        first_frame: frame 0, (k, 3) float32 or float64, complete and finite. Later positions are
            converted to its dtype. When float64 is converted to float32, a finite number out of
            range becomes the largest float32 of its sign; a known position with such a coordinate
            is refused as too large and does not count as missing.
        method: "detail" preserves the shape of frame 0 and of the last frame, rotated with the
            motion. "motion" averages motion vectors as in the paper (Arvanitis et al. 2017,
            section 3), and is fast: a frame takes tenths of a millisecond instead of milliseconds,
            but the error is several times larger. Both are described in docs/method.md.
        revisit: estimate each unknown vertex again in every iteration. If False: estimate each
            vertex only once, when it is reached: another reading of the paper, in which errors
            accumulate from frame to frame. Requires "motion".
        extra_iterations: iterations after the one that reaches the last unknown vertex. Ten reduce
            the error by a third on many sequences. They have no effect without `revisit`. From 0 to
            1000000. Requires "motion".
        disconnected: parts that no chain of edges connects to a known vertex "follow" a part that
            is seen, or "hold" their position. Those that follow move rigidly, with the part that
            touched them in frame 0 and kept its distance to them when both were seen.
        noise: the standard deviation of the noise of the known positions, in the unit of the
            positions; they are smoothed, according to the shape around them. Without it, they are
            exact. Requires "detail".
        reject_outliers: treat known vertices as unknown if they do not move like those around them.
            They are estimated, and counted as `report.rejected`. Requires "detail".
        learn: learn from the completed frames how the shape of the subject varies: more accurate if
            motions recur, and about twice as slow. Cannot be combined with `training`. Requires
            "detail".
        uncertainty: compute the standard error of each vertex, in the unit of the positions. The
            frames are the same with and without. Requires "detail".
        threads: the number of threads that may work on a frame, from 1 to 256. More than one helps
            from 23 553 vertices on; smaller meshes are completed by the calling thread alone.
            Results are identical for any number of threads.
        training: complete frames of the same mesh, of this subject or one like it: an array (n, k,
            3) or any iterable of at least three frames, of which at most 75 are kept. From them,
            "detail" learns how the shape of the subject varies, which usually makes it more
            accurate. Training frames that do not describe the subject have no effect:
            `report.prior_weight` is then 0. Requires "detail".
    """

    def __init__(
        self,
        faces: Faces | Mesh,
        first_frame: Positions | Frame | None = None,
        *,
        method: Literal["motion", "detail"] = "detail",
        revisit: bool = True,
        extra_iterations: int = 0,
        disconnected: Literal["follow", "hold"] = "follow",
        noise: float | None = None,
        reject_outliers: bool = False,
        learn: bool = False,
        uncertainty: bool = False,
        threads: int = 1,
        training: Iterable[Positions] | None = None,
    ) -> None:
        given = locals()
        settings = {name: given[name] for name in Settings.__annotations__}
        super().__init__(faces, first_frame, training, Settings.__annotations__, settings)

    _create = staticmethod(_core.completer)

    def push(
        self, points: Positions | Frame, known: Mask | None = None, *, out: Positions | None = None
    ) -> Positions:
        """Completes the next frame.

        Args:
            points: positions, (k, 3) float32 or float64 with any strides. Rows that are not known
                are ignored. Or a :class:`dynmesh.Frame`, of which what it says to be observed is
                known.
            known: the known mask, (k,) bool: True for vertices that were observed. If None, rows of
                `points` that are not finite are missing, and all others are known.
            out: an array (k, 3) of the completer's dtype to which the completed frame is written,
                and which is returned. It may be `points` itself. If None, a new one is allocated.
        """
        if isinstance(points, Frame) and known is None:
            known, points = points.claimed, points.points
        mask = None if known is None else _arrays.known_mask(known)
        given = self._points("points", points)
        return self._made(out, lambda found: self._core.push(given, mask, found))

    def push_sparse(
        self, indices: Integers, points: Positions, *, out: Positions | None = None
    ) -> Positions:
        """Completes the next frame from the observed vertices only.

        Args:
            indices: the observed vertices, (n,) integers, in any order and without duplicates.
            points: their positions, (n, 3).
            out: see `push`.
        """
        observed = _arrays.indices("indices", indices)
        given = self._points("points", points, "(n, 3)")
        return self._made(out, lambda found: self._core.push_sparse(observed, given, found))

    @property
    def standard_error(self) -> NDArray[np.floating[Any]]:
        """(k,) the standard error of a coordinate of each vertex of the last frame.

        In the completer's dtype and the unit of the positions. The true positions of about 90 % of
        the estimated vertices are within 2.5 standard errors, and of half of them within 1.54. 0
        for known vertices and before the first frame, infinity for disconnected vertices; with
        `noise`, it is not 0 for known vertices. ValueError without `uncertainty`. See
        docs/method.md, "Standard errors".
        """
        return np.asarray(self._core.standard_error())

    @property
    def report(self) -> FrameReport:
        """The FrameReport of the last frame."""
        return FrameReport(**self._core.report())
