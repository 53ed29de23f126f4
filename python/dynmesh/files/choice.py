"""Selection of the format of a file, and where a sequence is written.

Both are decided once, before anything is written.
"""

import errno
import glob
import os
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

from .._errors import InputError, naming
from .._extras import require
from .._report import listed
from ..attributes import ATTRIBUTES
from ..sequence import Sequence
from .alembic import alembic
from .format import Format
from .hdf5 import hdf5
from .header import Header
from .memory import SequenceReader
from .model import model
from .new_output import check_folder, identity, refuse_inputs
from .npy import npy
from .npz import npz
from .numbered import FrameNames, files_in, matching, pattern_like
from .obj import obj
from .pc2 import pc2
from .ply import ply
from .reader import Reader
from .usd import usd, usdz
from .writer import Writer

PathLike: TypeAlias = str | os.PathLike[str]

formats: dict[str, Format] = {
    format.name: format for format in (npz, hdf5, npy, pc2, ply, obj, usd, usdz, alembic, model)
}
"""All formats by name."""


def format_of(path: PathLike, name: str | None = None) -> Format:
    """Returns the format of that name or else of the sequence at `path`."""
    path = Path(path)
    if name is None and not path.suffix and not path.exists() and not glob.has_magic(str(path)):
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
    with naming(path):
        advice = "give a file such as body.ply, or name the format; dynmesh track takes scans"
        return _choose(path, name, advice)


def existing_file(path: Path, format: Format) -> Path:
    """Returns the path, or the only file that it stands for, of a format with one file a sequence.

    Raises:
        ValueError: it stands for several.
    """
    if "gaps" in format.takes or path.exists():
        return path
    found = [*FrameNames.of(path).existing().values()] or sorted(matching(path))
    if len(found) > 1:
        raise ValueError(
            f"stands for {len(found)} files, from {found[0].name} on, which are no sequence, as "
            f"each {format.name} file is one of its own; name one"
        )
    return found[0] if found else path


def _choose(path: Path, name: str | None, otherwise: str, *, written: bool = False) -> Format:
    """Returns the format of that name or of the path, which is to be read or `written`.

    Errors list the possible formats, and `otherwise` is their advice.
    """
    possible = {of: one for of, one in formats.items() if one.writer or not written}
    refused = "cannot write format" if written else "unknown format"
    if name is not None:
        if name not in possible:
            raise ValueError(f"{refused} '{name}'; the formats are {listed(possible)}")
        return possible[name]
    if path.is_dir():
        numbered = {one.suffixes[0]: one for one in formats.values() if "gaps" in one.takes}
        found = [suffix for suffix in numbered if files_in(path, suffix)]
        if len(found) == 1:
            return numbered[found[0]]
        what = " and ".join(found) or f"no {' or '.join(numbered)}"
        raise ValueError(f"is a folder with {what} files; {otherwise}")
    if not path.suffix:
        raise ValueError(f"has no suffix, which would determine the format; {otherwise}")
    suffix = path.suffix.lower()
    for format in possible.values():
        if suffix in format.suffixes:
            return format
    suffixes = listed(suffix for format in possible.values() for suffix in format.suffixes)
    raise ValueError(f"{refused} '{path.suffix}'; the suffixes are {suffixes}")


