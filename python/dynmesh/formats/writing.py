"""Writing of frames: a file that appears only when it is complete.

Until then, everything is in a hidden folder beside it, in which no other process writes. After an
exception, or if frames are missing, the file does not appear.
"""

from collections.abc import Generator, Iterator
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import Positions, as_mask
from .._checks import check_flags, path_of
from .._errors import InputError, KindError, locating, naming
from .._report import OutputReport, Report, counted, listed, some_of
from ..frame import Frame, Frames, check_any, checked
from ..header import ATTRIBUTES, TEXTURE, Header
from ..polygons import Faces
from ..sequence import InMemory, as_sequence
from .format import STATED, Format, not_written
from .names import check_one_file, names_to_write
from .output import (
    blaming,
    bytes_of,
    check_folder,
    check_space,
    identity,
    making,
    move,
    refuse_existing,
    refuse_inputs,
)
from .table import FORMATS, PathLike, format_of_output, named_like


class Place:
    """Where frames are written.

    Attributes:
        made: the path, or the pattern of the files of the frames.
    """

    def __init__(self, path: Path, header: Header, format: Format, overwrite: bool) -> None:
        """Finds the files; with `overwrite`, they are replaced."""
        self._path, self._header, self._format = path, header, format
        self._overwrite, self._names, self.made = overwrite, None, path
        if format.is_per_frame:
            self._names = names_to_write(path, format.suffixes[0])
            self.made = self._names.folder / self._names.pattern
        else:
            check_one_file(path)

    def existing(self) -> list[Path]:
        """The files that exist of those that may be replaced or removed."""
        if self._names is not None and self._names.numbered:
            return [*self._names.existing().values()]
        if self._format.existing is not None:
            return self._format.existing(self._path, self._header)
        return [self._path] if self._path.exists() else []

    def refuse_existing(self) -> None:
        """Raises an OSError if one of these files, or what stands at the path, is to stay."""
        numbered = self._names is not None and self._names.numbered
        for file in [*self.existing(), *([] if numbered else [self._path])]:
            refuse_existing(file, self._overwrite)

    def check(self, frames: Frames) -> None:
        """Refuses to replace files from which frames are read, or, unless asked to, any."""
        check_folder(self._path)
        self._check_not_among(frames)
        if existing := self.existing():
            refuse_inputs(existing, frames.files)
        self.refuse_existing()

    def _check_not_among(self, frames: Frames) -> None:
        """Refuses to write frames into the folder whose files are read as frames."""
        beside, suffix = self.made.parent, self.made.suffix.lower()
        name = self.made.name if self._names is None else self._names.name(self._header.start)
        pattern = frames.path
        is_read = fnmatchcase(name, pattern.name) and pattern.name != name
        read = {one for one in (frames.path, *frames.files) if one.is_dir()}
        read |= {pattern.parent} if is_read else set()
        # A folder that holds frames in two formats could not be read any more.
        affected = {one.parent for one in frames.files if one.suffix.lower() == suffix}
        affected |= read if self._format.is_per_frame else set()
        if (
            beside.is_dir()
            and identity(beside) in map(identity, read)
            and identity(beside) in map(identity, filter(Path.is_dir, affected))
            and not set(self.existing()) & set(frames.files)
        ):
            raise InputError(
                "is in the folder of the input, whose files would then not be those of one "
                "sequence; write to another folder",
                file=self._path,
            )

    def fill(self, folder: Path) -> list[str]:
        """Moves the files of a folder where they belong; says which older files it removed."""
        new = sorted(folder.iterdir(), key=self._order)
        places = {file: self.made.with_name(file.name) for file in new}
        for place in places.values():
            refuse_existing(place, self._overwrite)
        outdated = [file for file in self.existing() if file not in places.values()]
        move(places, outdated)
        if not outdated:
            return []
        names = some_of([file.name for file in outdated], 3)
        return [f"older files that no new ones replace are removed ({len(outdated)}): {names}"]

    def _order(self, file: Path) -> tuple[float, bool]:
        """Sorts the frames by number, and last the file with the name that was given."""
        number = None if self._names is None else self._names.number(file.name)
        return (0 if number is None else number, file.name == self.made.name)


