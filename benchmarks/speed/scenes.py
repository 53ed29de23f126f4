"""The meshes, frames and losses on which speed is measured."""

import os
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from dynmesh import Sequence, synth
from dynmesh.sequence import Mask, Positions
from dynmesh.study.completion import Faces
from dynmesh.study.losses import PAPER_SHARES, SCENARIOS, losses, scenario_masks
from dynmesh.study.subjects import Subject, from_file

from ..compiled import REPOSITORY
from .plan import SpeedPlan

_RECORDED = "crane"


@dataclass(frozen=True, eq=False)
class Scene:
    """A sequence in the types of the C++ library, and losses of its vertices.

    Attributes:
        subject: the sequence, with float32 positions and int32 faces.
        masks: (k,) known masks of every frame by the name of the loss, those of frame 0 included.
    """

    subject: Subject
    masks: dict[str, list[Mask]]

    @classmethod
    def of(
        cls,
        subject: Subject,
        shares: Iterable[float] = PAPER_SHARES,
        scenarios: Iterable[str] = tuple(SCENARIOS),
    ) -> "Scene":
        """Return a scene with vertices lost at random and by scenarios."""
        vertices = np.ascontiguousarray(subject.vertices, np.float32)
        faces = np.ascontiguousarray(subject.faces, np.int32)
        subject = replace(subject, vertices=vertices, faces=faces)
        return cls(subject, losses(subject, shares, scenarios))

    def permuted(self) -> "Scene":
        """Return the same scene with its vertices in random order."""
        order = np.random.default_rng(0).permutation(self.subject.n_vertices)
        number = np.empty_like(order)
        number[order] = np.arange(len(order))
        faces = number[self.subject.faces].astype(np.int32)
        frames = np.ascontiguousarray(self.subject.vertices[:, order])
        masks = {name: [mask[order] for mask in of_loss] for name, of_loss in self.masks.items()}
        return Scene(replace(self.subject, faces=faces, vertices=frames), masks)


def low_resolution(plan: SpeedPlan) -> Scene:
    """Return the recorded person if it is available, else the walker; both have 10 002 vertices."""
    folder = os.environ.get("DYNMESH_DATA", REPOSITORY.parent / "shared" / "data")
    path = Path(folder) / f"{_RECORDED}.npz"
    if path.exists() and not plan.tiny:
        return Scene.of(from_file(path, plan.frames, up="y"))
    return Scene.of(Subject.of("walker", _walker(plan), "z", 0, plan.frames))


def subdivided(plan: SpeedPlan) -> Scene:
    """Return the walker, with every triangle cut in four."""
    walker = _walker(plan)
    frames, faces = _cut_in_four(walker.vertices[: min(plan.frames, 21)], walker.faces)
    return Scene.of(Subject("walker, every triangle cut in four", frames, faces, "z", 0))


def largest(plan: SpeedPlan) -> Scene:
    """Return a sea on a fine grid.

    It takes too long to find what a camera sees of a million vertices. Instead, the vertices below
    the median level of the sea are hidden, in one frame, as patches are.
    """
    sea = Subject.of("sea", synth.ocean(7, grid=plan.largest_grid), "z", 0, plan.frames)
    scene = Scene.of(sea, scenarios=())
    few = replace(sea, vertices=sea.vertices[:2])
    height = few.vertices[..., 2]
    scene.masks["troughs"] = list(height >= np.median(height, axis=1, keepdims=True))
    scene.masks["patches"] = scenario_masks("patches", few)
    return scene


def grid(side: int, n_frames: int) -> Scene:
    """Return a sea on a grid."""
    sea = synth.ocean(n_frames + 1, grid=side)
    return Scene.of(Subject.of("sea", sea, "z", 0, None), (0.1, 0.5), ())


def _walker(plan: SpeedPlan) -> Sequence:
    return synth.ocean(8, grid=12) if plan.tiny else synth.walker()


def _cut_in_four(frames: Positions, faces: Faces) -> tuple[Positions, Faces]:
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
