"""Names of files, one of each frame or one of them all."""

import re
from dataclasses import dataclass
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


def with_conversion(name: str) -> str:
    """Returns the pattern with ``%04d`` for ``####``, as animation programs write it."""
    found = _hashes.findall(name)
    return _hashes.sub(f"%0{len(found[0])}d", name) if len(found) == 1 and "%" not in name else name


def single(path: Path) -> FrameNames:
    """Returns the name of one file, which may contain anything."""
    return FrameNames(path.parent, path.name, plain=True)
