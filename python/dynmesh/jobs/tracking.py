"""Tracking from files of scans to the file of a mesh."""

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
from ..diagnosis.surroundings import shares_in_planes
from ..files import Header, PathLike, Reader
from ..files.memory import Output
from ..registration import Landmarks, Registration, register, register_depth
from ..scans import PointScan, Scan, ScanReader
from ..scans.reader import DepthReader
from ..sequence import Positions
from .fit_table import FitTable, fit_table
from .fits import Fits
from .landmarks import read_landmarks
from .option import made_of, paths_of, takes
from .room import Room
from .start import template_of
from .track_report import TrackFileReport
from .tracking_options import Align, TrackingKeywords, TrackingOptions
from .training import Training

_MANY_FAR = 0.01
"""A frame of which fewer points are far is good, whatever these are."""

WatchScans = Callable[[Iterator[Scan | None], int], Iterator[Scan | None]]
"""Is called with the scans and their number; must pass them on."""


@takes(TrackingOptions)
def track_file(
    scans: PathLike,
    output: PathLike,
    *,
    overwrite: bool = False,
    watch: WatchScans | None = None,
    **options: Unpack[TrackingKeywords],
) -> TrackFileReport:
    """Tracks a mesh through scans and writes it to a file, in constant memory.

    The first frame of the template is placed in the first scan that has points: it stays where it
    is if it lies there, or else is moved rigidly, or else, in another pose, is registered. Each
    frame of the output is the mesh as it lies in the scan with the same number. Where a scan is
    missing or empty, the mesh is carried on; a damaged depth image counts as missing. The output
    appears under its name when it is complete; after an interruption, run it again. It states no
    frames per second: :func:`convert_file` does, and turns, scales and resamples.

    Args:
        scans: a folder, pattern or glob of point clouds (PLY, XYZ, NPY, NPZ) or depth images (PNG
            with 16 bits); see :func:`dynmesh.scans.open_scans`.
        output: path of the tracked sequence.
        template: a mesh file of any format, of which the first frame is tracked.
        landmarks: a JSON file as :func:`register_file` takes it, for a template in another pose
            than the first scan; positions in the unit of the scans.
        cameras: a file with the cameras; None means `cameras.json` beside the scans, if it exists.
        scan_unit: "m", "cm", "mm" or metres per unit of the scans and cameras; None means as their
            files state it, or else the unit of the template.
        template_unit: the same of the template; None means as its file states it.
        align: "auto" to move the template if it does not lie in the first scan.
        recover: whether a scan in which the mesh is lost is registered anew; see :class:`Tracker`.
        gaps: "lost" if frames and images whose file is missing were not observed.
        crop: a distance: points farther than this from the bounding box of the mesh in the last
            frame are left out; or x, y, z of the smaller and of the larger corner of a box: points
            outside are. In the unit of the template.
        remove_planes: whether floor and walls are left out: the planes in the first scan that are
            larger than the template.
        output_format: one of :data:`dynmesh.files.formats`; None means the format of the suffix.
        report: a CSV file to which the agreement of each frame is written, and in further rows that
            of each camera: frame, camera, the number of points that were compared, the shares that
            are far from the mesh, that are so in planes of the surroundings, and that disagree with
            the normals of the mesh, the root mean square distance of the others, and the share of
            the vertices that were seen.
        provenance: whether to write the generation and the age of every vertex; generation 0 means
            that the vertex had a correspondence in the scan; with `uncertainty`, also its standard
            error.
        overwrite: whether to replace an existing output.
        training: files with complete frames of the template's mesh, from which the tracker learns
            how it varies.
        uncertainty: whether to estimate how far each vertex may be from the true surface.
        threads: of the tracker, at least 1.
        watch: called with the scans and their number; it must pass the scans on.
        **options: those above.

    Raises:
        FileExistsError, BlockingIOError: as :func:`complete_file` raises them.
        OSError, ImportError, TypeError, ValueError: a file cannot be read or written; the template
            does not lie in the first scan, the error says how far it is; a unit is stated for the
            scans, but none for the template.
    """
    return track_into(scans, output, made_of(TrackingOptions, options), overwrite, watch=watch)


