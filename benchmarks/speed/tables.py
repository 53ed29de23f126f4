"""Tables that compare methods."""

import importlib.metadata
import os
import platform
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from dynmesh.study.fits import LinearFit, fit_line
from dynmesh.study.methods import DETAIL, MOTION
from dynmesh.study.tables import (
    ABSENT,
    Line,
    bold_below_one,
    milliseconds,
    nmsve_cell,
    ratio,
)

from ..baselines import COPY
from ..harness import Table
from ..methods import BY_KEY, SLOW, TWO_THREADS
from .comparison import Comparison

_SLOW = {method.key for method in SLOW}


def machine() -> Table:
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
    words = f"{processor}, {os.cpu_count()} cores; {platform.system()}; {', '.join(versions)}"
    return Table("machine", [], words)


def of_comparison(part: str, found: Comparison) -> list[Table]:
    """Return all tables of one mesh."""
    made = [Table(f"{part}-ratios", ratios(found))]
    if slow := [key for key in found.keys if key in _SLOW]:
        made.append(Table(f"{part}-errors", errors(found, slow)))
        made.append(Table(f"{part}-detail", beside_detail(found, slow)))
    return made


def ratios(found: Comparison) -> list[Line]:
    """Tabulate the times relative to motion, and that of motion relative to the copy."""
    subject, own = found.scene.subject, found.seconds(MOTION.key)
    lines: list[Line] = [(f"{subject.name}, {subject.n_vertices} vertices", *found.runs)]
    for key in found.keys:
        label, theirs = BY_KEY[key].label, found.seconds(key)
        if key == MOTION.key:
            lines.append((f"{label}, ms", *map(milliseconds, own)))
        elif key == COPY.key:
            lines.append((f"motion, times a {label}", *map(ratio, own, theirs)))
        elif key == TWO_THREADS.key:
            lines.append((f"{label}, times faster", *map(ratio, own, theirs)))
        else:
            lines.append((f"{label}, times motion", *map(ratio, theirs, own)))
    return lines


def errors(found: Comparison, slow: Sequence[str]) -> list[Line]:
    """Tabulate the errors relative to motion, in bold if they are smaller."""
    own = found.errors(MOTION.key)
    lines: list[Line] = [("NMSVE", *found.runs), (f"{MOTION.label}, x 1e4", *map(nmsve_cell, own))]
    for key in slow:
        lines.append((f"{BY_KEY[key].label}, times motion", *_relative(found.errors(key), own)))
    return lines


def beside_detail(found: Comparison, slow: Sequence[str]) -> list[Line]:
    """Tabulate times and errors relative to detail, in bold if they are smaller."""
    times, own = found.seconds(DETAIL.key), found.errors(DETAIL.key)
    baselines = [key for key in slow if key != DETAIL.key]
    lines: list[Line] = [("beside detail", *found.runs)]
    lines.append(("time of detail, ms", *map(milliseconds, times)))
    for key in baselines:
        title = f"time of {BY_KEY[key].label}, times detail"
        lines.append((title, *_relative(found.seconds(key), times)))
    lines.append(("NMSVE of detail, x 1e4", *map(nmsve_cell, own)))
    for key in (MOTION.key, *baselines):
        title = f"NMSVE of {BY_KEY[key].label}, times detail"
        lines.append((title, *_relative(found.errors(key), own)))
    return lines


def numbering(pairs: Sequence[tuple[Comparison, Comparison]]) -> Table:
    """Tabulate the times with vertices in their own order and in random order."""
    lines: list[Line] = [("vertices", "lost by", "method", "natural, ms", "permuted, ms", "ratio")]
    for natural, permuted in pairs:
        count = str(natural.scene.subject.n_vertices)
        for key in permuted.keys:
            both = zip(natural.runs, natural.seconds(key), permuted.seconds(key), strict=True)
            for loss, own, random in both:
                cells = milliseconds(own), milliseconds(random), ratio(random, own)
                lines.append((count, loss, BY_KEY[key].label, *cells))
    return Table("numbering", lines)


def sizes(rows: Sequence[Comparison]) -> Table:
    """Tabulate time against size, and the exponents of fitted power laws."""
    counts = [row.scene.subject.n_vertices for row in rows]
    lines: list[Line] = [("ms at so many vertices", *map(str, counts), "exponent")]
    for place, loss in enumerate(rows[0].runs):
        for key in dict.fromkeys(key for row in rows for key in row.keys):
            with_key = zip(counts, rows, strict=True)
            times = {n: row.seconds(key)[place] for n, row in with_key if key in row.keys}
            cells = [milliseconds(times[count]) if count in times else ABSENT for count in counts]
            fitted = f"{power_law(times).slope:.2f}" if len(times) > 2 else ABSENT
            lines.append((f"{BY_KEY[key].label}, {loss} known", *cells, fitted))
    return Table("sizes", lines)


def power_law(times: dict[int, float]) -> LinearFit:
    """Fit a line to the logarithms of the numbers of vertices and of their seconds."""
    return fit_line(np.log([*times]), np.log([*times.values()]))


def _relative(values: list[float], reference: list[float]) -> list[str]:
    return [bold_below_one(a / b) for a, b in zip(values, reference, strict=True)]
