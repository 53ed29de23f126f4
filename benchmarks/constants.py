"""Halves and doubles each constant of tracking and registration, and measures the errors.

    script/reproduce constants FOLDER [NAME ...] [--frames 7]

The library is built a second time, in the folder of --out, to read its constants from the
environment. Tracking: the scans of tracking-conditions, in motion and with a second subject, and
depth images. Registration: the last frame, turned, in a scan by four cameras. The table shows mean
distances from the true vertices relative to those with the default value, as geometric means; in
registration, what is farther than five mean edges counts as that far.
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
from scipy.spatial.transform import Rotation

import dynmesh
from dynmesh import degrade
from dynmesh.geometry import mean_edge_of
from dynmesh.scans import Scan
from dynmesh.tracking.placing import push_scan

from .harness import Line, Table, progress, sequences
from .runner import followed
from .subjects import Subject
from .tracking_conditions import FAR, NOISE, POINTS, depth_scans, with_second

SOURCES = Path(__file__).parents[1]
HEADERS = {
    "tracking": "cpp/src/surface_fit/constants.hpp",
    "registration": "cpp/src/registration/constants.hpp",
}
COMPLEMENTS = ("agreement", "along", "far_share", "kept", "prediction", "preconditioned")
"""Shares and cosines, of which the difference from 1 is halved and doubled."""
FARTHEST = 5.0
"""The largest error of a registration, in mean edges."""
_STRUCT = re.compile(r"^(?:inline constexpr )?struct (\w+) \{$", re.MULTILINE)
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
        of: what is measured with it, a key of HEADERS.
        struct: the structure that holds it.
        name: its name there.
        value: its default.
        is_whole: whether it is an integer.
    """

    of: str
    struct: str
    name: str
    value: float
    is_whole: bool

    @property
    def variable(self) -> str:
        """The name in the environment."""
        return f"{self.struct}.{self.name}"

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
    """A sequence and scans of its frames after frame 0; to register, a single one."""

    of: str
    subject: Subject
    scans: Sequence[Scan]

    def error(self) -> float:
        """Return the mean distance from the true vertices, in mean edges."""
        faces, template = self.subject.faces, self.subject.vertices[0]
        if self.of == "tracking":
            tracker = dynmesh.Tracker(faces, template)
            errors = followed(self.subject, self.scans, lambda _, scan: push_scan(tracker, scan))
            return float(errors[:, 0].mean())
        found = dynmesh.register(faces, template, self.scans[0]).vertices
        off = dynmesh.metrics.vertex_error(self.subject.vertices[1], found).mean()
        return min(float(off) / mean_edge_of(template, faces), FARTHEST)


def constants() -> Iterator[Constant]:
    """Yield the constants of the headers."""
    for of, header in HEADERS.items():
        _, *parts = _STRUCT.split((SOURCES / header).read_text("utf-8"))
        for struct, text in zip(parts[::2], parts[1::2], strict=True):
            for kind, name, value in _CONSTANT.findall(text):
                yield Constant(of, struct, name, float(value), kind != "double")


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
    for header in HEADERS.values():
        first, *parts = _STRUCT.split((sources / header).read_text("utf-8"))
        text = first.replace("#pragma once", '#pragma once\n#include "base/constant.hpp"')
        for struct, members in zip(parts[::2], parts[1::2], strict=True):
            own = rf'  \1 \2 = static_cast<\1>(constant("{struct}.\2", \3));'
            is_object = "\n};" not in members  # which reads the environment when it is loaded
            text += f"{'inline const ' if is_object else ''}struct {struct} {{"
            text += _CONSTANT.sub(own, members)
        (sources / header).write_text(text, "utf-8")
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps"]
    install += ["--no-build-isolation", "--target", str(module), str(sources)]
    subprocess.run(install, check=True)
    return module


def cases(subject: Subject) -> Iterator[Case]:
    """Yield the cases of a sequence."""
    later = subject.vertices[1:]
    around = partial(degrade.orbit, subject.box, distance=FAR, up=subject.up_vector)
    scanned = partial(degrade.scan_points, faces=subject.faces, points=POINTS, noise=NOISE)
    clean = list(scanned(later, cameras=around(4)(0)))
    yield Case("tracking", subject, clean)
    yield Case("tracking", subject, [with_second(scan, subject) for scan in clean])
    yield Case("tracking", subject, depth_scans(subject, around(1)(0)))
    turn = Rotation.from_euler("xyz", (40, 70, 20), degrees=True).as_matrix()
    turned = (later[-1:] - later[-1].mean(axis=0)) @ turn.T
    pair = Subject(
        subject.name, np.concatenate([subject.vertices[:1], turned]), subject.faces, "z", 0.0
    )
    cameras = degrade.orbit(pair.box, 4, distance=FAR)(0)
    yield Case("registration", pair, list(scanned(turned, cameras=cameras)))


def tables(arguments: argparse.Namespace) -> list[Table]:
    """Errors of tracking and registration with each constant halved and doubled."""
    folder = arguments.out / "constants"
    module = build(folder)
    found = [case for subject in sequences(arguments, 7) for case in cases(subject)]
    (folder / "cases.pickle").write_bytes(pickle.dumps(found))

    def measure(change: tuple[str, str, str]) -> list[float]:
        of, name, value = change
        done = subprocess.run(
            [sys.executable, "-m", __name__, folder / "cases.pickle", of],
            env=os.environ | {"PYTHONPATH": f"{module}:{SOURCES}", name: value},
            check=True,
            stdout=subprocess.PIPE,
        )
        return list(json.loads(done.stdout))

    varied = list(constants())
    changes = [(of, "unchanged", "") for of in HEADERS]
    changes += [(c.of, c.variable, c.times(f)) for c in varied for f in (0.5, 2)]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        measured = list(progress(pool.map(measure, changes), "constants", len(changes)))
    usual = dict(zip(HEADERS, measured, strict=False))
    later = iter(measured[len(HEADERS) :])
    lines: list[Line] = [("constant", "of", "halved", "doubled")]
    for constant in varied:
        ratios = [np.divide(next(later), usual[constant.of]) for _ in range(2)]
        means = [f"{np.exp(np.log(ratio).mean()):.3f}" for ratio in ratios]
        lines.append((constant.label, constant.of, *means))
    return [Table("constants-tracking", lines)]


def main() -> None:
    """Print the errors of stored cases."""
    path, of = sys.argv[1:]
    stored: list[Case] = pickle.loads(Path(path).read_bytes())
    print(json.dumps([case.error() for case in stored if case.of == of]))


if __name__ == "__main__":
    main()
