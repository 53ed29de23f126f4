"""The instructions of one frame, counted by callgrind.

The count does not depend on what else the machine does. It depends on the compiler and on the level
of the processor, so instructions.json has a reference for each pair that has been recorded.
"""

import json
import re
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import NamedTuple

from dynmesh.study.tables import ABSENT, Line

from ..compiled import require
from ..harness import Table

MASKS = ("10%", "30%", "50%", "70%", "half", "patches")
TOLERANCE = 0.02
REFERENCE = Path(__file__).with_name("instructions.json")


class Counts(NamedTuple):
    """The compiler and the level of the processor, and the instructions of a frame by mask."""

    build: str
    per_frame: dict[str, int]


def measure() -> Counts:
    """Count the instructions of a frame with each mask, on a sheet of 10 000 vertices.

    Raises:
        ImportError: the program is not built, or valgrind is not installed.
    """
    if shutil.which("valgrind") is None:
        raise ImportError("valgrind is not installed; script/bench installs it")
    per_frame = {}
    for mask in MASKS:
        build, per_frame[mask] = _count(require("dynmesh-instructions"), mask)
    return Counts(build, per_frame)


def _count(program: Path, mask: str) -> tuple[str, int]:
    with tempfile.TemporaryDirectory() as folder:
        written = Path(folder) / "callgrind.out"
        command = ["valgrind", "--quiet", "--tool=callgrind", "--toggle-collect=counted_frame"]
        command += [f"--callgrind-out-file={written}", str(program), mask]
        ran = subprocess.run(command, check=True, capture_output=True, text=True)
        (counted,) = re.findall(r"^summary: (\d+)$", written.read_text(), re.MULTILINE)
    return ran.stdout.strip(), int(counted)


def references() -> dict[str, dict[str, int]]:
    """Return the recorded counts by build and mask."""
    recorded: dict[str, dict[str, int]] = json.loads(REFERENCE.read_text())
    return recorded


def record(counts: Counts) -> None:
    """Record these counts as the reference of their build."""
    recorded = references() | {counts.build: counts.per_frame}
    REFERENCE.write_text(json.dumps(recorded, indent=2) + "\n")


def changes(counts: Counts) -> list[str]:
    """Describe the masks for which a frame takes more instructions than the reference.

    Raises:
        LookupError: no reference has been recorded for this build.
    """
    reference = references().get(counts.build)
    if reference is None:
        raise LookupError(
            f"no reference for {counts.build}; script/bench --record-instructions records one"
        )
    found = []
    for mask, count in counts.per_frame.items():
        expected = reference[mask]
        if count - expected > TOLERANCE * expected:
            change = count / expected - 1
            found.append(f"{mask}: {count} instructions, {change:+.1%} against the reference")
    return found


def table(counts: Counts) -> Table:
    """Tabulate the counted instructions, and their change relative to the reference."""
    reference = references().get(counts.build, {})
    lines: list[Line] = [("lost by", "instructions a frame", "a vertex", "against the reference")]
    for mask, count in counts.per_frame.items():
        expected = reference.get(mask)
        change = f"{count / expected - 1:+.1%}" if expected else ABSENT
        lines.append((mask.replace("%", " %"), str(count), f"{count / 10_000:.0f}", change))
    return Table("instructions", lines, f"Build: {counts.build}.")