def track_into(
    scans: PathLike,
    output: PathLike,
    options: TrackingOptions,
    overwrite: bool,
    *,
    watch: WatchScans | None = None,
) -> TrackFileReport:
    """As :func:`track_file`, with an object for the options."""
    check_path("scans", scans)
    check_path("output", output)
    options = options.checked()
    check_callable("watch", watch)
    target = files.target_of(output, options.output_format)
    table_path = None if options.report is None else Path(options.report)
    files.check_suffix(options.template)
    with files.open(options.template) as mesh:
        reader = options.open(scans)
        unit, factor = options.units(reader, mesh)
        times = np.arange(reader.n_frames, dtype=np.float64) * reader.step + reader.start
        header = replace(
            mesh.header,
            metres_per_unit=unit,
            n_frames=reader.n_frames,
            fps=None,
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
        others = [*mesh.files, *reader.files, *trained.files, *landmark_files]
        target.check(overwrite=overwrite, others=others)
        _check_report(table_path, target, others)

        def tracker_at(placed: Positions) -> Tracker:
            return trained.tracker(
                placed,
                threads=options.threads,
                uncertainty=options.uncertainty,
                recover=options.recover,
            )

        with (
            fit_table(table_path, overwrite) as table,
            target.create(header, overwrite=overwrite) as writer,
            files.naming(Path(scans)),
        ):
            tracking = _Tracking(
                reader,
                mesh,
                factor,
                options.room,
                options.align,
                landmarks,
                tracker_at,
                table,
                options.rig_command(reader.path, mesh.path),
            )
            tracking.track(writer, watch)
    report = tracking.report(header)
    remarks = (*writer.remarks, *report.remarks)
    return replace(report, remarks=remarks)


class _Tracking:
    """The tracker and its scans, as the work that writes an output.

    Attributes:
        fits: of the frames that were tracked.
    """

    def __init__(
        self,
        scans: ScanReader,
        mesh: Reader,
        factor: float,
        room: Room,
        align: Align,
        landmarks: Landmarks | None,
        tracker_at: Callable[[Positions], Tracker],
        table: FitTable | None,
        judged_by: str,
    ) -> None:
        """Places the template in the first scan with points.

        `judged_by` is the command that looks at the cameras.
        """
        self._scans = scans
        self._mesh = mesh
        self._factor = factor
        self._room = room
        self._align = align
        self._landmarks = landmarks
        self._table = table
        self._advice = ""
        if isinstance(scans, DepthReader):
            self._advice = f"{judged_by} tells whether the cameras are read as they are meant"
        template = template_of(mesh)
        self.fits = Fits(mean_edge=mean_edge_of(template, mesh.faces), advice=self._advice)
        self._seconds: list[float] = []
        self._alignment: Alignment | None = None
        self._distance: float | None = None
        self._registration: Registration | None = None
        self._tracker = tracker_at(self._placed(template))
        if self._registration is not None and self._registration.quality == "doubtful":
            self.fits.registered = self._registration.reason

    def track(self, output: Output, watch: WatchScans | None) -> None:
        """Tracks and writes all frames."""
        scans = self._scans.frames()
        for at, scan in enumerate(scans if watch is None else watch(scans, self._scans.n_frames)):
            with locating(frame=self._scans.number(at)):
                points = self._push(at, scan)
            names = output.header.attributes
            output.append(points, **{name: getattr(self._tracker, name) for name in names})
        self.fits.lost = tuple(self._scans.lost)

    def report(self, header: Header) -> TrackFileReport:
        """Returns what was done."""
        fits, n = self.fits, self.fits.frames
        return TrackFileReport(
            header.n_frames,
            float(np.median(self._seconds)) if self._seconds else None,
            fits.observed / n if n else None,
            empty=fits.empty,
            recovered=fits.recovered,
            lost=fits.lost,
            alignment=self._alignment,
            distance=self._distance,
            registration=self._registration,
            far=fits.far,
            quality=fits.quality,
            reason=fits.reason,
            worst=tuple(fits.worst),
            cameras=fits.shares,
            suspects=fits.suspects,
            prior_weight=fits.prior_weight / n if n else None,
            remarks=fits.remarks,
        )

    def _push(self, at: int, scan: Scan | None) -> Positions:
        """Returns the mesh as it lies in a scan."""
        tracker = self._tracker
        if scan is not None:
            scan = self._room.without(scan.scaled(self._factor))
        if scan is None or not _has_points(scan):
            points = tracker.skip()
            self._judge(at, None, points)
            return points
        if isinstance(scan, PointScan):
            points = tracker.push(scan.points, scan.normals, viewpoints=scan.viewpoints)
        else:
            points = tracker.push_depth(scan.depth, scan.intrinsics, scan.poses)
        self._room.follow(points)
        self._seconds.append(tracker.report.seconds)
        self._judge(at, scan, points)
        return points

    def _judge(self, at: int, scan: Scan | None, points: Positions) -> None:
        """Notes how well the last frame fits."""
        tracker, sensors = self._tracker, self._tracker.agreement_of_sensors
        number = self._scans.number(at)
        cameras = self._scans.cameras_of(at)
        if len(cameras) != len(sensors):
            cameras = [str(number) for number in range(len(sensors))]
        in_planes = [0.0] * (1 + len(sensors))
        if scan is not None and tracker.report.far > _MANY_FAR:
            clouds = [scan.cloud] if isinstance(scan, PointScan) else scan.clouds
            whole, *each = shares_in_planes(self._mesh.faces, points, clouds)
            in_planes = [whole, *(each if len(each) == len(sensors) else len(sensors) * [whole])]
        if self._table is not None:
            self._table.add(number, tracker, cameras, in_planes)
        if scan is None:
            self.fits.add_empty(number)
        else:
            self.fits.add(number, tracker, cameras, in_planes)

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
            raise self._not_found(told)
        if self._landmarks is not None or not found.matches:
            registered = self._registered(points, scan)
            if registered.quality == "ruined":
                raise self._not_found(
                    f"{told}, {found.after:.3g} after the best rigid motion, and in no other pose: "
                    f"{registered.reason}; it must be the mesh of what was scanned, or landmarks "
                    "may be needed"
                )
            self._registration = registered
            self._room.follow(registered.vertices)
            return registered.vertices
        self._alignment = found
        moved = points.astype(np.float64) @ found.rotation.T + found.shift
        self._room.follow(moved)
        return moved.astype(points.dtype)

    def _not_found(self, told: str) -> InputError:
        advice = f"; {self._advice}" if self._advice else ""
        return InputError(told + advice, file=self._mesh.path)

    def _without_room(self, scan: Scan, template: Positions) -> Scan:
        """Returns the first scan without the room, which this finds.

        Raises:
            ValueError: nothing is left.
        """
        self._room.look(scan, self._mesh.faces, template)
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


def _check_report(path: Path | None, target: files.Target, others: list[Path]) -> None:
    """Refuses a report that would replace an input or the output."""
    taken = {file.resolve() for file in (*others, target.path)}
    if path is not None and path.resolve() in taken:
        raise InputError("is also an input or the output; name another file", file=path)


def _has_points(scan: Scan) -> bool:
    if isinstance(scan, PointScan):
        return len(scan.points) > 0
    return any(bool(depth.any()) for depth in scan.depth)
