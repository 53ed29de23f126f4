"""Registration from files of scans to files of meshes."""

import json
from collections.abc import Iterator
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Unpack

from .. import files
from .._checks import check_path
from .._errors import InputError, in_one_line
from ..draw.page import require_page
from ..files import PathLike, Reader
from ..files.new_output import check_output, exists_already, new_output
from ..files.scans import Scan, ScanReader
from ..frames.naming import naming
from ..frames.scan import DepthScan
from ..registration import Landmarks, Registration, register_depth
from ..registration import register as register_points
from ..sequence import Positions
from .landmarks import landmark_files, landmark_remarks, landmarks_of
from .option import made_of, takes
from .register_advice import advised
from .register_options import RegisterKeywords, RegisterOptions
from .register_page import page_of
from .room import Room, crop_of
from .single_scans import SomeScans, open_single, paths_of
from .start import template_of

_NAMED = 5


@dataclass(frozen=True)
class RegisteredFile:
    """A scan with which a template was registered.

    Attributes:
        scan: its path.
        output: of the registered mesh.
        found: the result; None if the scan failed, and nothing was written.
        reason: its quality, why it is not good, and what to do, in a sentence; empty if it is. Or
            why the scan failed, in one line.
        has_landmarks: whether there are landmarks of this scan.
        lost: number of cameras whose depth image is missing or damaged.
    """

    scan: Path
    output: Path
    found: Registration | None
    reason: str = ""
    has_landmarks: bool = False
    lost: int = 0


@takes(RegisterOptions)
def register_file(
    template: PathLike,
    scan: PathLike,
    output: PathLike,
    *,
    overwrite: bool = False,
    **options: Unpack[RegisterKeywords],
) -> dict[Path, Registration]:
    """Registers a mesh with the scan of a file, or with each scan of a folder, and writes it.

    Args:
        template: a mesh file of any format; its first frame is registered.
        scan: a point cloud (PLY, XYZ, NPY, NPZ), a mesh of any format, whose vertices are the
            points, or a folder, pattern or glob of these or of depth images, of which those with
            one number are one scan.
        cameras: a file with the cameras; None means `cameras.json` beside the scans, if it exists.
        output: path of the registered mesh; for several scans a folder, in which each result
            is named like its scan and has the format of the template.
        landmarks: a JSON file, ``[{"vertex": 12, "position": [x, y, z]}, ...]``, with the positions
            in the unit of the scan, for all scans; or a folder with such files, named like the
            scan that each is for, as `scan_001.json`. Scans without one are registered without.
        align: whether the rigid motion that puts the template into the scan is sought.
        scale: whether the template may have another size than what was scanned, as in another unit.
        crop: two corners of a box, x, y, z, x, y, z, in the unit of the scan; points outside are
            left out.
        remove_planes: whether floor and walls are left out: the planes in the scan that are larger
            than the template.
        threads: the number of threads that may work.
        report: path of a JSON file with how well each scan fits, or why it failed.
        page: path of an HTML page with the template, moved into each scan without a rotation, the
            scan, and the result, coloured by the distance from the nearest point; scans that
            failed are left out.
        overwrite: whether to replace existing outputs.
        **options: those above.

    Returns:
        The registrations by the paths of the outputs.

    Raises:
        FileExistsError: an output exists.
        OSError, ImportError, TypeError, ValueError: a file cannot be read or written, or an option
            is refused. If only some of several scans fail, the results of the others are written
            before.
    """
    made = [*register_each(template, scan, output, made_of(RegisterOptions, options), overwrite)]
    refuse_failed(made, Path(scan))
    return {one.output: one.found for one in made if one.found is not None}


def register_each(
    template: PathLike,
    scan: PathLike,
    output: PathLike,
    options: RegisterOptions,
    overwrite: bool,
) -> Iterator[RegisteredFile]:
    """As :func:`register_file`, one result after another, with an object for the options.

    One of several scans that fails stops no other; its result says why.
    """
    for name, path in (("template", template), ("scan", scan), ("output", output)):
        check_path(name, path)
    options.check()
    if options.page is not None:
        require_page(scans=True)
    scans = open_single(Path(scan), options.cameras)
    files.check_suffix(template)
    pairs = _pairs(Path(template), scans, Path(output))
    marked = None if options.landmarks is None else Path(options.landmarks)
    _check_outputs(
        [Path(template), *scans.files, *landmark_files(marked)], pairs, options, overwrite
    )
    landmarks = landmarks_of(marked, [scanned for scanned, _ in pairs])
    told: dict[str, Any] = {}
    results: dict[int, Registration] = {}
    with files.open(template) as mesh:
        first = template_of(mesh)
        header = replace(
            mesh.header,
            n_frames=1,
            start=0,
            times=None,
            metres_per_unit=None if options.scale else mesh.header.metres_per_unit,
            has_known=False,
            has_provenance=False,
            has_standard_error=False,
        )
        for frame, (scanned, written) in enumerate(pairs):
            marks, found, reason, lost = landmarks[frame], None, "", 0
            try:
                with naming(scanned):
                    (measured,) = scans.frames(frame, frame + 1)
                    found = _register(mesh, first, measured, marks, options)
            except Exception as error:  # no error may stop the other scans
                if scans.path.is_file():
                    raise
                reason = in_one_line(error)
                told[str(scanned)] = {"quality": "failed", "reason": reason}
            if found is not None:
                if isinstance(measured, DepthScan) and scans.rig is not None:
                    lost = len(scans.rig.cameras) - len(measured.depth)
                written.parent.mkdir(parents=True, exist_ok=True)
                with files.create(written, header) as writer:
                    writer.append(found.vertices)
                told[str(scanned)] = _told(found)
                reason = advised(found, first, measured, marks, options)
                if options.page is not None:
                    results[frame] = found
            yield RegisteredFile(scanned, written, found, reason, marks is not None, lost)
        if options.report is not None:
            with new_output(Path(options.report), overwrite, ".json") as hidden:
                hidden.write_text(json.dumps(told, indent=2) + "\n")
        if options.page is not None and results:
            shown = [pairs[frame][0].name for frame in results]
            some = SomeScans(scans, [*results])
            made = page_of(mesh, first, some, [*results.values()], shown, Path(output))
            with new_output(Path(options.page), overwrite, ".html") as hidden:
                hidden.write_text(made.html, encoding="utf-8")


