"""Tracking of a template in raw scans: loose points, or depth images."""

from collections.abc import Iterable
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._arrays import Mask, Positions
from ._checks import check_resolution
from ._errors import InputError
from ._scan_arrays import Colours, image_arrays, scan_arrays
from ._stream import Stream
from .completer import FrameReport
from .frame import Frame
from .polygons import Faces, Mesh
from .scan import DepthScan, PointScan, Scan

__all__ = ["Agreement", "MeshInScan", "Tracker", "TrackingReport"]

Matrix: TypeAlias = NDArray[np.floating[Any] | np.integer[Any]]

Resolution: TypeAlias = Literal["best"] | int
"""On how many vertices a template is tracked; see :class:`Tracker`."""

_KINDS = {"uncertainty": bool, "recover": bool, "threads": int}


@dataclass(frozen=True, kw_only=True, eq=False)
class Agreement:
    """How well a surface explains what was measured of it.

    Attributes:
        points: how many measured points were compared with the surface. Stray points, which are far
            from the surface and sparser than others, are left out.
        far: the share of them that are farther than one mean edge of the template from the surface,
            0 to 1; NaN without points. Other things in the scan are.
        disagreeing: the share that is near the surface, but whose normal is that of another one;
            NaN without points.
        distance: the root mean square distance from the surface of those that are not far, in the
            unit of the positions; NaN without any.
    """

    points: int
    far: float
    disagreeing: float
    distance: float


@dataclass(frozen=True, kw_only=True, eq=False)
class MeshInScan(Agreement):
    """How good a mesh is that was found in a scan.

    Attributes:
        explained: of the template's surface that sensors should see, since it is measured, or faces
            one of them while nothing lies before it, the share that has a point within the noise of
            the points. Without sensors, it should be seen from all sides. If most points on it lie
            where it is too flat to the sensors, the share of the points that lie on it.
        contradicted: the share of this surface that a sensor saw through, since it measured what
            lies behind, and the share of the points on the mesh that face the other way.
        stretch: by which share of their length the edges have changed, on average, beside their
            common growth: since the first frame, or from the template. If it is large, the scan is
            of another subject.
        growth: how many times as long the edges have become, by their median.
        change: how much the edges have changed since the last frame that was not lost, as
            `stretch`.
        parted: the share of the places where components touch that came apart since then, or
            together, by more than three mean edges.
        others: the share of the points that lie on nothing of the mesh, since other things were
            measured as well. They do not make it worse.
        others_distance: their median distance from the mesh.
        noise: the standard deviation of the points about their surface; 0 if hardly any vertex has
            several.
        unexplained: of the points beside the mesh, on its side and within its outline, the share
            that is farther from it than their noise explains: four times the median distance, but
            at least a quarter of a mean edge.
        hole: the share of the template's area that is the largest connected piece without a point,
            as of a limb that was not measured, among what the sensors should see; without any,
            among all.
        overlap: the share of the template's area where another part lies as well and faces the same
            way.
        seen: the share of the vertices that have a measured point.
        lost: a vertex of the largest component that is lost, since nothing was measured where it
            should be seen and nothing holds it there; -1 if none is.
        doubt: what speaks against the mesh, as a multiple of what a good one has at most: the share
            that is not explained, divided by 0.1 or by what is usual of recent frames; or, if it is
            more, the sum of `contradicted` / 0.05, `stretch` / 0.13 and, of the template's area,
            the largest piece without a point, divided by 0.05. Until a frame is good also
            `stretch` / 0.06, and the growth by 6 %.
        leap: `change`, or how far `stretch` departs from the usual one if that is less, as a
            multiple of the largest that the recent good frames make likely; near 1, a smaller one
            if the mesh bends where it bent before, and a larger one if its last shape lies nearer
            to the points turned. The same of `parted` if `doubt` is more than 0.5, or the growth
            since then as a multiple of 6 %.
        quality: "good", "doubtful" or "ruined", probably.
        reason: why the quality is not good, in a sentence that begins with the cause; empty if it
            is.
        cause: what is probably wrong if the quality is not good: "unseen", "size", "part", "pose"
            or "place".
        misfit: `far` + `disagreeing` + `stretch`, which is least for the right one of several
            meshes in the same scan.
    """

    stretch: float
    growth: float
    explained: float
    contradicted: float
    change: float = field(repr=False)
    parted: float = field(repr=False)
    others: float
    others_distance: float
    noise: float
    doubt: float
    leap: float = field(repr=False)
    seen: float
    quality: Literal["good", "doubtful", "ruined"]
    reason: str
    misfit: float = field(repr=False)
    cause: Literal["unseen", "size", "part", "pose", "place"] = field(repr=False)
    unexplained: float = field(repr=False)
    hole: float = field(repr=False)
    overlap: float = field(repr=False)
    lost: float = field(repr=False)


