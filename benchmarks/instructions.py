"""The instructions of one frame, counted by callgrind.

The count does not depend on what else the machine does. It depends on the compiler and on the level
of the processor, so instructions.json has a reference for each pair that has been recorded.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

MASKS = ("10%", "30%", "50%", "70%", "half", "patches")
TOLERANCE = 0.02
REFERENCE = Path(__file__).with_name("instructions.json")


def measure() -> tuple[str, dict[str, int]]:
    """Count the instructions of a frame with each mask, on a sheet of 10 000 vertices.

    The program is in the folder that DYNMESH_BENCHMARKS names, or else in that of script/bench.

    Returns:
        The compiler with the level of the processor, and the counts by mask.

    Raises:
        ImportError: the program is not built, or valgrind is not installed.
    """
    built = Path(__file__).parents[1] / "build" / "bench" / "benchmarks" / "cpp"
    program = Path(os.environ.get("DYNMESH_BENCHMARKS", built)) / "dynmesh-instructions"
    if not program.exists():
        raise ImportError(f"{program.name} is not built; script/bench builds it")
    if shutil.which("valgrind") is None:
        raise ImportError("valgrind is not installed; script/bench installs it")
    counts = {}
    for mask in MASKS:
        build, counts[mask] = _count(program, mask)
    return build, counts


def _count(program: Path, mask: str) -> tuple[str, int]:
    with tempfile.TemporaryDirectory() as folder:
        written = Path(folder) / "callgrind.out"
        command = ["valgrind", "--quiet", "--tool=callgrind", "--toggle-collect=counted_frame"]
        command += [f"--callgrind-out-file={written}", str(program), mask]
        ran = subprocess.run(command, check=True, capture_output=True, text=True)
        (counted,) = re.findall(r"^summary: (\d+)$", written.read_text(), re.MULTILINE)
    return ran.stdout.strip(), int(counted)


def main(*, record: bool) -> int:
    """Print the counts; return 1 if one has grown, 2 if there is nothing to compare with."""
    try:
        build, counts = measure()
    except ImportError as error:
        print(error, file=sys.stderr)
        return 2
    recorded = json.loads(REFERENCE.read_text())
    if record:
        recorded[build] = counts
        REFERENCE.write_text(json.dumps(recorded, indent=2) + "\n")
    if build not in recorded:
        print(f"no reference for {build}; script/bench --instructions record", file=sys.stderr)
        return 2
    print(f"instructions of a frame, {build}")
    grown = False
    for mask, count in counts.items():
        change = count / recorded[build][mask] - 1
        grown = grown or change > TOLERANCE
        print(f"{mask}: {count}, {change:+.1%} against the reference")
    return int(grown)