def refuse_failed(made: SequenceOf[RegisteredFile], scan: Path) -> None:
    """Raises an error that names the scans that failed, if there are any."""
    failed = [one.reason for one in made if one.found is None]
    if failed:
        raise InputError(
            f"{len(failed)} of {len(made)} scans failed: {'; '.join(failed)}", file=scan
        )


def remarks_on(made: SequenceOf[RegisteredFile], options: RegisterOptions) -> tuple[str, ...]:
    """What else the user should know of the results."""
    path = None if options.landmarks is None else Path(options.landmarks)
    remarks = landmark_remarks(path, [one.has_landmarks for one in made])
    if lost := [f"{one.scan.name} ({one.lost})" for one in made if one.lost]:
        named = ", ".join(lost[:_NAMED]) + (", ..." if len(lost) > _NAMED else "")
        remarks += (f"depth images are missing or damaged: {named}",)
    return remarks


def _register(
    mesh: Reader,
    first: Positions,
    scan: Scan | None,
    landmarks: Landmarks | None,
    options: RegisterOptions,
) -> Registration:
    if scan is None:
        raise ValueError("all of its images are missing or damaged")
    room = Room(crop_of(options.crop), options.remove_planes)
    room.look(scan, mesh.faces, first)
    n_points = len(scan.cloud)
    scan = room.without(scan)
    if n_points > 0 and len(scan.cloud) == 0:
        raise ValueError(f"crop and remove_planes leave none of its {n_points} points")
    asked: dict[str, Any] = {
        "landmarks": landmarks,
        "align": options.align,
        "scale": options.scale,
        "threads": options.threads,
    }
    if isinstance(scan, DepthScan):
        images = scan.depth, scan.intrinsics, scan.poses
        return register_depth(mesh.faces, first, *images, **asked)
    asked["viewpoints"] = scan.viewpoints
    return register_points(mesh.faces, first, scan.points, scan.normals, **asked)


def _check_outputs(
    given: list[Path], pairs: list[tuple[Path, Path]], options: RegisterOptions, overwrite: bool
) -> None:
    """Refuses to replace an input, to write a file twice, or to replace one that exists."""
    existing = [written for _, written in pairs if written.exists()]
    if 0 < len(existing) < len(pairs) and not overwrite:
        raise InputError("exists, but others do not; --overwrite makes all anew", file=existing[0])
    inputs = {path.resolve() for path in given}
    outputs: set[Path] = set()
    beside = [Path(path) for path in (options.report, options.page) if path is not None]
    for _, written in pairs:
        files.check_suffix(written)
        files.target_of(written)  # refuses a format that cannot be written
    for written in [*(written for _, written in pairs), *beside]:
        place = written.resolve()
        if place in inputs:
            raise InputError("is an input; name another output", file=written)
        if place in outputs:
            raise InputError("would be written twice; rename one of the scans", file=written)
        outputs.add(place)
        if written.exists() and not overwrite:
            raise exists_already(written)
    if options.page is not None:
        check_output(Path(options.page), overwrite, ".html")
    if options.report is not None:
        check_output(Path(options.report), overwrite, ".json")


def _pairs(template: Path, scans: ScanReader, output: Path) -> list[tuple[Path, Path]]:
    """The scans and their outputs."""
    if scans.path.is_file():
        return [(scans.path, output)]
    return [(path, output / f"{path.stem}{template.suffix}") for path in paths_of(scans)]


def _told(found: Registration) -> dict[str, Any]:
    """What a report says."""
    return {
        "quality": found.quality,
        "reason": found.reason,
        "far": found.far,
        "hole": found.hole,
        "overlap": found.overlap,
        "distance": found.distance,
        "rounds": found.rounds,
        "converged": found.converged,
        "growth": found.growth,
        "observed": float(found.observed.mean()),
        "transform": found.transform.tolist(),
    }
