"""Tracking of a template through files of scans, in constant memory."""

import contextlib
import os
from collections.abc import Generator, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Unpack

import numpy as np

from .. import formats
from .._checks import check_flags, check_integer, check_resolution, path_of
from .._errors import locating
from .._options import Input, Method
from .._report import Report, counted, steps, tracked, write_csv
from ..alignment import Alignment
from ..completion.start import Training, TrainingFrames
from ..formats import OneSequence, PathLike
from ..formats.times import timing_of
from ..frame import Frame
from ..registration import Registration
from ..run import Run
from ..scans import ScanReader, ScanSource
from ..scans.memory import InMemory as ScansInMemory
from ..scans.memory import opened_scans
from ..topology import mean_edge_of
from ..tracker import Resolution, Tracker
from ..tracking.background import Background, Crop
from ..tracking.inputs import read_landmarks, units_of
from ..tracking.placing import Placed, placed_in, push_scan
from ..tracking.quality import Fits, FrameQuality

_NAMED = 3
"""Lost images that are named."""


@dataclass(frozen=True, kw_only=True, eq=False)
class TrackReport(Report):
    """What :func:`track` has done.

    Attributes:
        frames: number of frames.
        quality: that of the frames together of which more than hardly anything was measured: the
            best of any three that follow one another, and of nine tenths of all. A good one is
            "doubtful" if a camera is suspected, hardly anything was measured of most frames, or the
            registration is doubtful.
        seconds_per_frame: median time of the tracker, without reading and writing; None if no frame
            was tracked.
        observed: share of the vertices that had a correspondence in the scan, on average over the
            frames in which there was a scan; None if there are none.
        far: share of the points of those frames that are farther than one mean edge from the mesh;
            None if there are none.
        each: the frames with points.
        cameras: that share for each camera that saw points.
        suspects: the cameras whose share is above 0.05 and more than twice the median of the
            others, or whose points that are not far are more than three times as far from the mesh
            as the median of those of the others.
        empty: number of frames without a scan, or whose scan had no points.
        recovered: number of frames in which the mesh was lost and found again.
        lost: a sentence for each depth image that was missing or damaged; the frame was tracked
            with those of the other cameras.
        distance: of the template from the first scan, in mean edges, before it was moved.
        alignment: the rigid motion of the template that put it into the first scan; None if it lay
            there already.
        registration: of the template with the first scan, if it had another pose there.
        prior_weight: how far the shapes of the training frames were used, from 0 to 1, on average
            over the same frames; None without them.
    """

    frames: int
    seconds_per_frame: float | None = None
    observed: float | None = None
    far: float | None = None
    each: tuple[FrameQuality, ...] = ()
    cameras: Mapping[str, float] = field(default_factory=dict)
    suspects: tuple[str, ...] = ()
    empty: int = 0
    recovered: int = 0
    lost: tuple[str, ...] = ()
    distance: float | None = None
    alignment: Alignment | None = field(default=None, repr=False)
    registration: Registration | None = field(default=None, repr=False)
    prior_weight: float | None = None

    def lines(self) -> list[str]:
        """Says how the template was placed, how well it was tracked, and how fast."""
        return [*self._done(), *super().lines()]

    def _done(self) -> Iterator[str]:
        if self.registration is not None:
            yield (
                "the template did not lie in the first scan and was registered with it: "
                f"{self.registration.quality}"
            )
        if self.alignment is not None:
            result = self.alignment
            yield (
                f"the template was {result.before:.3g} mean edges from the first scan; a rigid "
                f"motion put it {result.after:.3g} from it"
            )
        if self.seconds_per_frame is not None and self.observed is not None:
            if self.quality == "good" and self.far is not None:
                yield f"good; {self.far:.2%} of the points are far from the mesh"
            yield (
                f"{counted(self.frames - self.empty, 'frame')} tracked in "
                f"{1e3 * self.seconds_per_frame:.3g} ms each (median); "
                f"{100 * self.observed:.3g} % of the vertices were seen"
            )
        if self.recovered:
            yield f"in {self.recovered} of the frames, the mesh was lost and found again"
        if self.empty:
            yield f"{self.empty} of the frames had no points"
        if n := len(self.lost):
            named = "; ".join(self.lost[:_NAMED]) + ("; ..." if n > _NAMED else "")
            yield f"{n} depth image{'s were' if n > 1 else ' was'} lost: {named}"
        if self.suspects:
            for name, share in self.cameras.items():
                yield f"camera {name}: {share:.1%} of its points are far from the mesh"
        if self.prior_weight is not None:
            yield f"the prior weight of the training frames was {self.prior_weight:.2g}"

    def write_csv(self, path: PathLike) -> None:
        """Writes a table with a row for each frame with points: how good it is."""
        write_csv(path_of("path", path), FrameQuality, self.each)


