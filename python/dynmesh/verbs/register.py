"""Registration from files of scans to files of meshes."""

import json
from collections import Counter
from collections.abc import Iterator, Mapping
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from .. import files
from .._checks import check_integer, check_path
from .._command import How, Output, What
from .._errors import InputError, in_one_line
from .._progress import tracked
from .._report import Report
from ..completion.start import template_of
from ..draw.page import require_page
from ..draw.register_page import page_of
from ..files import PathLike, Reader
from ..files.naming import naming
from ..files.new_output import check_output, exists_already, new_output
from ..registration import Landmarks, Registration
from ..scans import PointScan, Scan, ScanReader
from ..scans.scan import DepthScan
from ..sequence import Positions
from ..tracking.landmarks import landmark_files, landmark_remarks, landmarks_of
from ..tracking.placing import registered_with
from ..tracking.room import Crop, Room, crop_of
from ..tracking.single_scans import SomeScans, open_single, paths_of

_NAMED = 5
_MISPLACED = 0.03
"""Farther from its position than this share of the diagonal, a landmark is named."""
_MANY_EMPTY = 0.2
"""With more vertices that have no point, the sensors probably did not see them."""
_MANY_FAR = 0.05
"""With more far points, the scan probably shows other things as well."""
_OTHER_UNIT = 4
"""A scan of another unit is larger or smaller than the template by more than this."""
_TOLD = (
    *("quality", "reason", "far", "disagreeing", "empty", "hole", "overlap", "stretched"),
    *("distance", "rounds", "converged", "ambiguous", "growth"),
)
"""What a JSON file says of a result."""


@dataclass(frozen=True, eq=False)
class RegisteredScan:
    """A scan with which a template was registered.

    Attributes:
        scan: its path.
        output: of the registered mesh.
        found: the result; None if the scan failed, and nothing was written.
        reason: why the result is not good, and what to do, or why the scan failed, in a sentence;
            empty if it is good.
        has_landmarks: whether there are landmarks of this scan.
        lost: number of cameras whose depth image is missing or damaged.
    """

    scan: Path
    output: Path
    found: Registration | None
    reason: str = ""
    has_landmarks: bool = False
    lost: int = 0

    @property
    def quality(self) -> str:
        """That of the result, or "failed"."""
        return "failed" if self.found is None else self.found.quality


@dataclass(frozen=True, kw_only=True, eq=False)
class RegisterReport(Report, Mapping[Path, Registration]):
    """What :func:`register_file` has done: the registrations by the paths of the outputs.

    Attributes:
        quality: the worst of the results; "failed" if one of several scans was not registered.
        output: the file or folder that was written.
        scans: the scans, in their order.
        page: the page that was written, or None.
    """

    output: Path
    scans: tuple[RegisteredScan, ...] = field(repr=False)
    page: Path | None = None

    def __getitem__(self, output: Path) -> Registration:
        """Returns the registration that was written to this path."""
        for one in self.scans:
            if one.output == output and one.found is not None:
                return one.found
        raise KeyError(output)

    def __iter__(self) -> Iterator[Path]:
        """Yields the paths that were written."""
        return (one.output for one in self.scans if one.found is not None)

    def __len__(self) -> int:
        """Returns how many were written."""
        return sum(one.found is not None for one in self.scans)

    def lines(self) -> list[str]:
        """Says how well each scan fits."""
        several = len(self.scans) > 1
        told = []
        for one in self.scans:
            if one.found is None:
                told.append(one.reason)
                continue
            good = f"good; {one.found.far:.2%} of the points are far from the mesh"
            told.append((f"{one.output.name}: " if several else "") + (one.reason or good))
        if several:
            counts = Counter(one.quality for one in self.scans)
            told.append(", ".join(f"{n} {quality}" for quality, n in counts.items()))
        if self.page is not None:
            told.append(f"open {self.page} in a browser")
        return [*told, *self.remarks]

    def to_dict(self) -> dict[str, Any]:
        """Returns how well each scan fits, by its path, as values that JSON has."""
        return {str(one.scan): _as_dict(one) for one in self.scans}


def _as_dict(one: RegisteredScan) -> dict[str, Any]:
    if one.found is None:
        return {"quality": "failed", "reason": one.reason}
    told: dict[str, Any] = {name: getattr(one.found, name) for name in _TOLD}
    told["observed"] = float(one.found.observed.mean())
    return told | {"transform": one.found.transform.tolist()}


