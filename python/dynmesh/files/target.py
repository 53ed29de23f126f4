"""Where a sequence is written, and in which format: decided once, before anything is written."""

from dataclasses import dataclass
from pathlib import Path

from .._extras import require
from ..sequence import Sequence
from .choice import PathLike, choose
from .header import Header, frame_of, header_of
from .naming import naming
from .reader import Reader
from .writer import Writer


@dataclass(frozen=True)
class Target:
    """A path and what writes to it.

    Attributes:
        path: the path that was asked for.
        format: the name of the format.
        writer: the class of its writers.
    """

    path: Path
    format: str
    writer: type[Writer]

    def create(self, header: Header, *, folder: Path | None = None, resume_at: int = 0) -> Writer:
        """Begins the file, or continues an unfinished one; see :class:`Writer`."""
        with naming(self.path):
            return self.writer(self.path, header, folder=folder, resume_at=resume_at)

    def write(self, sequence: Sequence) -> None:
        """Writes a whole sequence."""
        with self.create(header_of(sequence)) as writer:
            for number in range(len(sequence.vertices)):
                frame = frame_of(sequence, number)
                writer.append(frame.points, frame.known, generation=frame.generation, age=frame.age)

    def existing(self) -> list[Path]:
        """The files that writing would replace."""
        with naming(self.path):
            return self.writer.existing(self.path)

    def new_folder(self) -> Path | None:
        """The folder that writing would make; None where it must be there already."""
        with naming(self.path):
            return self.writer.new_folder(self.path)

    def check(self, *, overwrite: bool, reader: Reader | None = None) -> None:
        """Refuses to replace the files that `reader` reads or, unless asked to, any others.

        Raises:
            FileExistsError, ValueError: writing would replace them.
            FileNotFoundError: there is no folder to write to.
        """
        folder = (self.new_folder() or self.path).parent
        if not folder.is_dir():
            raise FileNotFoundError(f"{self.path}: there is no folder {folder}")
        existing = self.existing()
        if existing and reader is not None:
            inputs = set(map(_identity, reader.files))
            for file in existing:
                if _identity(file) in inputs:
                    raise ValueError(f"{file}: is the input; writing over it would lose it")
        if existing and not overwrite:
            raise FileExistsError(
                f"{existing[0]}: exists already; --overwrite replaces it, in Python overwrite=True"
            )


def target_of(path: PathLike, format: str | None = None) -> Target:
    """Where to write, in the format of that name or else in the one that the suffix says.

    Raises:
        ImportError: the library for this format is not installed; the message names its extra.
        ValueError: there is no such format, or it is only read.
    """
    path = Path(path)
    with naming(path):
        otherwise = f"write {path / 'frame_%04d.ply'}, or give --output-format"
        chosen = choose(path, format, otherwise)
        if chosen.writer is None:
            raise ValueError(f"{chosen.name} files can only be read")
        if chosen.library is not None:
            module, extra = chosen.library
            require(module, extra=extra)
        return Target(path, chosen.name, chosen.writer)


def _identity(file: Path) -> tuple[int, int]:
    """Identifies a file, whichever path names it."""
    found = file.stat()
    return found.st_dev, found.st_ino
