"""Tracking from files of scans to the file of a mesh, with support for interruptions."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Unpack

import numpy as np

from .. import files
from .._checks import check_callable, check_path
from .._core import Alignment, Tracker, find_alignment
from .._errors import InputError, locating
from ..degrade.shared import mean_edge_of
from ..diagnosis.rig_reading import turned
from ..files import Header, PathLike, Reader, Writer
from ..files.scans import PointScan, Scan, ScanReader
from ..registration import Landmarks, Registration, register, register_depth
from ..sequence import Positions
from .checkpoint import Progress, describe_job, identity
from .fits import Fits
from .option import paths_of, takes
from .registering import read_landmarks
from .resumable import ResumableOutput, check_resumable
from .rig_check import Checked
from .room import Room, crop_of
from .start import template_of
from .track_report import TrackFileReport
from .tracking_options import Align, TrackingKeywords, TrackingOptions
from .training import Training

WatchScans = Callable[[Iterator[Scan | None], int, int], Iterator[Scan | None]]
"""Is called with the scans, their number and that of those already tracked; must pass them on."""


@takes(TrackingOptions)
def track_file(
    scans: PathLike,
    output: PathLike,
    *,
    overwrite: bool = False,
    resume: bool = False,
    watch: WatchScans | None = None,
    **options: Unpack[TrackingKeywords],
) -> TrackFileReport:
    """Tracks a mesh through scans and writes it to a file, in constant memory.

    The first frame of the template is placed in the first scan that has points: it stays where it
    is if it lies there, or else is moved rigidly, or else, in another pose, is registered. Each
    frame of the output is the mesh as it lies in the scan with the same number. Where a scan is
    missing or empty, the mesh is carried on; a damaged depth image counts as missing. The output
    appears under its name when it is complete, and can be continued after an interruption, as that
    of :func:`complete_file`.

    Args:
        scans: a folder, pattern or glob of point clouds (PLY, XYZ, NPY, NPZ) or depth images (PNG
            with 16 bits); see :func:`dynmesh.files.scans.open_scans`.
        output: path of the tracked sequence.
        template: a mesh file of any format, of which the first frame is tracked.
        landmarks: a JSON file as :func:`register_file` takes it, for a template in another pose
            than the first scan; positions in the unit of the scans.
        cameras: a file with the cameras; None means `cameras.json` beside the scans, if it exists.
        scan_unit: "m", "cm", "mm" or metres per unit of the scans and cameras; None means as their
            files state it, or else the unit of the template.
        template_unit: the same of the template; None means as its file states it.
        poses: "world-to-camera" if that is what the poses of the cameras do.
        axes: "opengl" if the cameras have x right, y up, z back.
        matrices: "columns" if matrices are listed column by column; "transposed-rotations" if only
            the rotations of the poses are.
        swap_cameras: the names of two cameras of which each has the images of the other.
        depth_scale: the depth of one count in the unit of the scans, instead of that of the file.
        intrinsics_size: width and height of the images that the intrinsics are for, if others.
        turn_template: pairs of an axis, "x", "y" or "z", and degrees: turns of the template around
            the middle of its bounding box.
        check: whether to compare the first scan with the template before tracking, and to refuse
            one that fits clearly better if cameras, units or template are meant in another way.
        align: "auto" to move the template if it does not lie in the first scan.
        recover: whether a scan in which the mesh is lost is registered anew; see :class:`Tracker`.
        gaps: "lost" if frames and images whose file is missing were not observed.
        crop: a distance: points farther than this from the bounding box of the mesh in the last
            frame are left out; or x, y, z of the smaller and of the larger corner of a box: points
            outside are. In the unit of the template.
        remove_planes: whether floor and walls are left out: the planes in the first scan that are
            larger than the template.
        output_format: one of :data:`dynmesh.files.formats`; None means the format of the suffix.
        fps: frames per second of the output.
        report: a CSV file to which the agreement of each frame is written as soon as it is tracked,
            and in further rows that of each camera: frame, camera, the number of points that were
            compared, the shares that are far from the mesh and that disagree with its normals, the
            root mean square distance of the others, and the share of the vertices that were seen.
        provenance: whether to write the generation and the age of every vertex; generation 0 means
            that the vertex had a correspondence in the scan; with `uncertainty`, also its standard
            error.
        overwrite: whether to replace an existing output.
        resume: whether to continue an interrupted run of the same job; see :func:`complete_file`,
            also for what is compared if the output is complete.
        training: files with complete frames of the template's mesh, from which the tracker learns
            how it varies.
        uncertainty: whether to estimate how far each vertex may be from the true surface.
        threads: of the tracker, at least 1.
        watch: called with the scans, their number and the number of those already tracked; it must
            pass the scans on.
        **options: those above.

    Raises:
        FileExistsError, BlockingIOError, OtherJobError, CannotResumeError: as :func:`complete_file`
            raises them.
        OSError, ImportError, TypeError, ValueError: a file cannot be read or written; the template
            does not lie in the first scan, the error says how far it is; a unit is stated for the
            scans, but none for the template.
    """
    return track_into(scans, output, TrackingOptions(**options), overwrite, resume, watch=watch)


def track_into(
    scans: PathLike,
    output: PathLike,
    options: TrackingOptions,
    overwrite: bool,
    resume: bool,
    *,
    watch: WatchScans | None = None,
) -> TrackFileReport:
    """As :func:`track_file`, with an object for the options."""
    check_path("scans", scans)
    check_path("output", output)
    options = options.checked()
    check_callable("watch", watch)
    target = files.target_of(output, options.output_format)
    if resume:
        check_resumable(target)
    fits = Fits(None if options.report is None else Path(options.report))
    with files.open(options.template) as mesh:
        reader = options.open(scans)
        units = options.units(reader, mesh.header.metres_per_unit)
        reading = options.reading(units, mesh.path)
        times = np.arange(reader.n_frames, dtype=np.float64) * reader.step + reader.start
        header = replace(
            mesh.header,
            metres_per_unit=units.template,
            n_frames=reader.n_frames,
            fps=options.fps,
            start=reader.start,
            times=None if reader.step == 1 else times,
            has_known=False,
            has_provenance=options.provenance,
            has_standard_error=options.provenance and options.uncertainty,
            standard_error_of="surface",
        )
        landmark_files = [] if options.landmarks is None else [Path(options.landmarks)]
        landmarks = next((read_landmarks(file) for file in landmark_files), None)
        trained = Training(paths_of(options.training), mesh)
        start = {
            "template": list(map(identity, mesh.files)),
            "landmarks": list(map(identity, landmark_files)),
            "cameras": list(map(identity, reader.camera_files)),
            "scan_unit": units.scans,
            "template_unit": units.template,
            **options.described(),
            **trained.described(),
        }
        others = [*mesh.files, *reader.files, *trained.files, *landmark_files]
        _check_report(fits.path, target, others, replaces=overwrite or resume)
        inputs = [file for file in reader.files if file not in reader.camera_files]

        def tracker_at(placed: Positions) -> Tracker:
            return trained.tracker(
                placed,
                threads=options.threads,
                uncertainty=options.uncertainty,
                recover=options.recover,
            )

        room = Room(crop_of(options.crop), options.remove_planes)
        checked = Checked(reader, mesh, reading, units, options.check)
        tracking = _Tracking(
            reader, mesh, checked, room, options.align, landmarks, tracker_at, fits, watch
        )
        outcome = ResumableOutput(
            target,
            header,
            lambda: describe_job(inputs, header, target.format, start),
            Path(scans),
            overwrite=overwrite,
            resume=resume,
            others=others,
        ).write(tracking.begin)
    report = tracking.report(header, outcome.resumed_at)
    return replace(report, remarks=outcome.remarks, existed=outcome.existed)


class _Tracking:
    """The tracker and its scans, as the work that writes an output."""

    def __init__(
        self,
        scans: ScanReader,
        mesh: Reader,
        checked: Checked,
        room: Room,
        align: Align,
        landmarks: Landmarks | None,
        tracker_at: Callable[[Positions], Tracker],
        fits: Fits,
        watch: WatchScans | None,
    ) -> None:
        self._scans = scans
        self._mesh = mesh
        self._checked = checked
        self._factor = checked.reading.factor
        self._room = room
        self._align = align
        self._landmarks = landmarks
        self._tracker_at = tracker_at
        self._fits = fits
        self._watch = watch
        self._seconds: list[float] = []
        self._observed: list[float] = []
        self._prior_weight: list[float] = []
        self._empty = 0
        self._recovered = 0
        self._alignment: Alignment | None = None
        self._distance: float | None = None
        self._registration: Registration | None = None

    def begin(self, progress: Progress) -> "_Tracking":
        """Places the template in the first scan with points, and continues an earlier run."""
        progress.check(self._scans.n_frames, (progress.done,))
        template = template_of(self._mesh)
        if not progress.done:
            self._checked.refuse_mistakes(template)
        turned_as_asked = turned(template, self._checked.reading.turns)
        self._tracker = self._tracker_at(self._placed(turned_as_asked))
        self._done = progress.done
        progress = progress._replace(state=self._room.restored(progress.state))
        progress.restore(self._tracker, (self._done,))
        self._fits.begin(self._done)
        return self

    def steps(self, writer: Writer, folder: Path) -> Iterator[None]:  # noqa: ARG002
        """Tracks and writes the frames that are left."""
        scans = self._scans.frames(self._done)
        if self._watch is not None:
            scans = self._watch(scans, self._scans.n_frames, self._done)
        for scan in scans:
            with locating(frame=self._done):
                points = self._push(scan)
            tracker = self._tracker
            self._fits.add(self._done, tracker, self._scans.cameras_of(self._done))
            names = writer.header.attributes
            writer.append(points, **{name: getattr(tracker, name) for name in names})
            self._done += 1
            yield

    def progress(self) -> Progress:
        """Returns what a later run needs to continue."""
        return Progress(self._done, self._done, self._room.state() + self._tracker.state())

    def report(self, header: Header, resumed_at: int) -> TrackFileReport:
        """Returns what was done."""
        placed = self._registration
        doubtful = (
            placed is not None and placed.quality == "doubtful" and self._fits.quality == "good"
        )
        return TrackFileReport(
            header.n_frames,
            resumed_at,
            float(np.median(self._seconds)) if self._seconds else None,
            float(np.mean(self._observed)) if self._observed else None,
            empty=self._empty,
            recovered=self._recovered,
            lost=self._scans.lost,
            alignment=self._alignment,
            distance=self._distance,
            registration=self._registration,
            far=self._fits.far,
            quality="doubtful" if doubtful else self._fits.quality,
            worst=self._fits.worst,
            cameras=self._fits.cameras,
            suspects=self._fits.suspects,
            prior_weight=float(np.mean(self._prior_weight)) if self._prior_weight else None,
            rig=self._checked.warnings,
        )

    def _push(self, scan: Scan | None) -> Positions:
        """Returns the mesh as it lies in a scan."""
        tracker = self._tracker
        if scan is None or not _has_points(scan):
            self._empty += 1
            return tracker.skip()
        scan = self._room.without(scan.scaled(self._factor))
        if not _has_points(scan):
            self._empty += 1
            return tracker.skip()
        if isinstance(scan, PointScan):
            points = tracker.push(scan.points, scan.normals, viewpoints=scan.viewpoints)
        else:
            points = tracker.push_depth(scan.depth, scan.intrinsics, scan.poses)
        self._room.follow(points)
        self._recovered += tracker.report.recovered
        self._seconds.append(tracker.report.seconds)
        self._observed.append(float(np.mean(tracker.observed)))
        self._prior_weight.append(tracker.report.prior_weight)
        return points

    def _placed(self, points: Positions) -> Positions:
        """Returns the template where the first scan is.

        Raises:
            ValueError: it does not lie there, and is not found there in another pose.
        """
        first = next((s for s in self._scans.frames() if s is not None and _has_points(s)), None)
        if first is None:
            raise InputError("no frame has points", file=self._scans.path)
        scan = self._without_room(first.scaled(self._factor), points)
        found = find_alignment(self._mesh.faces, points, scan.cloud)
        self._distance = found.before
        if found.lies_in_scan:
            return points
        told = (
            f"the template does not lie in the first scan: it is {found.before:.3g} mean edges "
            f"({found.before * found.mean_edge:.3g} in its unit) away"
        )
        if found.other_unit:
            told += (
                f"; the scan is {found.ratio:.3g} times as large: state both units by --scan-unit "
                "and --template-unit (in Python, scan_unit= and template_unit=)"
            )
        if found.other_unit or self._align == "never":
            raise InputError(told, file=self._mesh.path)
        if self._landmarks is not None or not found.matches:
            registered = self._registered(points, scan)
            if registered.quality == "ruined":
                raise InputError(
                    f"{told}, {found.after:.3g} after the best rigid motion, and in no other pose: "
                    f"{registered.reason}; it must be the mesh of what was scanned, or landmarks "
                    f"may be needed",
                    file=self._mesh.path,
                )
            self._registration = registered
            self._room.follow(registered.vertices)
            return registered.vertices
        self._alignment = found
        moved = points.astype(np.float64) @ found.rotation.T + found.shift
        self._room.follow(moved)
        return moved.astype(points.dtype)

    def _without_room(self, scan: Scan, template: Positions) -> Scan:
        """Returns the first scan without the room, which this finds.

        Raises:
            ValueError: nothing is left.
        """
        self._room.follow(template)
        size = np.linalg.norm(self._room.box[1] - self._room.box[0])
        self._room.find(scan, mean_edge_of(template, self._mesh.faces), float(size))
        left = self._room.without(scan)
        if not _has_points(left):
            raise InputError(
                "nothing is left of the first scan without floor, walls and what is cropped; is "
                "the subject in it?",
                file=self._scans.path,
            )
        return left

    def _registered(self, points: Positions, scan: Scan) -> Registration:
        """Finds the template in the first scan, in any pose."""
        landmarks = self._landmarks
        if landmarks is not None:
            landmarks = landmarks[0], landmarks[1] * self._factor
        if isinstance(scan, PointScan):
            return register(
                self._mesh.faces,
                points,
                scan.points,
                scan.normals,
                viewpoints=scan.viewpoints,
                landmarks=landmarks,
            )
        return register_depth(self._mesh.faces, points, *scan, landmarks=landmarks)


def _check_report(
    path: Path | None, target: files.Target, others: list[Path], *, replaces: bool
) -> None:
    """Refuses a report that would replace an input, the output, or an older file unasked."""
    if path is None:
        return
    taken = {file.resolve() for file in (*others, target.path)}
    if path.resolve() in taken:
        raise InputError("is also an input or the output; name another file", file=path)
    if path.exists() and not replaces:
        raise FileExistsError(17, "exists; --overwrite replaces it", str(path))


def _has_points(scan: Scan) -> bool:
    if isinstance(scan, PointScan):
        return len(scan.points) > 0
    return any(bool(depth.any()) for depth in scan.depth)