@dataclass(frozen=True)
class Target:
    """A path and what writes to it.

    Attributes:
        path: the path that was asked for.
        writer: the class of its writers.
        is_overlay: whether it is a layer over the mesh file of its header instead of a file that
            stands alone.
    """

    path: Path
    writer: type[Writer]
    is_overlay: bool = False

    def create(self, header: Header, *, overwrite: bool = True) -> Writer:
        """Begins the file.

        The arguments are those of :class:`Writer`.

        Raises:
            BlockingIOError: another process is writing the file.
            OSError, TypeError, ValueError: the file cannot be written.
        """
        check_folder(self.path)
        with naming(self.path):
            self.check_holds(name for name in header.attributes if name != "known")
            return self.writer(self.path, header, overwrite=overwrite)

    def check_holds(self, attributes: Iterable[str]) -> None:
        """Refuses attributes of vertices, beside masks, if the format cannot hold them."""
        for name in attributes if not self.writer.keeps_provenance else ():
            able = (one for one in formats.values() if one.writer and one.writer.keeps_provenance)
            raise InputError(
                f"this format cannot hold {ATTRIBUTES[name].what}; "
                f"{listed(one.suffixes[0] for one in able)} can",
                file=self.path,
            )

    def holding(self, header: Header) -> tuple[Header, list[str]]:
        """Returns the header without what the format cannot hold of it, and says what that is."""
        if self.writer.keeps_provenance or not header.has_provenance:
            return header, []
        told = (
            "generation and age are not written, as this format cannot hold them; what was "
            "estimated counts as observed there"
        )
        return replace(header, has_provenance=False, has_standard_error=False), [told]

    def write(self, sequence: Sequence, *, overwrite: bool = True) -> list[str]:
        """Writes a whole sequence; returns the remarks of the writer."""
        reader = SequenceReader(sequence)
        with self.create(reader.header, overwrite=overwrite) as writer:
            for frame in reader:
                writer.append(frame.points, **frame.attributes())
        return writer.remarks

    def existing(self) -> list[Path]:
        """The files that writing would replace."""
        with naming(self.path):
            return self.writer.existing(self.path)

    def check(
        self,
        *,
        overwrite: bool,
        reader: Reader | None = None,
        others: Iterable[Path] = (),
    ) -> None:
        """Refuses to replace files that `reader` reads, `others`, or, unless asked to, any.

        Raises:
            FileExistsError, ValueError: writing would replace them.
            OSError: it would be in a file.
        """
        check_folder(self.path)
        if reader is not None:
            self._check_not_among(reader)
        if existing := self.existing():
            refuse_inputs(existing, [*([] if reader is None else reader.files), *others])
        self.writer.refuse_existing(self.path, overwrite)

    def _check_not_among(self, reader: Reader) -> None:
        """Refuses to write frames into the folder whose files are read as frames."""
        if (
            reader.path.is_dir()
            and self.path.parent.is_dir()
            and identity(self.path.parent) == identity(reader.path)
            and self.path.suffix.lower() == reader.files[0].suffix.lower()
            and not set(self.existing()) & set(reader.files)
        ):
            raise ValueError(
                f"{self.path}: is in the folder of the input, whose files would then be frames of "
                "the same sequence; write to another folder"
            )


def target_of(path: PathLike, format: str | None = None, *, overlay: bool | None = False) -> Target:
    """Where to write, in the format of that name or else in the one that the suffix says.

    With `overlay`, it is a layer over the mesh file of its header instead of a file that stands
    alone; None means a layer if the format has any.

    Raises:
        ImportError: the library for this format is not installed; the message names its extra.
        ValueError: there is no such format, it is only read, or it has no layers.
    """
    path = Path(path)
    with naming(path):
        otherwise = f"write {path / 'frame_%04d.ply'}, or name the format"
        chosen = _choose(path, format, otherwise, written=True)
        assert chosen.writer is not None
        if overlay and chosen.overlay is None:
            raise ValueError(
                f"{chosen.name} has no layers; write an overlay as .usd, .usda or .usdc"
            )
        if chosen.library is not None:
            module, extra = chosen.library
            require(module, extra=extra)
        if overlay is False or chosen.overlay is None:
            return Target(path, chosen.writer)
        return Target(path, chosen.overlay, is_overlay=True)


def target_over(path: PathLike, output: PathLike) -> Target:
    """Where the sequence that becomes of `path` is written: a layer over it where both are USD.

    The errors are those of :func:`target_of`.
    """
    over_usd = format_of(path).name in ("usd", "usdz")
    return target_of(output, overlay=None if over_usd else False)


def named_like(path: PathLike, output: PathLike) -> Path:
    """Where frames are written for which a folder is given: there, under the names of the input."""
    folder = Path(output)
    if folder.suffix and not folder.is_dir():
        return folder
    numbered = [one.suffixes[0] for one in formats.values() if "gaps" in one.takes]
    with naming(Path(path)):
        pattern = pattern_like(Path(path), numbered)
    if pattern is None or Path(pattern).suffix.lower() not in numbered:
        return folder
    return folder / pattern