@dataclass(frozen=True, kw_only=True)
class Written(OutputReport):
    """What was written to the file `output`.

    Attributes:
        vertices: number of vertices of each frame; of point clouds, their mean number.
        report: of the verb that made the frames; None of frames that were read.
    """

    vertices: int
    report: Report | None = None

    def lines(self) -> list[str]:
        """Says what was done to make the frames, or how many there are."""
        done = [] if self.report is None else replace(self.report, reason="", remarks=()).lines()
        counts = f"{counted(self.frames, 'frame')} of {self.vertices} vertices"
        return [*(done or [counts]), *super().lines()]

    def to_dict(self) -> dict[str, Any]:
        """Returns the attributes, and those of the report of the verb, as values that JSON has."""
        own = super().to_dict()
        del own["report"]
        return own if self.report is None else self.report.to_dict() | own


def write(
    path: PathLike,
    frames: InMemory | Frames,
    faces: Faces | None = None,
    *,
    format: str | None = None,
    provenance: bool | None = None,
    overwrite: bool = True,
) -> Written:
    """Writes frames to a file, which appears under its name when it is complete.

    Frames that a verb makes are made on the way, in constant memory. Of frames that were completed
    from a USD file, and keep its range, rate, unit and axis, another USD file becomes a layer over
    it, which keeps everything else.

    Args:
        path: the file, in one of the formats; a pattern such as 'out/frame_%04d.ply' for a format
            with one file for each frame; or a folder, for the names of the files that were read, if
            they are numbered, or else `frame_%04d`.
        frames: those of :func:`dynmesh.open`, of a verb, or a :class:`dynmesh.Sequence`; or
            positions (n, k, 3), or meshes of trimesh or PyVista.
        faces: of positions alone.
        format: the format of the file, if its suffix does not say it.
        provenance: whether to write how many edges each vertex is from an observed one
            (generation), and for how many frames it was not observed (age); else, if the frames
            have them and the format can hold them. A file that has them can be completed again:
            what was estimated is then estimated again.
        overwrite: whether to replace existing files.

    Returns:
        What was written. Its `remarks` name all that the format cannot hold, such as estimated
        standard errors; those that were asked for by `uncertainty` are refused instead.

    Raises:
        FileExistsError: the file exists and is not to be replaced.
        BlockingIOError: another process is writing it.
    """
    given = path_of("path", path)
    if not isinstance(frames := as_sequence(frames, faces) or frames, Frames):
        message = f"must be those of open, of a verb or a Sequence, not {type(frames).__name__}"
        message += "; its own write() writes it" if hasattr(frames, "write") else ""
        raise KindError(message, argument="frames")
    check_any(frames)
    check_flags(overwrite=overwrite)
    if provenance is not None:
        check_flags(provenance=provenance)
    output = given if format else named_like(frames, given)
    chosen = format_of_output(output, format)
    header, dropped = _held(chosen, output, frames, provenance)
    with naming(output):
        place = Place(output, header, chosen, overwrite)
        place.check(frames)
    save = chosen.overlay if _is_layer(chosen, output, frames) else chosen.write
    assert save is not None
    with (
        naming(output),
        blaming(output, place.made),
        making(place.made) as folder,
    ):
        check_space(folder, bytes_of(header))
        with _Prepared(frames, header, chosen, output, provenance) as prepared:
            remarks = save(folder / place.made.name, header, prepared)
            if remarks is None:
                is_held = "texture" in chosen.keeps and frames.texture is not None
                remarks = not_written(frames, [TEXTURE] if is_held else [])
            for _ in () if prepared.each and save is chosen.overlay else prepared:
                raise InputError(f"format {chosen.name} has not written all of the frames")
        place.refuse_existing()
        removed = place.fill(folder)
    report: Report | None = frames.report
    return Written(
        output=given,
        frames=header.n_frames,
        vertices=header.n_vertices,
        report=report,
        quality="good" if report is None else report.quality,
        reason="" if report is None else report.reason,
        remarks=(
            *(() if report is None else report.remarks),
            *frames.remarks,
            *dropped,
            *remarks,
            *removed,
        ),
    )


