"""Where an output belongs: the files that it replaces, and how it takes their place."""

import os
from collections.abc import Iterable, Sequence
from pathlib import Path

from .._errors import InputError
from .._report import some_of
from ..frame import Frames
from ..header import Header
from .format import Format
from .names import names_to_write
from .output import (
    check_folder,
    exchange,
    identity,
    is_fixed_folder,
    move,
    refuse_existing,
    refuse_inputs,
)


class Place:
    """Where frames are written.

    Attributes:
        made: what is made: the path, or the folder of one file per frame that is exchanged as a
            whole.
        is_folder: whether it is a folder.
        name: of the file in the folder where it is made, or the pattern of the names.
    """

    def __init__(
        self, path: Path, header: Header, format: Format, overwrite: bool, kept: Sequence[str] = ()
    ) -> None:
        """Finds the files; with `overwrite`, they are replaced.

        In a folder, they have the names that are `kept`, one for each frame, if there are any.
        """
        self._path, self._header, self._format = path, header, format
        self._overwrite = overwrite
        self._names = None
        if format.is_per_frame:
            self._names = names_to_write(path, format.suffixes[0], kept)
        self.made = self._made()
        folder = None if self._names is None else Path(os.path.realpath(self._names.folder))
        self.is_folder = self.made == folder
        self.name = path.name if self._names is None else self._names.pattern

    def _made(self) -> Path:
        """The real folder of the frames, if renaming it is possible and moves nobody else's work.

        Nothing that is in the folder matters here, so that all runs look for the same lock.
        """
        if self._names is None or not self._names.numbered:
            return self._path
        folder = Path(os.path.realpath(self._names.folder))
        return folder / self._names.pattern if is_fixed_folder(folder) else folder

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

    def check(self, frames: Frames, others: Iterable[Path] = ()) -> None:
        """Refuses to replace files from which frames are read, or, unless asked to, any."""
        check_folder(self._path)
        self._check_not_among(frames)
        if existing := self.existing():
            refuse_inputs(existing, [*frames.files, *others])
        self.refuse_existing()

    def _check_not_among(self, frames: Frames) -> None:
        """Refuses to write frames into the folder whose files are read as frames."""
        beside, suffix = self._path.parent, self._path.suffix.lower()
        read = {one for one in (frames.path, *frames.files) if one.is_dir()}
        of_files = {file.parent for file in frames.files if file.suffix.lower() == suffix}
        if (
            beside.is_dir()
            and identity(beside) in map(identity, read)
            and identity(beside) in map(identity, filter(Path.is_dir, of_files))
            and not set(self.existing()) & set(frames.files)
        ):
            raise InputError(
                "is in the folder of the input, whose files would then be frames of the same "
                "sequence; write to another folder",
                file=self._path,
            )

    def fill(self, folder: Path) -> list[str]:
        """Moves the files of a folder where they belong; says which older files it removed.

        The files that exist before the last one is moved are a beginning of the new or of the older
        sequence, and never a mixture. A folder of one file per frame is exchanged as a whole,
        unless it holds other files.
        """
        beside = self._path.parent if self._names is None else self._names.folder
        new = sorted(folder.iterdir(), key=self._order)
        if self._names is not None and self._names.kept:
            pairs = zip(new, self._names.kept, strict=True)
            new = [file.rename(folder / name) for file, name in pairs]
        places = {file: beside / file.name for file in new}
        for place in places.values():
            refuse_existing(place, self._overwrite)
        outdated = [file for file in self.existing() if file not in places.values()]
        if self.is_folder and self._holds_frames_alone():
            exchange(folder, self.made)
        else:
            move(places, outdated, folder.with_name("aside"))
        if not outdated:
            return []
        names = some_of([file.name for file in outdated], 3)
        return [f"older files that no new ones replace are removed ({len(outdated)}): {names}"]

    def _order(self, file: Path) -> tuple[float, bool]:
        """Sorts the frames by number, and last the file with the name that was given."""
        number = None if self._names is None else self._names.number(file.name)
        return (0 if number is None else number, file.name == self.name)

    def _holds_frames_alone(self) -> bool:
        """Whether nothing else is in the folder that is made anew."""
        assert self._names is not None
        others = self.made.iterdir() if self.made.is_dir() else ()
        kept = self._names.kept
        return all(
            file.name in kept if kept else self._names.number(file.name) is not None
            for file in others
        )
