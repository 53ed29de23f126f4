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
from ..files import Header, PathLike, Reader, Writer
from ..files.scans import PointScan, Scan, ScanReader, given_unit, open_scans
from ..sequence import Positions
from .checkpoint import Progress, describe_job, identity
from .option import paths_of, takes
from .resumable import ResumableOutput, check_resumable
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

    The first frame of the template is placed in the first scan that has points. Each frame of the
    output is the mesh as it lies in the scan with the same number. Where a scan is missing or
    empty, the mesh is carried on. The output appears under its name when it is complete, and can be
    continued after an interruption, as that of :func:`complete_file`.

    Args:
        scans: a folder, pattern or glob of point clouds (PLY, XYZ, NPY, NPZ) or depth images (PNG
            with 16 bits); see :func:`dynmesh.files.scans.open_scans`.
        output: path of the tracked sequence.
        template: a mesh file of any format; its first frame has about the pose of the first scan.
        cameras: a file with the cameras; None means `cameras.json` beside the scans, if it exists.
        scan_unit: "m", "cm", "mm" or metres per unit of the scans and cameras; None means as their
            files state it, or else the unit of the template.
        template_unit: the same of the template; None means as its file states it.
        align: "auto" to try a rigid motion if the template does not lie in the first scan.
        gaps: "lost" if frames and images whose file is missing were not observed.
        output_format: one of :data:`dynmesh.files.formats`; None means the format of the suffix.
        fps: frames per second of the output.
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
    with files.open(options.template) as mesh:
        reader = open_scans(scans, cameras=options.cameras, gaps=options.gaps)
        scan_unit = _unit("scan_unit", options.scan_unit, reader.metres_per_unit)
        stated = mesh.header.metres_per_unit
        template_unit = _unit("template_unit", options.template_unit, stated)
        factor = _factor(scan_unit, template_unit, mesh)
        times = np.arange(reader.n_frames, dtype=np.float64) * reader.step + reader.start
        header = replace(
            mesh.header,
            metres_per_unit=template_unit,
            n_frames=reader.n_frames,
            fps=options.fps,
            start=reader.start,
            times=None if reader.step == 1 else times,
            has_known=False,
            has_provenance=options.provenance,
            has_standard_error=options.provenance and options.uncertainty,
            standard_error_of="surface",
        )
        trained = Training(paths_of(options.training), mesh)
        start = {
            "template": list(map(identity, mesh.files)),
            "cameras": list(map(identity, reader.camera_files)),
            "scan_unit": scan_unit,
            "template_unit": template_unit,
            **options.described(),
            **trained.described(),
        }
        inputs = [file for file in reader.files if file not in reader.camera_files]

        def tracker_at(placed: Positions) -> Tracker:
            return trained.tracker(placed, threads=options.threads, uncertainty=options.uncertainty)

        tracking = _Tracking(reader, mesh, factor, options.align, tracker_at, watch)
        outcome = ResumableOutput(
            target,
            header,
            lambda: describe_job(inputs, header, target.format, start),
            Path(scans),
            overwrite=overwrite,
            resume=resume,
            others=[*mesh.files, *reader.files, *trained.files],
        ).write(tracking.begin)
    report = tracking.report(header, outcome.resumed_at)
    return replace(report, remarks=outcome.remarks, existed=outcome.existed)


class _Tracking:
    """The tracker and its scans, as the work that writes an output."""

    def __init__(
        self,
        scans: ScanReader,
        mesh: Reader,
        factor: float,
        align: Align,
        tracker_at: Callable[[Positions], Tracker],
        watch: WatchScans | None,
    ) -> None:
        self._scans = scans
        self._mesh = mesh
        self._factor = factor
        self._align = align
        self._tracker_at = tracker_at
        self._watch = watch
        self._seconds: list[float] = []
        self._observed: list[float] = []
        self._prior_weight: list[float] = []
        self._empty = 0
        self._alignment: Alignment | None = None
        self._distance: float | None = None

    def begin(self, progress: Progress) -> "_Tracking":
        """Places the template in the first scan with points, and continues an earlier run."""
        progress.check(self._scans.n_frames, (progress.done,))
        self._tracker = self._tracker_at(self._placed(template_of(self._mesh)))
        self._done = progress.done
        progress.restore(self._tracker, (self._done,))
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
            names = writer.header.attributes
            writer.append(points, **{name: getattr(tracker, name) for name in names})
            self._done += 1
            yield

    def progress(self) -> Progress:
        """Returns what a later run needs to continue."""
        return Progress(self._done, self._done, self._tracker.state())

    def report(self, header: Header, resumed_at: int) -> TrackFileReport:
        """Returns what was done."""
        return TrackFileReport(
            header.n_frames,
            resumed_at,
            float(np.median(self._seconds)) if self._seconds else None,
            float(np.mean(self._observed)) if self._observed else None,
            self._empty,
            self._alignment,
            self._distance,
            prior_weight=float(np.mean(self._prior_weight)) if self._prior_weight else None,
        )

    def _push(self, scan: Scan | None) -> Positions:
        """Returns the mesh as it lies in a scan."""
        tracker = self._tracker
        if scan is None or not _has_points(scan):
            self._empty += 1
            return tracker.skip()
        scan = scan.scaled(self._factor)
        if isinstance(scan, PointScan):
            points = tracker.push(scan.points, scan.normals, viewpoints=scan.viewpoints)
        else:
            points = tracker.push_depth(scan.depth, scan.intrinsics, scan.poses)
        self._seconds.append(tracker.report.seconds)
        self._observed.append(float(np.mean(tracker.observed)))
        self._prior_weight.append(tracker.report.prior_weight)
        return points

    def _placed(self, points: Positions) -> Positions:
        """Returns the template where the first scan is.

        Raises:
            ValueError: it does not lie there, and no rigid motion puts it there.
        """
        first = next((s for s in self._scans.frames() if s is not None and _has_points(s)), None)
        if first is None:
            raise InputError("no frame has points", file=self._scans.path)
        cloud = first.scaled(self._factor).cloud
        found = find_alignment(self._mesh.faces, points, cloud)
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
        doubt = self._scans.doubt()
        doubt = f"; {doubt}" if doubt else ""
        if found.other_unit or self._align == "never":
            raise InputError(told + doubt, file=self._mesh.path)
        if not found.matches:
            raise InputError(
                f"{told}, and {found.after:.3g} mean edges after the best rigid motion; it must be "
                f"the mesh of what was scanned, in the pose of the first scan{doubt}",
                file=self._mesh.path,
            )
        self._alignment = found
        moved = points.astype(np.float64) @ found.rotation.T + found.shift
        return moved.astype(points.dtype)


def _has_points(scan: Scan) -> bool:
    if isinstance(scan, PointScan):
        return len(scan.points) > 0
    return any(bool(depth.any()) for depth in scan.depth)


def _unit(name: str, given: str | float | None, stated: float | None) -> float | None:
    """Returns the metres in a unit; None if neither the option nor the file says."""
    return stated if given is None else given_unit(name, given)


def _factor(ours: float | None, theirs: float | None, mesh: Reader) -> float:
    """Returns the length of the unit of the scans in that of the template."""
    if ours is None:
        return 1.0
    if theirs is None:
        raise InputError(
            f"states no unit, but the scans are in units of {ours:g} m: --template-unit m, cm or "
            "mm (in Python, template_unit=) says what it is",
            file=mesh.path,
        )
    return ours / theirs