@dataclass(frozen=True, kw_only=True)
class TrackingReport(MeshInScan, FrameReport):
    """Statistics of one tracked frame.

    `known` counts the observed vertices, `filled` the others of their components, `disconnected`
    those of components without any, and `iterations` how often correspondences were found. With
    training, `prior_weight` and `prior_share` are as in FrameReport, and with uncertainty,
    `standard_error` is the root mean square of those of all vertices where it is finite. See also
    MeshInScan and FrameReport.

    Attributes:
        quality: "good"; "doubtful" if `doubt` is more than 1, if less than 1 % of the vertices have
            a point, or if a component is lost; "ruined" if `leap` is more than 1, which lasts until
            the mesh is right again, `contradicted` more than 0.15, `explained` less than 0.3, or
            `stretch` more than 0.3.
        recovered: whether the template was sought elsewhere and found.
    """

    rejected: int = field(repr=False)
    recovered: bool


class Tracker(Stream):
    """Tracks a template in raw scans: loose points, or depth images.

        tracker = dynmesh.Tracker(faces, first_frame)
        for points, normals in scanner:
            frame = tracker.push(points, normals, viewpoints=cameras)

    No correspondences are needed. Each frame is found from what was measured in it and from earlier
    frames; the method is described in docs/reference/tracking.md. `push`, `push_depth` and `skip`
    return the tracked frame, an array (k, 3) with the dtype of `first_frame`, and release the GIL.
    Bad input raises ValueError, or TypeError for a wrong type, with a message that says what is
    wrong, where, and with which value. The tracker is then unchanged.

    The first scan with points must be where the template is, and is refused if it is not;
    :func:`find_alignment` and :func:`register` put it there. Later scans that are far away, and
    empty ones, count as frames in which nothing was observed, as does `skip`: the template stays.

    It may be used by one thread at a time, pickled and copied, as a Completer.

    Args:
        faces: the triangles, (m, 3) integers, other polygons, or a mesh; see Completer.
        first_frame: the template, (k, 3) float32 or float64, complete and finite, in the pose of
            the first scan.
        uncertainty: compute the standard error of each vertex, in the unit of the positions. The
            frames are the same with and without.
        recover: seek the template again in a frame in which it is lost, that is, whose quality is
            "ruined": from the last frame that is not, and, in at most one frame of
            ten, by a registration, which takes as long as `dynmesh.register`. `report.recovered`
            says whether it was found. A frame in which it stays lost is as without `recover`.
        resolution: on how many vertices of the template the iterations of a frame run. "best": on
            at most 2 500, half of them, and as many of cloth, and then on all. A number, at
            least 1: on so many, from which the others follow by their shape, which is faster, with
            larger errors; docs/reference/tracking.md has figures. A template that has no more
            vertices is tracked on all of them.
        threads: the number of threads that may work on a frame, from 1 to 256. More than one helps
            from about 2 000 vertices or points on. Results are identical for any number of threads.
        training: None, or complete frames of the same mesh, as Completer takes them, from which the
            tracker learns how the shape of the subject varies. Training frames that do not describe
            the subject have no effect: `report.prior_weight` is then 0.
    """

    def __init__(
        self,
        faces: Faces | Mesh,
        first_frame: Positions | Frame | None = None,
        *,
        uncertainty: bool = False,
        recover: bool = False,
        resolution: Resolution = "best",
        threads: int = 1,
        training: Iterable[Positions] | None = None,
    ) -> None:
        settings = {
            "uncertainty": uncertainty,
            "recover": recover,
            "resolution": resolution,
            "threads": threads,
        }
        check_resolution(resolution)
        super().__init__(faces, first_frame, training, _KINDS, settings)

    @staticmethod
    def _create(faces: Any, first_frame: Any, settings: dict[str, Any], training: Any) -> Any:
        resolution = settings["resolution"]
        vertices = 0 if isinstance(resolution, str) else resolution
        return _core.tracker(faces, first_frame, {**settings, "resolution": vertices}, training)

    def push(
        self,
        points: Positions | Scan,
        normals: Positions | None = None,
        *,
        viewpoints: Positions | None = None,
        colours: Positions | None = None,
        out: Positions | None = None,
    ) -> Positions:
        """Finds the template in a scan.

        Args:
            points: the scan, (n, 3) float32 or float64, finite, in any order and of any number, in
                the axes and the unit of the template. Or a :class:`dynmesh.scans.PointScan` or
                DepthScan, alone.
            normals: the outward normals of the points, (n, 3), of any length. A normal of 0 is not
                known, and its point agrees with any side of the surface. If None, normals are
                estimated from the nearest points, at least 12 and those within a mean edge, which
                takes longer than everything else, and turned to the viewpoints; without viewpoints
                they match either side of the surface. Points on a line, as of a line scanner, have
                none.
            viewpoints: the positions of the sensors, (c, 3), to which estimated normals turn, and
                of which `agreement_of_sensors` tells, in the axes and the unit of the template.
            colours: the colours or intensities of the points, (n, 3) or (n,), in any unit, which
                tell how the surface slides along itself. Those of the template are learned where
                each vertex is first measured, so that they should not change with light or view;
                what changes slowly along the surface, as by exposure, does not matter.
            out: an array (k, 3) of the tracker's dtype to which the tracked frame is written. If
                None, a new array is allocated.

        Returns:
            The tracked frame, (k, 3): `out`, or the new array.
        """
        if isinstance(points, DepthScan | PointScan):
            for name, given in (
                ("normals", normals), ("viewpoints", viewpoints), ("colours", colours)
            ):  # fmt: skip
                if given is not None:
                    message = f"must not be given beside a {type(points).__name__}, which has all"
                    raise InputError(message, argument=name)
        if isinstance(points, DepthScan):
            return self.push_depth(*points, colours=points.colours, out=out)
        if isinstance(points, PointScan):
            colours = points.colours
            points, normals, viewpoints = points
        arrays = scan_arrays(points, normals, viewpoints, self.dtype, colours)
        return self._made(out, lambda found: self._core.push(*arrays, found))

    def push_depth(
        self,
        depth: Positions | SequenceOf[Positions],
        intrinsics: Matrix | SequenceOf[Matrix],
        pose: Matrix | SequenceOf[Matrix],
        colours: Colours | SequenceOf[Colours] | None = None,
        *,
        out: Positions | None = None,
    ) -> Positions:
        """Finds the template in depth images.

        Several cameras of the same moment are given as lists of the same length.

        Args:
            depth: (h, w) float32 or float64: depths along the axis of the camera, in the unit of
                the template. Where nothing was measured, they are 0, NaN or infinite.
            intrinsics: (3, 3) in pixels: fx, s, cx; 0, fy, cy; 0, 0, 1. The centre of the first
                pixel is at 0, 0.
            pose: (4, 4): the rigid motion from the axes of the camera to those of the template, in
                its unit. The camera looks along its +z axis, with x to the right and y down, as in
                OpenCV.
            colours: (h, w, 3) or (h, w) uint8: the colours or intensities of the same pixels, as
                those of `push`.
            out: see `push`.

        Returns:
            The tracked frame, (k, 3).
        """
        images = image_arrays(depth, intrinsics, pose, colours)
        return self._made(out, lambda found: self._core.push_depth(images, found))

    @property
    def observed(self) -> Mask:
        """(k,) bool: whether the vertex has a measured point in the last frame."""
        return np.asarray(self._core.observed(), np.bool_)

    @property
    def standard_error(self) -> NDArray[np.floating[Any]]:
        """(k,) with `uncertainty=True`: the standard error of each vertex.

        The standard error of the distance of each vertex of the last frame from the surface, along
        its normal, in the unit of the positions: about 90 % of the vertices are within 1.645 of it,
        fewer of cloth that is not seen. The distance along the surface, which may be several times
        as large, is not included. It is infinite where no measured point is connected, and 0 before
        the first frame. Without uncertainty, ValueError is raised.
        """
        return np.asarray(self._core.standard_error())

    @property
    def report(self) -> TrackingReport:
        """The TrackingReport of the last frame."""
        return TrackingReport(**self._core.report())

    @property
    def agreement_of_sensors(self) -> list[Agreement]:
        """How well the last frame explains what each sensor measured.

        One for each image or viewpoint, in the order of the call. A point of a scan counts for the
        viewpoint that its normal turns to most. Empty before the first frame and after `restore`.
        """
        return [Agreement(**one) for one in self._core.agreement_of_sensors()]
