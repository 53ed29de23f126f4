"""The meshes, frames and masks that are measured on."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import dynmesh
from dynmesh.sequence import Mask
from dynmesh.study.measure import Subject
from dynmesh.study.plan import PAPER_SHARES, scenario_masks
from dynmesh.study.style import percent

from .plan import Plan

Frames = NDArray[np.float32]
Faces = NDArray[np.int32]

_RECORDED = "crane"


@dataclass(frozen=True, eq=False)
class Scene:
    """A dynamic mesh and ways to lose its vertices.

    Attributes:
        part: that it plays in the measurements, such as "largest".
        name: of the mesh.
        faces: (m, 3).
        frames: (n, k, 3) whole frames.
        masks: (at most n, k) known masks by name, those of frame 0 included.
        numbering: of the vertices, "natural" or "permuted".
    """

    part: str
    name: str
    faces: Faces
    frames: Frames
    masks: dict[str, Mask]
    numbering: str = "natural"

    @property
    def n_vertices(self) -> int:
        """K."""
        return int(self.frames.shape[1])

    def permuted(self) -> "Scene":
        """The same with its vertices numbered at random."""
        order = np.random.default_rng(0).permutation(self.n_vertices)
        number = np.empty_like(order)
        number[order] = np.arange(self.n_vertices)
        masks = {name: np.ascontiguousarray(mask[:, order]) for name, mask in self.masks.items()}
        faces = number[self.faces].astype(np.int32)
        frames = np.ascontiguousarray(self.frames[:, order])
        return Scene(self.part, self.name, faces, frames, masks, "permuted")


def low_resolution(plan: Plan) -> Scene:
    """The recorded person where it is there, else the built-in one; 10 002 vertices each."""
    sequence, name = _walker(plan), "walker"
    folder = os.environ.get("DYNMESH_DATA", Path(__file__).parents[2] / "shared" / "data")
    path = Path(folder) / f"{_RECORDED}.npz"
    if path.exists() and not plan.tiny:
        sequence, name = dynmesh.read(path), _RECORDED
    return _scene("low-resolution", name, sequence.faces, sequence.vertices[: plan.frames + 1])


def subdivided(plan: Plan) -> Scene:
    """The built-in person, every triangle cut in four."""
    walker = _walker(plan)
    frames, faces = _cut_in_four(walker.vertices[: plan.subdivided[0] + 1], walker.faces)
    return _scene("subdivided", "walker, every triangle cut in four", faces, frames)


def largest(plan: Plan) -> Scene:
    """The built-in sea on a fine grid.

    A camera's view of a million vertices takes too long to find; instead, the sea is hidden where
    it lies below its median level.
    """
    n_frames = plan.largest[0] + 1
    sea = dynmesh.synth.ocean(n_frames, grid=plan.largest_grid)
    masks = random_masks(sea.vertices)
    if plan.structured_frames > 0:
        few = sea.vertices[: plan.structured_frames + 1]
        masks["troughs"] = few[..., 2] >= np.median(few[..., 2], axis=1, keepdims=True)
        subject = Subject("sea", few, sea.faces, "z", 0)
        masks["patches"] = np.stack(scenario_masks("patches", subject, 0))
    return Scene("largest", "sea", sea.faces.astype(np.int32), sea.vertices, masks)


def grid(side: int, n_frames: int) -> Scene:
    """The built-in sea on a grid."""
    sea = dynmesh.synth.ocean(n_frames + 1, grid=side)
    masks = random_masks(sea.vertices, (0.1, 0.5))
    return Scene("sizes", "sea", sea.faces.astype(np.int32), sea.vertices, masks)


def swept(scene: Scene) -> Scene:
    """The same mesh, more and more of which is known."""
    shares = tuple(round(0.05 * step, 2) for step in range(1, 20))
    masks = random_masks(scene.frames, shares)
    return Scene("unknown", scene.name, scene.faces, scene.frames, masks)


def random_masks(frames: Frames, shares: tuple[float, ...] = PAPER_SHARES) -> dict[str, Mask]:
    """Masks by their share."""

    def masks(share: float) -> Iterator[Mask]:
        return dynmesh.degrade.random_known(len(frames), frames.shape[1], share)

    return {percent(share): np.stack(list(masks(share))) for share in shares}


def _walker(plan: Plan) -> dynmesh.Sequence:
    """A person with 10 002 vertices, or for tests a small sheet."""
    return dynmesh.synth.ocean(8, grid=12) if plan.tiny else dynmesh.synth.walker()


def _scene(part: str, name: str, faces: NDArray[np.integer[Any]], frames: Any) -> Scene:
    frames = np.ascontiguousarray(frames, np.float32)
    subject = Subject(name, frames, faces, "y" if name == _RECORDED else "z", 0)
    masks = random_masks(frames)
    for loss in ("camera", "patches"):
        masks[loss] = np.stack(scenario_masks(loss, subject, 0))
    return Scene(part, name, faces.astype(np.int32), frames, masks)


def _cut_in_four(frames: Frames, faces: NDArray[np.integer[Any]]) -> tuple[Frames, Faces]:
    """Puts a vertex in the middle of every edge, behind the others."""
    corners = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    edges, edge_of = np.unique(np.sort(corners, axis=1), axis=0, return_inverse=True)
    middles = frames[:, edges].mean(axis=2, dtype=np.float32)
    ab, bc, ca = (edge_of.reshape(-1, 3) + frames.shape[1]).T
    a, b, c = faces.T
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    # The four parts of a triangle one after another, as a numbering that people meet has them.
    finer = np.stack([np.stack(part, axis=1) for part in parts], axis=1).reshape(-1, 3)
    return np.concatenate([frames, middles], axis=1), finer.astype(np.int32)
