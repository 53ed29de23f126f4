"""Halves and doubles each constant of tracking, and measures the errors.

    script/reproduce constants FOLDER [NAME ...] [--frames 7]

The library is built a second time, in the folder of --out, to read its constants from the
environment. The cases are the scans of tracking-conditions, in motion and with a second subject,
and depth images. The table shows mean distances from the true vertices relative to those with the
default value, as geometric means. Constants on which no case depends are left out.
"""

import argparse
import json
import os
import pickle
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

import dynmesh
from dynmesh import losses
from dynmesh.scans import Scan
from dynmesh.tracking.placing import push_scan

from .harness import Line, Table, progress, sequences
from .runner import followed
from .subjects import Subject
from .tracking_conditions import FAR, NOISE, POINTS, depth_scans, with_second

SOURCES = Path(__file__).parents[1]
HEADER = "cpp/src/surface_fit/constants.hpp"
COMPLEMENTS = ("agreement", "along", "far_share", "prediction", "preconditioned")
"""Shares and cosines, of which the difference from 1 is halved and doubled."""
_CONSTANT = re.compile(r"^  (double|int|std::size_t) (\w+) = (-?[\d.e-]+);$", re.MULTILINE)
_HEADER = """#pragma once
#include <cstdlib>
namespace dynmesh {
inline double constant(const char* name, double value) {
  const char* text = std::getenv(name);
  return text == nullptr ? value : std::atof(text);
}
}  // namespace dynmesh
"""


class Constant(NamedTuple):
    """A constant of the library.

    Attributes:
        name: its name in the header.
        value: its default.
        is_whole: whether it is an integer.
    """

    name: str
    value: float
    is_whole: bool

    @property
    def label(self) -> str:
        """What is halved and doubled."""
        return f"1 - {self.name}" if self.name in COMPLEMENTS else self.name

    def times(self, factor: float) -> str:
        """Return the value of which that has so many times the default."""
        is_complement = self.name in COMPLEMENTS
        changed = 1 - factor * (1 - self.value) if is_complement else factor * self.value
        return str(max(int(changed), 1) if self.is_whole else changed)


class Case(NamedTuple):
    """A sequence and scans of its frames after frame 0."""

    subject: Subject
    scans: Sequence[Scan]

    def error(self) -> float:
        """Return the mean distance from the true vertices, in mean edges."""
        faces, template = self.subject.faces, self.subject.vertices[0]
        tracker = dynmesh.Tracker(faces, template)
        errors = followed(self.subject, self.scans, lambda _, scan: push_scan(tracker, scan))
        return float(errors[:, 0].mean())


def constants() -> Iterator[Constant]:
    """Yield the constants of the header."""
    for kind, name, value in _CONSTANT.findall((SOURCES / HEADER).read_text("utf-8")):
        yield Constant(name, float(value), kind != "double")


def build(folder: Path) -> Path:
    """Install the library, with constants of the environment, in a folder, and return its path."""
    sources, module = (folder / "sources").resolve(), (folder / "module").resolve()
    for path in (sources, module):
        shutil.rmtree(path, ignore_errors=True)
    for name in ("cpp", "cmake", "python"):
        shutil.copytree(SOURCES / name, sources / name)
    for name in ("CMakeLists.txt", "LICENSE", "README.md", "pyproject.toml"):
        shutil.copy(SOURCES / name, sources / name)
    shutil.copytree(SOURCES / "third_party_notes", sources / "third_party_notes")
    (sources / "cpp/src/base/constant.hpp").write_text(_HEADER, "utf-8")
    text = (sources / HEADER).read_text("utf-8")
    text = text.replace("#pragma once", '#pragma once\n#include "base/constant.hpp"')
    text = _CONSTANT.sub(r'  \1 \2 = static_cast<\1>(constant("tracking.\2", \3));', text)
    (sources / HEADER).write_text(text, "utf-8")
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps"]
    install += ["--no-build-isolation", "--target", str(module), str(sources)]
    subprocess.run(install, check=True)
    return module


def cases(subject: Subject) -> Iterator[Case]:
    """Yield the cases of a sequence."""
    later = subject.vertices[1:]
    around = partial(losses.orbit, subject.box, distance=FAR, up=subject.up_vector)
    scanned = partial(losses.scan_points, faces=subject.faces, points=POINTS, noise=NOISE)
    clean = list(scanned(later, cameras=around(4)(0)))
    yield Case(subject, clean)
    yield Case(subject, [with_second(scan, subject) for scan in clean])
    yield Case(subject, depth_scans(subject, around(1)(0)))


def tables(arguments: argparse.Namespace) -> list[Table]:
    """Errors of tracking with each constant halved and doubled."""
    folder = arguments.out / "constants"
    module = build(folder)
    found = [case for subject in sequences(arguments, 7) for case in cases(subject)]
    (folder / "cases.pickle").write_bytes(pickle.dumps(found))

    def measure(change: tuple[str, str]) -> list[float]:
        name, value = change
        done = subprocess.run(
            [sys.executable, "-m", __name__, folder / "cases.pickle"],
            env=os.environ | {"PYTHONPATH": f"{module}:{SOURCES}", f"tracking.{name}": value},
            check=True,
            stdout=subprocess.PIPE,
        )
        return list(json.loads(done.stdout))

    varied = list(constants())
    changes = [("unchanged", "")]
    changes += [(c.name, c.times(f)) for c in varied for f in (0.5, 2)]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        measured = list(progress(pool.map(measure, changes), "constants", len(changes)))
    usual, *others = measured
    later = iter(others)
    lines: list[Line] = [("constant", "halved", "doubled")]
    for constant in varied:
        ratios = [np.divide(next(later), usual) for _ in range(2)]
        means = [f"{np.exp(np.log(ratio).mean()):.3f}" for ratio in ratios]
        if means != ["1.000", "1.000"]:
            lines.append((constant.label, *means))
    return [Table("constants-tracking", lines)]


def main() -> None:
    """Print the errors of stored cases."""
    stored: list[Case] = pickle.loads(Path(sys.argv[1]).read_bytes())
    print(json.dumps([case.error() for case in stored]))


if __name__ == "__main__":
    main()