def register_file(
    template: PathLike,
    scan: PathLike,
    output: PathLike,
    *,
    landmarks: What[PathLike | None] = None,
    cameras: What[PathLike | None] = None,
    crop: What[Crop | str | None] = None,
    remove_planes: What[bool] = False,
    align: How[bool] = True,
    scale: How[bool] = False,
    threads: How[int] = 1,
    report: Output[PathLike | None] = None,
    page: Output[PathLike | None] = None,
    overwrite: Output[bool] = False,
    progress: bool = False,
) -> RegisterReport:
    """Registers a mesh with a scan: the same mesh, in the pose and the shape of the scan.

    With several scans, the output is a folder, in which each result is named like its scan and has
    the format of the template, and one that fails does not stop the others.

    Args:
        template: the mesh, of which the first frame is registered.
        scan: a point cloud (PLY, XYZ, NPY, NPZ) or a mesh; or several, or depth images: a folder,
            or a pattern such as 'scans/*.ply'.
        output: the registered mesh, or the folder of these.
        landmarks: a JSON file: [{"vertex": 12, "position": [x, y, z]}, ...], with positions in the
            unit of the scan; or a folder with such files, named like the scan that each is for.
        cameras: where the cameras stand; else, `cameras.json` beside the scan.
        crop: leave out points outside the box x,y,z,x,y,z, in the unit of the scan.
        remove_planes: whether to leave out floor and walls: planes in the scan that are larger than
            the template.
        align: whether to seek the rigid motion that puts the template into the scan.
        scale: whether the template may be in another unit, a power of ten of that of the scan.
        threads: the number of threads that may work.
        report: a JSON file to write with how well each scan fits.
        page: an HTML file to write with the template, each scan, and each result, coloured by the
            distance from the nearest point.
        overwrite: whether to replace existing outputs.
        progress: whether to show a bar on standard error.

    Raises:
        FileExistsError: an output exists.
        OSError, ImportError, TypeError, ValueError: a file cannot be read or written, or an
            argument is refused.
    """
    paths = {"template": template, "scan": scan, "output": output}
    for name, path in (paths | {"landmarks": landmarks, "cameras": cameras}).items():
        if path is not None or name in paths:
            check_path(name, path)
    box = crop_of(crop)
    if isinstance(box, float):
        told = f"must be two corners of a box, x,y,z,x,y,z, not {crop!r}"
        raise InputError(told, argument="crop", value=crop)
    if remove_planes and scale:
        told = "is not possible with scale, as the size of the template is not known"
        raise InputError(told, argument="remove_planes", value=True)
    check_integer("threads", threads, 1)
    if page is not None:
        require_page(scans=True)
    files.check_suffix(template)
    scans = open_single(Path(scan), cameras)
    pairs = _pairs(Path(template), scans, Path(output))
    marked = None if landmarks is None else Path(landmarks)
    beside = {".json": report, ".html": page}
    inputs = [Path(template), *scans.files, *landmark_files(marked)]
    _check_outputs(inputs, [written for _, written in pairs], beside, overwrite)
    marks = landmarks_of(marked, [scanned for scanned, _ in pairs])
    options = {"align": align, "scale": scale, "threads": threads}
    made: list[RegisteredScan] = []
    with files.open(template) as mesh:
        first = template_of(mesh)
        header = replace(
            mesh.header,
            n_frames=1,
            start=0,
            times=None,
            metres_per_unit=None if scale else mesh.header.metres_per_unit,
            has_known=False,
            has_provenance=False,
            has_standard_error=False,
        )
        rows = tracked(zip(pairs, marks, strict=True), len(pairs), "registering", progress)
        for frame, ((scanned, written), mark) in enumerate(rows):
            try:
                with naming(scanned):
                    (measured,) = scans.frames(frame, frame + 1)
                    room = Room(box, remove_planes)
                    found = _register(mesh, first, measured, mark, room, options)
            except (ValueError, TypeError, OSError) as error:  # it does not stop the others
                if scans.path.is_file():
                    raise
                made.append(RegisteredScan(scanned, written, None, in_one_line(error)))
                continue
            written.parent.mkdir(parents=True, exist_ok=True)
            with files.create(written, header) as writer:
                writer.append(found.vertices)
            lost = 0
            if isinstance(measured, DepthScan) and scans.rig is not None:
                lost = len(scans.rig.cameras) - len(measured.depth)
            reason = _advised(found, first, measured, mark, scale=scale, room=remove_planes)
            made.append(RegisteredScan(scanned, written, found, reason, mark is not None, lost))
        done = [(frame, one) for frame, one in enumerate(made) if one.found is not None]
        remarks = landmark_remarks(marked, [one.has_landmarks for one in made])
        if lossy := [f"{one.scan.name} ({one.lost})" for one in made if one.lost]:
            named = ", ".join(lossy[:_NAMED]) + (", ..." if len(lossy) > _NAMED else "")
            remarks += (f"depth images are missing or damaged: {named}",)
        qualities = [one.quality for one in made]
        result = RegisterReport(
            quality=next(
                (one for one in ("failed", "ruined", "doubtful") if one in qualities), "good"
            ),
            reason="; ".join(one.reason for one in made if one.reason),
            remarks=remarks,
            output=Path(output),
            scans=tuple(made),
            page=Path(page) if page is not None and done else None,
        )
        if report is not None:
            with new_output(Path(report), overwrite, ".json") as hidden:
                hidden.write_text(json.dumps(result.to_dict(), indent=2) + "\n")
        if result.page is not None:
            shown = page_of(
                mesh,
                first,
                SomeScans(scans, [frame for frame, _ in done]),
                [one.found for _, one in done if one.found is not None],
                [one.scan.name for _, one in done],
                Path(output),
            )
            with new_output(result.page, overwrite, ".html") as hidden:
                hidden.write_text(shown.html, encoding="utf-8")
    return result