def track(
    scans: PathLike | ScansInMemory,
    *,
    template: Input[OneSequence],
    landmarks: Input[PathLike | None] = None,
    frames: Input[slice | range | None] = None,
    scan_unit: Input[float | str | None] = None,
    template_unit: Input[float | str | None] = None,
    crop: Input[Crop | str | None] = None,
    remove_planes: Input[bool] = False,
    colours: Input[PathLike | None] = None,
    recover: Method[bool] = True,
    resolution: Method[Resolution] = "best",
    training: Method[TrainingFrames | None] = None,
    threads: Method[int] = 1,
    uncertainty: Method[bool] = False,
    progress: bool | None = None,
    **of_scans: Unpack[ScanSource],
) -> Run[TrackReport] | Any:
    """Tracks a mesh through scans whose points belong to no vertex.

    The template is placed in the first scan that has points: it stays where it is if it lies there,
    or else is moved rigidly, or else, in another pose, is registered. Where a scan is missing or
    empty, the mesh is carried on; a damaged depth image counts as missing. The result is doubtful
    or probably ruined if many points are far from the mesh. Frames have a rate if
    the names of the scans are clock times; else, a conversion states it.

    Args:
        scans: point clouds (PLY, XYZ) or depth images (PNG, TIFF, OpenEXR, NPY), one file per
            frame: a folder, or a pattern such as 'depth/*.png'; or, in Python, those of
            dynmesh.scans.open_scans or that a verb makes, or a list with a scan, points (n, 3), a
            tuple of points and normals, or None for each frame.
        template: the mesh, best in the pose of the first scan.
        landmarks: a JSON file with landmarks of a template in another pose than the first scan, as
            for a registration, in the unit of the scans.
        frames: from the number of the first frame to that after the last one, such as 0:30.
        scan_unit: the unit of length of scans and cameras: m, cm, mm, km, inch, foot, yard, or a
            number of metres; else, as their files state it, or that of the template.
        template_unit: the unit of length of a template whose file states none.
        crop: leave out points outside the box x,y,z,x,y,z, or farther than this from that of the
            mesh, in the unit of the scans.
        remove_planes: whether to leave out floor and walls: planes in the first scan that are
            larger than the mesh.
        colours: track by colours as well, so that the mesh slides less along itself: "points", if
            the point clouds have them, or a folder of colour images that are registered to the
            depth images and have their numbers, or about their times.
        recover: whether to seek the mesh again in a scan in which it is lost: from the last good
            frame and, at most once in ten frames, by a registration.
        resolution: on how many vertices of the mesh it is tracked: "best", on all in the end, or a
            number, such as 2500, from which the others follow, which is faster and less accurate.
        training: complete frames of the same mesh, from which it is learned how it varies; one file
            or several.
        threads: the number of threads that may work on a frame; more than one helps from about
            2 000 vertices or points on.
        uncertainty: whether to estimate the standard error of the distance of each vertex from the
            true surface, which a file then has to hold.
        progress: whether to show on standard error how far it is.
        of_scans: how the scans are read: `cameras`, `poses`, `gaps`, `subject` and
            `least_confidence` of :func:`dynmesh.scans.open_scans`.

    Returns:
        The tracked frames with the generation and age of their vertices: of scans in memory, a
        :class:`dynmesh.Sequence`; of files, a :class:`dynmesh.frames.Run`, whose frames are made
        when they are gone through. They have a report, of which
        :meth:`~dynmesh.verbs.track.TrackReport.write_csv` writes how good each frame is.
    """
    marked = [] if landmarks is None else [path_of("landmarks", landmarks)]
    check_flags(recover=recover, uncertainty=uncertainty)
    check_resolution(resolution)
    check_integer("threads", threads, 1)
    Background(crop, remove_planes)  # which refuses what is no box
    with contextlib.ExitStack() as stack:
        reader = stack.enter_context(opened_scans(scans, frames, colours, **of_scans))
        mesh = stack.enter_context(formats.opened(template, "template"))
        path = reader.path
        units = units_of(reader, mesh, scan_unit, template_unit)
        marks = read_landmarks(marked[0]) if marked else None
        learnt = Training(training, mesh, progress)
        header = replace(
            mesh.header,
            metres_per_unit=units.template,
            n_frames=reader.n_frames,
            **{"fps": None, **timing_of(reader.numbers)},
            attributes=["generation", "age", *(["standard_error"] if uncertainty else [])],
            standard_error_of="surface",
        )

        def make() -> Generator[Frame, None, TrackReport]:
            room = Background(crop, remove_planes, units.factor)
            with formats.naming(path):
                with steps("finding the template", progress):
                    at = placed_in(reader, mesh, room, units, marks, threads)
                room.follow(at.points)
                with learnt.frames() as poses:
                    tracker = Tracker(
                        mesh.faces,
                        at.points,
                        uncertainty=uncertainty,
                        recover=recover,
                        resolution=resolution,
                        threads=threads,
                        training=poses,
                    )
                fits = Fits(
                    mean_edge=mean_edge_of(at.points, mesh.faces),
                    advice=at.advice,
                    start=at.doubt,
                )
                read = tracked(reader.frames(), reader.n_frames, "tracking", progress)
                for frame, scan in enumerate(read):
                    with locating(frame=reader.number(frame)):
                        seen = room.subject(scan)
                        points = push_scan(tracker, seen)
                    if seen is not None:
                        room.follow(points)
                    fits.add(reader, frame, tracker, is_empty=seen is None)
                    names = header.attributes
                    yield Frame(points, **{name: getattr(tracker, name) for name in names})
            return _report(fits, at, room, reader, is_trained=bool(learnt))

        run: Run[TrackReport] = Run(
            header,
            make,
            mesh,
            files=[path, *reader.files, *learnt.files, *marked],
            origin=mesh.origin,
            wanted=["standard_error"] if uncertainty else [],
            measured=path,
            close=stack.pop_all().close,
        )
    if isinstance(scans, str | os.PathLike | ScanReader):
        return run
    with run:
        return run.read()


def _report(
    fits: Fits, at: Placed, room: Background, reader: ScanReader, *, is_trained: bool
) -> TrackReport:
    reports = [frame.report for frame in fits.tracked]
    return TrackReport(
        quality=fits.quality,
        reason=fits.reason,
        remarks=(*filter(None, [room.remark]), *reader.remarks, *fits.remarks),
        frames=reader.n_frames,
        seconds_per_frame=float(np.median([each.seconds for each in reports])) if reports else None,
        observed=float(np.mean([report.seen for report in reports])) if reports else None,
        far=fits.total.share if fits.total.points else None,
        each=tuple(FrameQuality.of(frame) for frame in fits.tracked),
        cameras={name: counts.share for name, counts in fits.cameras.items()},
        suspects=fits.suspects,
        empty=fits.empty,
        recovered=sum(report.recovered for report in reports),
        lost=tuple(reader.lost),
        distance=at.distance,
        alignment=at.alignment,
        registration=at.registration,
        prior_weight=float(np.mean([report.prior_weight for report in reports]))
        if reports and is_trained
        else None,
    )
