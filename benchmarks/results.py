"""Everything that a run measured, and the file that stores it."""

import dataclasses
import importlib.metadata
import json
import os
import platform
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .comparison import Measurement
from .cpp_calls import CppCall
from .instructions import Counts
from .latency import Latency
from .overhead import Overhead


@dataclass
class Results:
    """The measurements of a run. Sections that were not run are empty.

    Attributes:
        machine: the processor and the versions of the software.
        missing: what could not run here, and why.
        comparison: all methods on the meshes of the comparison.
        sizes: the time over the size of the mesh.
        training: detail after training, beside detail and libigl.
        unknown: the time over the number of unknown vertices.
        overhead: what Python adds to the time of a call.
        latency: the times of the slowest of many frames.
        cpp: the times that Google Benchmark measured.
        instructions: the instructions that callgrind counted.
    """

    machine: str = ""
    missing: dict[str, str] = field(default_factory=dict)
    comparison: list[Measurement] = field(default_factory=list)
    sizes: list[Measurement] = field(default_factory=list)
    training: list[Measurement] = field(default_factory=list)
    unknown: list[Measurement] = field(default_factory=list)
    overhead: list[Overhead] = field(default_factory=list)
    latency: list[Latency] = field(default_factory=list)
    cpp: list[CppCall] = field(default_factory=list)
    instructions: Counts | None = None

    def write(self, path: Path) -> None:
        """Write the results as JSON, NMSVE in bounding-box diagonals."""
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(dataclasses.asdict(self)) + "\n")

    @classmethod
    def read(cls, path: Path) -> "Results":
        """Read a file that `write` wrote."""
        stored: dict[str, Any] = json.loads(path.read_text())
        kinds = {
            "comparison": Measurement,
            "sizes": Measurement,
            "training": Measurement,
            "unknown": Measurement,
            "overhead": Overhead,
            "latency": Latency,
            "cpp": CppCall,
        }
        for name, kind in kinds.items():
            stored[name] = [kind(**row) for row in stored[name]]
        if stored["instructions"] is not None:
            stored["instructions"] = Counts(**stored["instructions"])
        return cls(**stored)


def machine() -> str:
    """Describe the processor and the versions of the software in a line."""
    information = Path("/proc/cpuinfo")
    text = information.read_text() if information.exists() else ""
    named = re.search(r"^model name\s*: (.*)$", text, re.MULTILINE)
    processor = named[1].strip() if named else platform.processor() or platform.machine()
    versions = [f"Python {platform.python_version()}"]
    for package in ("numpy", "scipy", "libigl"):
        try:
            versions.append(f"{package} {importlib.metadata.version(package)}")
        except importlib.metadata.PackageNotFoundError:
            versions.append(f"no {package}")
    return f"{processor}, {os.cpu_count()} cores; {platform.system()}; {', '.join(versions)}"