def _register(
    mesh: Reader,
    first: Positions,
    scan: Scan | None,
    landmarks: Landmarks | None,
    room: Room,
    options: Mapping[str, Any],
) -> Registration:
    if scan is None:
        raise InputError("all of its images are missing or damaged")
    room.look(scan, mesh.faces, first)
    left = room.without(scan)
    if scan.has_points and not left.has_points:
        raise InputError(f"nothing is left of its {len(scan.cloud)} points without the room")
    return registered_with(mesh.faces, first, left, landmarks=landmarks, **options)


def _advised(
    found: Registration,
    template: Positions,
    scan: Scan | None,
    landmarks: Landmarks | None,
    *,
    scale: bool,
    room: bool,
) -> str:
    """The quality and its reason, and what to do about it."""
    if found.quality == "good":
        return ""
    advice = []
    if scan is not None and not scale:
        sizes = [float(np.linalg.norm(np.ptp(x, axis=0))) for x in (scan.cloud, template)]
        if not 1 / _OTHER_UNIT < sizes[0] / sizes[1] < _OTHER_UNIT:
            advice.append(
                f"the scan is {sizes[0] / sizes[1]:.2g} times as large as the template: give "
                "scale, if their units differ"
            )
    if found.quality == "ruined":
        advice.append("template and scan must be in one unit, which a conversion changes")
    if landmarks is None:
        advice.append("landmarks say where head, hands and feet, for example, belong")
    else:
        distances = np.linalg.norm(found.vertices[landmarks[0]] - landmarks[1], axis=1)
        worst = int(distances.argmax())
        if distances[worst] > _MISPLACED * np.linalg.norm(np.ptp(found.vertices, axis=0)):
            advice.append(
                f"look at the landmarks: vertex {landmarks[0][worst]} came to lie "
                f"{distances[worst]:.3g} from its position"
            )
    if isinstance(scan, PointScan) and scan.viewpoints is None and found.empty > _MANY_EMPTY:
        advice.append("cameras say what the sensors could not see")
    if found.far > _MANY_FAR and not room:
        advice.append("planes can be removed, such as floor and walls, and other things cropped")
    return "; ".join([f"{found.quality}: {found.reason}", *advice])


def _check_outputs(
    given: SequenceOf[Path],
    written: SequenceOf[Path],
    beside: Mapping[str, PathLike | None],
    overwrite: bool,
) -> None:
    """Refuses to replace an input, to write a file twice, or to replace one that exists."""
    existing = [path for path in written if path.exists()]
    if 0 < len(existing) < len(written) and not overwrite:
        raise InputError("exists, but others do not; overwrite makes all anew", file=existing[0])
    for path in written:
        files.check_suffix(path)
        files.target_of(path)  # refuses a format that cannot be written
    inputs = {path.resolve() for path in given}
    outputs: set[Path] = set()
    for path in [*written, *(Path(path) for path in beside.values() if path is not None)]:
        place = path.resolve()
        if place in inputs:
            raise InputError("is an input; name another output", file=path)
        if place in outputs:
            raise InputError("would be written twice; rename one of the scans", file=path)
        outputs.add(place)
        if path.exists() and not overwrite:
            raise exists_already(path)
    for suffix, other in beside.items():
        if other is not None:
            check_output(Path(other), overwrite, suffix)


def _pairs(template: Path, scans: ScanReader, output: Path) -> list[tuple[Path, Path]]:
    """The scans and their outputs."""
    if scans.path.is_file():
        return [(scans.path, output)]
    return [(path, output / f"{path.stem}{template.suffix}") for path in paths_of(scans)]