def _is_layer(chosen: Format, output: Path, frames: Frames) -> bool:
    """Whether a file is written that lies over the scene of which the frames are."""
    origin = next((one.origin for one in frames.each.values()), frames.origin)
    if origin is None or chosen.meshes is None:
        return False
    if output.exists() and origin.path.exists() and identity(output) == identity(origin.path):
        if lost := sorted({*origin.holds} - {TEXTURE}):
            message = f"is the file of the mesh, and would lose {listed(lost)}; write to another"
            raise InputError(message, file=output)
        return False
    return origin.is_below and chosen.overlay is not None


def _held(
    chosen: Format, path: Path, frames: Frames, provenance: bool | None
) -> tuple[Header, list[str]]:
    """The header without attributes of vertices that are not written, and remarks on what is lost.

    Attributes that are wanted must be held.
    """
    header, origin = frames.header, frames.own_origin
    if provenance and not header.has_provenance:
        raise InputError("is of frames that have none", argument="provenance", value=True)
    stated = {*header.stated}
    if origin is not None and origin.subdivision not in (None, "none"):
        stated.add("subdivision")
    lost = [STATED[name] for name in STATED if name in stated - chosen.keeps]
    bare = replace(header, attributes=[n for n in header.attributes if n == "known"])
    consequence = ""
    if provenance is False and not header.has_standard_error:
        header = bare
    elif header.has_provenance and "provenance" not in chosen.keeps:
        for name in [*(["generation"] if provenance else []), *frames.wanted]:
            able = (
                format
                for format in FORMATS.values()
                if format.write and "provenance" in format.keeps
            )
            raise InputError(
                f"this format cannot hold {ATTRIBUTES[name].what}; "
                f"{listed(format.suffixes[0] for format in able)} can",
                file=path,
            )
        lost += sorted({ATTRIBUTES[n].what for n in {*header.attributes} - {*bare.attributes}})
        consequence = "; what was estimated counts as observed there"
        header = bare
    if not lost:
        return header, []
    remark = f"not written, as format {chosen.name} cannot hold it: {', '.join(lost)}"
    return header, [remark + consequence]


class _Prepared(Frames):
    """Frames as a format holds them; the errors are those of :func:`checked`."""

    def __init__(
        self,
        frames: Frames,
        header: Header,
        chosen: Format,
        path: Path,
        provenance: bool | None = None,
    ) -> None:
        self.each = {
            name: _Prepared(one, _held(chosen, path, one, provenance)[0], chosen, path)
            for name, one in frames.each.items()
        }
        self.header = header
        self.path, self.files, self.origin = frames.path, frames.files, frames.origin
        self._each = _prepared(frames, header, chosen, path)

    def __iter__(self) -> Iterator[Frame]:
        return self._each

    def _close(self) -> None:
        self._each.close()


def _prepared(
    frames: Frames, header: Header, chosen: Format, path: Path
) -> Generator[Frame, None, None]:
    """Yields the frames as the format holds them; the errors are those of :func:`checked`."""
    for index, frame in enumerate(checked(frames)):
        with naming(path), locating(frame=header.number(index)):
            dropped: dict[str, Any] = {n: None for n in ATTRIBUTES if n not in header.attributes}
            frame = replace(frame, **dropped)
            points, known = frame.points, frame.known
            if known is not None:
                known = as_mask(known)
                if "known" not in chosen.keeps:
                    points = np.where(known[:, None], points, points.dtype.type(np.nan))
                    known = None
            if "float64" not in chosen.keeps:
                points = _rounded(points)
        yield replace(frame, points=points, known=known)


def _rounded(points: Positions) -> NDArray[np.float32]:
    with np.errstate(over="ignore"):
        single = np.ascontiguousarray(points, np.float32)
    beyond = (np.isinf(single) & np.isfinite(points)).any(axis=1)
    if beyond.any():
        vertex = int(beyond.argmax())
        raise InputError(
            f"vertex {vertex} at {points[vertex].tolist()} "
            "is out of the range of float32, in which this format stores positions"
        )
    return single
