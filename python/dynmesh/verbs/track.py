"""Tracking from files of scans to the file of a mesh, in constant memory."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from .. import files
from .._checks import check_flags, check_integer, check_path
from .._command import How, Output, What
from .._errors import locating
from .._progress import steps, tracked
from .._report import OutputReport, counted, write_csv
from ..completion.training import Training, TrainingFiles, paths_of
from ..degrade.shared import mean_edge_of
from ..files import PathLike
from ..files.format import Gaps
from ..files.new_output import check_output, new_output
from ..files.numbered import Number
from ..files.times import timing_of
from ..registration import Registration
from ..scans import open_scans
from ..scans.reader import DepthReader
from ..tracker import Alignment, Tracker
from ..tracking.fits import Fits, FrameQuality
from ..tracking.landmarks import read_landmarks
from ..tracking.placing import placed_in, push_scan
from ..tracking.room import Crop, Room
from ..tracking.units import units_of

_NAMED = 3
"""Lost images that are named."""

_LOOK = "dynmesh rig {} --template {} tells whether the cameras are read as they are meant"


@dataclass(frozen=True, kw_only=True, eq=False)
class TrackFileReport(OutputReport):
    """What :func:`track_file` has done: it wrote `frames` frames to the file `output`.

    Attributes:
        quality: that of the frames together of which more than hardly anything was measured: the
            best of any three that follow one another, and of nine tenths of all. A good one is
            "doubtful" if a camera is suspected, hardly anything was measured of most frames, the
            registration is doubtful, or the points of cameras lie beside the template in the first
            scan and a small error of a camera, or of the size, explains it.
        seconds_per_frame: median time of the tracker, without reading and writing; None if no frame
            was tracked.
        observed: share of the vertices that had a correspondence in the scan, on average over the
            frames in which there was a scan; None if there are none.
        far: share of the points of those frames that are farther than one mean edge from the mesh;
            None if there are none.
        worst: the frames that are not good, at most five, the worst one first, each with its
            number, that of its file, and its share.
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

    seconds_per_frame: float | None = None
    observed: float | None = None
    far: float | None = None
    worst: tuple[tuple[Number, float], ...] = ()
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
            found = self.alignment
            yield (
                f"the template was {found.before:.3g} mean edges from the first scan; a rigid "
                f"motion put it {found.after:.3g} from it"
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


def track_file(
    scans: PathLike,
    output: PathLike,
    *,
    template: What[PathLike],
    landmarks: What[PathLike | None] = None,
    cameras: What[PathLike | None] = None,
    scan_unit: What[float | str | None] = None,
    template_unit: What[float | str | None] = None,
    gaps: What[Gaps] = "refuse",
    crop: What[Crop | str | None] = None,
    remove_planes: What[bool] = False,
    recover: How[bool] = True,
    training: How[TrainingFiles | None] = None,
    threads: How[int] = 1,
    uncertainty: Output[bool] = False,
    provenance: Output[bool] = False,
    csv: Output[PathLike | None] = None,
    overwrite: Output[bool] = False,
    progress: bool = False,
) -> TrackFileReport:
    """Tracks a mesh through scans whose points belong to no vertex.

    The template is placed in the first scan that has points: it stays where it is if it lies there,
    or else is moved rigidly, or else, in another pose, is registered. Where a scan is missing or
    empty, the mesh is carried on; a damaged depth image counts as missing. The result is doubtful
    or probably ruined if many points are far from the mesh. It states no frames per second; a
    conversion does.

    Args:
        scans: point clouds (PLY, XYZ) or depth images (16-bit PNG), one file per frame: a
            folder, or a pattern such as 'depth/*.png'.
        output: the tracked sequence.
        template: the mesh, best in the pose of the first scan.
        landmarks: a JSON file with landmarks of a template in another pose than the first scan, as
            for a registration, in the unit of the scans.
        cameras: poses and intrinsics of the cameras, required for depth images; else,
            `cameras.json` beside the scans.
        scan_unit: the unit of length of scans and cameras: m, cm, mm, km, inch, foot, yard, or a
            number of metres; else, as their files state it, or that of the template.
        template_unit: the unit of length of a template whose file states none.
        gaps: what frames and images are whose file is missing: "refuse" makes them an error, "lost"
            what was not observed.
        crop: leave out points outside the box x,y,z,x,y,z, or farther than this from that of the
            mesh, in the unit of the template.
        remove_planes: whether to leave out floor and walls: planes in the first scan that are
            larger than the mesh.
        recover: whether to seek the mesh again in a scan in which it is lost: from the last good
            frame and, at most once in ten frames, by a registration.
        training: complete frames of the same mesh, from which it is learned how it varies; one file
            or several.
        threads: the number of threads that may work on a frame; more than one helps from about
            7 000 vertices or points on.
        uncertainty: whether to write the standard error of the distance of each vertex from the
            true surface; implies `provenance`.
        provenance: whether to write how many edges each vertex is from one that was seen
            (generation), and for how many frames it was not seen (age).
        csv: a file to write with a row for each frame with points: how good it is.
        overwrite: whether to replace existing outputs.
        progress: whether to show on standard error how far it is.

    Raises:
        FileExistsError: the output exists.
        BlockingIOError: another process is writing it.
        OSError, ImportError, TypeError, ValueError: a file cannot be read or written, an argument
            is refused, or the template is not found in the first scan.
    """
    for name, path in (("scans", scans), ("output", output), ("template", template)):
        check_path(name, path)
    for name, given in (("landmarks", landmarks), ("cameras", cameras)):
        if given is not None:
            check_path(name, given)
    check_flags(recover=recover, uncertainty=uncertainty, provenance=provenance)
    check_integer("threads", threads, 1)
    room = Room(crop, remove_planes)
    training_files = paths_of(training)
    target = files.target_of(output)
    target.check(overwrite=overwrite)
    if csv is not None:
        check_path("csv", csv)
        check_output(Path(csv), overwrite, ".csv")
    provenance = provenance or uncertainty
    target.check_holds(["generation"] if provenance else [])
    with files.open(template) as mesh:
        reader = open_scans(scans, cameras=cameras, gaps=gaps)
        units = units_of(reader, mesh, scan_unit, template_unit)
        look = _LOOK.format(scans, template) if isinstance(reader, DepthReader) else ""
        marks = None if landmarks is None else read_landmarks(Path(landmarks))
        learnt = Training(training_files, mesh, progress)
        own = [] if landmarks is None else [Path(landmarks)]
        inputs = [*mesh.files, *reader.files, *learnt.files, *own]
        target.check(overwrite=overwrite, others=inputs)
        header = replace(
            mesh.header,
            metres_per_unit=units.template,
            n_frames=reader.n_frames,
            fps=None,
            **timing_of(reader.numbers),
            has_known=False,
            has_provenance=provenance,
            has_standard_error=uncertainty,
            standard_error_of="surface",
        )
        with (
            target.create(header, overwrite=overwrite) as writer,
            files.naming(Path(scans)),
        ):
            with steps("finding the template", progress):
                at = placed_in(reader, mesh, room, units, marks, look, threads)
            room.follow(at.points)
            with learnt.frames() as frames:
                tracker = Tracker(
                    mesh.faces,
                    at.points,
                    uncertainty=uncertainty,
                    recover=recover,
                    threads=threads,
                    training=frames,
                )
            fits = Fits(
                mean_edge=mean_edge_of(at.points, mesh.faces),
                advice=at.advice,
                start=at.doubt,
            )
            read = tracked(reader.frames(), reader.n_frames, "tracking", progress)
            for frame, scan in enumerate(read):
                with locating(frame=reader.number(frame)):
                    seen = room.subject(scan, units.factor)
                    points = push_scan(tracker, seen)
                if seen is not None:
                    room.follow(points)
                fits.add(reader, frame, tracker, is_empty=seen is None)
                names = header.attributes
                writer.append(points, **{name: getattr(tracker, name) for name in names})
    reports = [one.report for one in fits.tracked]
    each = tuple(FrameQuality.of(one) for one in fits.tracked)
    if csv is not None:
        with new_output(Path(csv), overwrite, ".csv") as made:
            write_csv(made, FrameQuality, each)
    return TrackFileReport(
        quality=fits.quality,
        reason=fits.reason,
        remarks=(*filter(None, [at.remark, room.remark]), *writer.remarks, *fits.remarks),
        output=Path(output),
        frames=header.n_frames,
        seconds_per_frame=float(np.median([one.seconds for one in reports])) if reports else None,
        observed=float(np.mean([one.seen for one in reports])) if reports else None,
        far=fits.total.share if fits.total.points else None,
        worst=tuple((one.number, one.report.far) for one in fits.worst),
        each=each,
        cameras={name: one.share for name, one in fits.cameras.items()},
        suspects=fits.suspects,
        empty=fits.empty,
        recovered=sum(one.recovered for one in reports),
        lost=tuple(reader.lost),
        distance=at.distance,
        alignment=at.alignment,
        registration=at.registration,
        prior_weight=float(np.mean([one.prior_weight for one in reports]))
        if reports and training_files
        else None,
    )
