"""The sequences that are measured on, built in or read from files, and how vertices are lost."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import dynmesh
from dynmesh import losses, metrics, synth
from dynmesh._arrays import Mask, Positions
from dynmesh.synth._skin import Flesh, chained, turn, wrapped
from dynmesh.topology import cells, likely_up

PAPER_SHARES = (0.1, 0.3, 0.5, 0.7)
"""The shares of known vertices in the figures of the paper."""

SCENARIOS = ("camera", "patches")
"""The losses that are not random, which the paper does not have: what one camera sees, and patches
that hide 30 %."""


@dataclass(frozen=True, eq=False)
class Subject:
    """A complete sequence to measure on.

    Attributes:
        name: the name used in file names and titles.
        vertices: (n, k, 3) complete frames.
        faces: (m, 3) vertex indices.
        up: the axis that points up in pictures, "x", "y" or "z".
        azimuth: the direction from which pictures are taken, in degrees around `up`.
    """

    name: str
    vertices: Positions
    faces: NDArray[np.integer[Any]]
    up: str
    azimuth: float

    @cached_property
    def diagonal(self) -> float:
        """The diagonal of the bounding box of frame 0, the unit of all errors."""
        return metrics.bounding_box_diagonal(self.vertices[0])

    @property
    def box(self) -> Positions:
        """Two corners of the bounding box of all frames."""
        return np.stack([self.vertices.min(axis=(0, 1)), self.vertices.max(axis=(0, 1))])

    @property
    def up_vector(self) -> tuple[float, float, float]:
        """The unit vector along the axis that points up."""
        return float(self.up == "x"), float(self.up == "y"), float(self.up == "z")

    @property
    def n_frames(self) -> int:
        """The number of frames, frame 0 included."""
        return int(self.vertices.shape[0])

    @property
    def n_vertices(self) -> int:
        """The number of vertices of a frame."""
        return int(self.vertices.shape[1])

    def frame_at(self, fraction: float) -> int:
        """Return the number of the frame at a fraction of the sequence; never frame 0."""
        return max(1, round(fraction * (self.n_frames - 1)))

    def scaled(self) -> "Subject":
        """Return the sequence in double precision, with a bounding-box diagonal of 1."""
        return replace(self, vertices=self.vertices.astype(np.float64) / self.diagonal)


def built_in(frames: int | None = None) -> list[Subject]:
    """Return the walker and the ocean, of the sizes of the sequences in the paper."""
    walker, ocean = synth.walker(), synth.ocean()
    return [
        Subject("walker", walker.vertices[:frames], walker.faces, "z", 20.0),
        Subject("ocean", ocean.vertices[:frames], ocean.faces, "z", 60.0),
    ]


def from_file(path: Path, frames: int | None = None) -> Subject:
    """Read a sequence that is complete and has at least two frames.

    Up is the axis that the file names, z for sheets that lie flat, or else y.
    """
    sequence = dynmesh.read(path)
    if len(sequence.vertices) < 2:
        raise ValueError(f"{path}: has {len(sequence.vertices)} frames; at least 2 are needed")
    is_whole = sequence.known is None or sequence.known.all()
    if not is_whole or not np.isfinite(sequence.vertices).all():
        raise ValueError(f"{path}: has missing vertices; the evaluation needs complete sequences")
    up = likely_up(sequence.vertices[0], sequence.up_axis)
    return Subject(path.stem, sequence.vertices[:frames], sequence.faces, up, 60.0)


def percent(share: float) -> str:
    """Return a share of 1 as a percentage."""
    return f"{100 * share:g} %"


def random_masks(subject: Subject, share: float) -> Iterator[Mask]:
    """Yield the known mask of every frame; a new random choice of vertices is known in each."""
    return losses.random_known(subject.n_frames, subject.n_vertices, share)


def scenario_masks(name: str, subject: Subject) -> list[Mask]:
    """Return the known mask of every frame for one of `SCENARIOS`."""
    if name == "camera":
        # The camera circles the positions of all frames, so that no vertex leaves the picture.
        cameras = losses.orbit(subject.box, up=subject.up_vector)
        return list(losses.camera_known(subject.vertices, subject.faces, cameras))
    shape = (subject.n_frames, subject.n_vertices)
    return list(losses.patch_known(subject.faces, *shape, 0.3))


def losses_of(
    subject: Subject,
    shares: Iterable[float] = PAPER_SHARES,
    scenarios: Iterable[str] = SCENARIOS,
) -> dict[str, list[Mask]]:
    """Return the known masks of random losses, named like "10 %", and of scenarios."""
    masks = {percent(share): list(random_masks(subject, share)) for share in shares}
    return masks | {name: scenario_masks(name, subject) for name in scenarios}


_FRAMES, _FPS = 31, 30.0
_RINGS, _LIFETIME = (12, 16, 20), 10
_SECONDS = np.arange(_FRAMES) / _FPS


def flippers() -> Subject:
    """Return a flat body that rows with two long flippers and steers with two short ones."""
    body = [((x, -0.5, 0.0), (x, 0.5, 0.0), (0.22, 0.18)) for x in (-0.3, 0.0, 0.3)]
    joints, tips = [(0.0, 0.0, 0.0)], []
    for side in (-1, 1):
        joints += [(side * 0.45, 0.45, 0.0), (side * 0.85, 0.5, 0.0), (side * 0.4, -0.55, 0.0)]
        tips += [(side * 0.85, 0.5, 0.0), (side * 1.35, 0.3, 0.0), (side * 0.75, -0.85, 0.0)]
    radii = [(0.14, 0.13), (0.13, 0.09), (0.12, 0.10)] * 2
    flesh = [*body, *zip(joints[1:], tips, radii, strict=True)]
    boxes = [((-9, 9), (-11, 11), (-2, 2))]
    for inner, outer, low, high in ((8, 25, 5, 10), (5, 15, -16, -10)):
        boxes += [((inner, outer), (low, high), (-1, 1)), ((-outer, -inner), (low, high), (-1, 1))]
    owners = [0, 0, 0, 1, 2, 3, 4, 5, 6]
    skin = wrapped(Flesh(flesh, 0.05), owners, boxes, 0.06, 6)
    phase = 2 * np.pi * 1.1 * _SECONDS
    turns = [turn(0, 6 * np.sin(phase))]
    for side in (-1, 1):
        turns += [
            turn(1, -side * 38 * np.sin(phase)) @ turn(0, 20 * np.cos(phase)),
            turn(1, -side * 30 * np.sin(phase - 0.9)),
            turn(2, side * 25 * np.sin(phase - 0.4)),
        ]
    motions = chained(joints, [None, 0, 1, 0, 0, 4, 0], turns)
    return Subject("flippers", skin.posed(motions).astype(np.float64), skin.faces, "z", 20.0)


def deep_holes(subject: Subject) -> list[Mask]:
    """Return known masks with a hole of 12, 16 or 20 rings, each for ten frames."""
    offsets, neighbours = cells(subject.faces, subject.n_vertices)
    draw = np.random.default_rng(0)
    known = [np.ones(subject.n_vertices, bool)]
    for rings in _RINGS:
        hole = np.zeros(subject.n_vertices, bool)
        hole[draw.integers(subject.n_vertices)] = True
        for _ in range(rings):
            inside = np.repeat(hole, np.diff(offsets))
            hole[neighbours[inside]] = True
        known += [~hole] * _LIFETIME
    return known
