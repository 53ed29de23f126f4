"""Names of files, one of each frame or one of them all."""

import os
import re
from dataclasses import dataclass, replace
from pathlib import Path

_conversion = re.compile("%(?:0[0-9]+)?d")
_hashes = re.compile("##+")


@dataclass(frozen=True)
class FrameNames:
    """The file names of a sequence.

    Attributes:
        folder: the folder of the files.
        pattern: a name with ``%d`` or ``%04d`` for the number of the frame, or a plain name for a
            sequence of one frame.
        plain: whether the pattern is a plain name, whatever it contains.
    """

    folder: Path
    pattern: str
    plain: bool = False

    @property
    def numbered(self) -> bool:
        """Whether the pattern contains exactly one number."""
        one = self.pattern.count("%") == 1 and _conversion.search(self.pattern) is not None
        return one and not self.plain

    @classmethod
    def of(cls, path: Path) -> "FrameNames":
        """The names that a path stands for, in which ``####`` is the number, as ``%04d``."""
        return cls(path.parent, path.name if path.exists() else with_conversion(path.name))

    def name(self, number: int) -> str:
        """Returns the file name of this frame."""
        return self.pattern % number if self.numbered else self.pattern

    def existing(self) -> dict[int, Path]:
        """Returns the existing files by ascending number."""
        if not self.numbered:
            file = self.folder / self.pattern
            return {0: file} if file.exists() else {}
        found = {}
        for file in self.folder.glob("*"):  # empty if the folder does not exist
            number = self.number(file.name)
            if number is not None:
                found[number] = file
        return dict(sorted(found.items()))

    def has(self, name: str) -> bool:
        """Whether a frame has this file name."""
        return self.number(name) is not None

    def number(self, name: str) -> int | None:
        """Returns the number of the frame with this file name; None if no frame has it."""
        if not self.numbered:
            return 0 if name == self.pattern else None
        begin, end = map(re.escape, _conversion.split(self.pattern))
        match = re.fullmatch(f"{begin}([0-9]+){end}", name)
        return int(match[1]) if match and self.name(int(match[1])) == name else None

    def meets(self, other: "FrameNames") -> bool:
        """Whether a frame of one sequence can have the file name of a frame of the other.

        The folders are not compared. Numbers that begin with zeros are taken to be of any length.
        """
        if not self.numbered:
            return other.has(self.pattern)
        if not other.numbered:
            return self.has(other.pattern)
        begin, end = _conversion.split(self.pattern)
        beginning, ending = _conversion.split(other.pattern)
        return _may_be_digits(begin, beginning) and _may_be_digits(end[::-1], ending[::-1])

    def real(self) -> "set[FrameNames]":
        """The same names in their real folder, and where a link leads that has the one name."""
        folder = Path(os.path.realpath(self.folder))
        found = {replace(self, folder=folder)}
        if not self.numbered:
            found.add(single(Path(os.path.realpath(folder / self.pattern))))
        return found


def with_conversion(name: str) -> str:
    """Returns the pattern with ``%04d`` for ``####``, as animation programs write it."""
    found = _hashes.findall(name)
    return _hashes.sub(f"%0{len(found[0])}d", name) if len(found) == 1 and "%" not in name else name


def single(path: Path) -> FrameNames:
    """Returns the name of one file, which may contain anything."""
    return FrameNames(path.parent, path.name, plain=True)


def _may_be_digits(one: str, other: str) -> bool:
    """Whether one text begins with the other, and goes on with digits only."""
    shorter, longer = sorted((one, other), key=len)
    return longer.startswith(shorter) and re.fullmatch("[0-9]*", longer[len(shorter) :]) is not None
