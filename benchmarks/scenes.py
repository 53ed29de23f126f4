"""The meshes, frames and losses on which speed is measured."""

import os
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import dynmesh
from dynmesh.sequence import Mask
from dynmesh.study.losses import SCENARIOS, losses, scenario_masks
from dynmesh.study.subjects import Subject, from_file

from .plan import SpeedPlan

Frames = NDArray[np.float32]
Faces = NDArray[np.int32]

_RECORDED = "crane"


@dataclass(frozen=True, eq=False)
class Scene:
    """A sequence in the types of the C++ library, and losses of its vertices.

    Attributes:
        part: the part of the measurements that uses it, such as "largest".
        subject: the sequence, with float32 positions and int32 faces.
        masks: (at most n, k) known masks by name, those of frame 0 included.
        numbering: the order of the vertices, "natural" or "permuted".
    """

    part: str
    subject: Subject
    masks: dict[str, Mask]
    numbering: str = "natural"

    @property
    def name(self) -> str:
        """The name of the sequence."""
        return self.subject.name

    @property
    def n_vertices(self) -> int:
        """The number of vertices of a frame."""
        return self.subject.n_vertices

    @property
    def faces(self) -> Faces:
        """The (m, 3) faces."""
        return np.ascontiguousarray(self.subject.faces, np.int32)

    @property
    def frames(self) -> Frames:
        """The (n, k, 3) complete frames."""
        return np.ascontiguousarray(self.subject.vertices, np.float32)

    def permuted(self) -> "Scene":
        """Return the same scene with its vertices in random order."""
        order = np.random.default_rng(0).permutation(self.n_vertices)
        number = np.empty_like(order)
        number[order] = np.arange(self.n_vertices)
        masks = {name: np.ascontiguousarray(mask[:, order]) for name, mask in self.masks.items()}
        faces = number[self.faces].astype(np.int32)
        frames = np.ascontiguousarray(self.frames[:, order])
        subject = replace(self.subject, faces=faces, vertices=frames)
        return Scene(self.part, subject, masks, "permuted")


def low_resolution(plan: SpeedPlan) -> Scene:
    """Return the recorded person if it is available, else the walker; both have 10 002 vertices."""
    folder = os.environ.get("DYNMESH_DATA", Path(__file__).parents[2] / "shared" / "data")
    path = Path(folder) / f"{_RECORDED}.npz"
    if path.exists() and not plan.tiny:
        subject = from_file(path, plan.frames, up="y")
    else:
        subject = _subject("walker", _walker(plan), plan.frames)
    return _scene("low-resolution", subject, plan.shares)


def subdivided(plan: SpeedPlan) -> Scene:
    """Return the walker, with every triangle cut in four."""
    walker = _walker(plan)
    frames, faces = _cut_in_four(walker.vertices[: plan.subdivided[0] + 1], walker.faces)
    subject = Subject("walker, every triangle cut in four", frames, faces, "z", 0)
    return _scene("subdivided", subject, plan.shares)


def largest(plan: SpeedPlan) -> Scene:
    """Return a sea on a fine grid.

    It takes too long to find what a camera sees of a million vertices. Instead, the vertices below
    the median level of the sea are hidden.
    """
    n_frames = plan.largest[0] + 1
    sea = _subject("sea", dynmesh.synth.ocean(n_frames, grid=plan.largest_grid))
    scene = _scene("largest", sea, plan.shares, ())
    if plan.structured_frames > 0:
        few = replace(sea, vertices=sea.vertices[: plan.structured_frames + 1])
        height = few.vertices[..., 2]
        scene.masks["troughs"] = height >= np.median(height, axis=1, keepdims=True)
        scene.masks["patches"] = np.stack(scenario_masks("patches", few))
    return scene


def grid(side: int, n_frames: int) -> Scene:
    """Return a sea on a grid."""
    sea = _subject("sea", dynmesh.synth.ocean(n_frames + 1, grid=side))
    return _scene("sizes", sea, (0.1, 0.5), ())


def swept(scene: Scene, plan: SpeedPlan) -> Scene:
    """Return the same sequence with more and more of its vertices known."""
    return _scene("unknown", scene.subject, plan.sweep, ())


def _walker(plan: SpeedPlan) -> dynmesh.Sequence:
    return dynmesh.synth.ocean(8, grid=12) if plan.tiny else dynmesh.synth.walker()


def _subject(name: str, sequence: dynmesh.Sequence, frames: int | None = None) -> Subject:
    return Subject.of(name, sequence, "z", 0, frames)


def _scene(
    part: str,
    subject: Subject,
    shares: Iterable[float],
    scenarios: Iterable[str] = tuple(SCENARIOS),
) -> Scene:
    vertices = np.ascontiguousarray(subject.vertices, np.float32)
    subject = replace(subject, vertices=vertices, faces=subject.faces.astype(np.int32))
    masks = losses(subject, shares, scenarios)
    return Scene(part, subject, {name: np.stack(of_loss) for name, of_loss in masks.items()})


def _cut_in_four(frames: Frames, faces: NDArray[np.integer[Any]]) -> tuple[Frames, Faces]:
    """Add a vertex in the middle of every edge, after the existing vertices."""
    corners = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    edges, edge_of = np.unique(np.sort(corners, axis=1), axis=0, return_inverse=True)
    middles = frames[:, edges].mean(axis=2, dtype=np.float32)
    ab, bc, ca = (edge_of.reshape(-1, 3) + frames.shape[1]).T
    a, b, c = faces.T
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    # The four parts of a triangle follow one another, as in files that modelling programs write.
    finer = np.stack([np.stack(part, axis=1) for part in parts], axis=1).reshape(-1, 3)
    return np.concatenate([frames, middles], axis=1), finer.astype(np.int32)
