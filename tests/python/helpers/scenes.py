"""Scenes in which a body moves, and changes of them that must not change what is made of them."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from meshes import Array, Mesh, bumpy_torus, join, sheet
from scans_of_meshes import scan_of
from scipy.spatial.transform import Rotation

N_FRAMES = 6
N_POINTS = 150  # of scans, few enough that the tracker uses all of them in every step


class Scene(NamedTuple):
    """What operations work on.

    Attributes:
        faces: (m, 3).
        frames: (n, k, 3) of which frame 0 is whole.
        known: (n, k).
        other: (n, k, 3) wrong frames, for `evaluate`.
        training: (6, k, 3).
        points, normals: a scan (p, 3) of each frame.
        sensors: (3, 3) two places from which it was scanned, and one to which they look.
        turns: (n, 3, 3) how far the body has turned.
        unit: the length of a unit.
        frame: the number of the frame that is registered or put together.
    """

    faces: Array
    frames: Array
    known: Array
    other: Array
    training: Array
    points: Array
    normals: Array
    sensors: Array
    turns: Array
    unit: float = 1.0
    frame: int = 3

    def moved(self, change: Callable[[Array], Array], turn: Array) -> "Scene":
        """With all positions changed, and directions turned."""
        lengths = ("frames", "other", "training", "points", "sensors")
        moved = {name: change(getattr(self, name)) for name in lengths}
        return self.with_arrays(**moved, normals=self.normals @ turn.T)

    def picked(self, frames: Array, frame: int) -> "Scene":
        """With frames repeated."""
        names = ("frames", "known", "other", "points", "normals", "turns")
        picked = {name: getattr(self, name)[frames] for name in names}
        return self.with_arrays(**picked)._replace(frame=frame)

    def with_arrays(self, **arrays: Array) -> "Scene":
        fields: dict[str, Any] = {**self._asdict(), **arrays}
        return Scene(**fields)

    @property
    def size(self) -> float:
        return float(np.abs(self.frames).max())


def scene_of(kind: str, seed: int) -> Scene:
    """A body that bends and turns, of which some is hidden, in a scene away from the origin."""
    rng = np.random.default_rng(seed)
    mesh = bumpy_torus(12) if kind == "torus" else sheet(12)
    axis, rate, phase = rng.normal(size=3), rng.uniform(0.02, 0.1), rng.uniform(0, 6)
    rest = mesh.vertices - mesh.vertices.mean(axis=0)

    def turn_at(time: float) -> Rotation:
        return Rotation.from_rotvec(rate * time * axis / np.linalg.norm(axis))

    def pose(time: float) -> Array:
        bend = 0.15 * np.sin(0.6 * time + phase + 0.5 * rest[:, :1]) * np.array([0, 0.4, 1])
        return np.asarray(turn_at(time).apply(rest + bend) + 0.1 * time)

    frames = np.stack([pose(n) for n in range(N_FRAMES)])
    turns = np.stack([turn_at(n).as_matrix() for n in range(N_FRAMES)])
    known = rng.random(frames.shape[:2]) < 0.5
    hidden = np.linalg.norm(rest - rest[rng.integers(len(rest))], axis=1) < 2.5
    known &= ~hidden
    known[0] = True
    scans = [scan_of(mesh, frame, N_POINTS, rng) for frame in frames]
    other = frames + 0.05 * np.sin(3 * frames[..., [1, 2, 0]])
    training = np.stack([pose(0.7 * n - 9) for n in range(6)])
    points, normals = (np.stack(each) for each in zip(*scans, strict=True))
    sensors = np.array([[14.0, 2, 6], [-10, -9, 5], [0, 0, 0]])
    return Scene(mesh.faces, frames, known, other, training, points, normals, sensors, turns)


class Change(NamedTuple):
    """A changed scene, and what of its results should be those of the original one.

    Attributes:
        scene: the changed scene.
        points: how positions change.
        scale: how lengths change.
        vertices: the vertex of the changed scene for each one of the original.
        frames: the frames of the changed scene that show those of the original.
    """

    scene: Scene
    points: Callable[[Array], Array] = lambda points: points
    scale: float = 1.0
    vertices: Any = slice(None)
    frames: Any = slice(None)


def turned(scene: Scene, rng: np.random.Generator) -> Change:
    turn = Rotation.random(random_state=int(rng.integers(2**31))).as_matrix()
    shift = scene.size * rng.uniform(-1, 1, 3)
    return Change(scene.moved(lambda p: p @ turn.T + shift, turn), lambda p: p @ turn.T + shift)


def in_another_unit(scene: Scene, rng: np.random.Generator) -> Change:
    unit = rng.choice([1000 / 3, 2.0**-60, 2.0**40])
    moved = scene.moved(lambda p: unit * p, np.eye(3))
    return Change(moved._replace(unit=unit * scene.unit), lambda p: unit * p, unit)


def mirrored(scene: Scene, rng: np.random.Generator) -> Change:
    axis = np.ones(3)
    axis[rng.integers(3)] = -1
    moved = scene.moved(lambda p: p * axis, np.diag(axis))
    return Change(moved._replace(faces=scene.faces[:, ::-1]), lambda p: p * axis)


def renumbered(scene: Scene, rng: np.random.Generator) -> Change:
    new = rng.permutation(scene.frames.shape[1])  # vertex v becomes new[v]
    old = np.argsort(new)
    names = ("frames", "known", "other", "training")
    moved = {name: getattr(scene, name)[:, old] for name in names}
    return Change(scene.with_arrays(**moved, faces=new[scene.faces]), vertices=new)


def in_another_order(scene: Scene, rng: np.random.Generator) -> Change:
    faces = rng.permutation(scene.faces)
    corner = rng.integers(3, size=(len(faces), 1))
    points = rng.permutation(scene.points.shape[1])
    return Change(
        scene.with_arrays(
            faces=np.take_along_axis(faces, (corner + np.arange(3)) % 3, 1),
            points=scene.points[:, points],
            normals=scene.normals[:, points],
        )
    )


def with_neighbour(scene: Scene, mesh: Mesh, frames: Array, rng: np.random.Generator) -> Change:
    k = scene.frames.shape[1]
    scan = scan_of(mesh, frames[0], N_POINTS, rng)
    joined = join(Mesh(scene.faces, scene.frames[0]), mesh)
    more = {
        "faces": joined.faces,
        "frames": np.concatenate([scene.frames, frames], axis=1),
        "other": np.concatenate([scene.other, frames], axis=1),
        "training": np.concatenate([scene.training, np.stack([frames[0]] * 6)], axis=1),
        "known": np.concatenate([scene.known, np.ones(frames.shape[:2], bool)], axis=1),
        "points": np.concatenate([scene.points, [scan[0]] * len(scene.frames)], axis=1),
        "normals": np.concatenate([scene.normals, [scan[1]] * len(scene.frames)], axis=1),
    }
    return Change(scene.with_arrays(**more), vertices=slice(0, k))


def beside_what_rests(scene: Scene, rng: np.random.Generator) -> Change:
    mesh = bumpy_torus(10)
    away = mesh.vertices + np.array([30.0, 5, -4])
    return with_neighbour(scene, mesh, np.stack([away] * len(scene.frames)), rng)


def twice(scene: Scene, _: np.random.Generator) -> Change:
    k, away = scene.frames.shape[1], scene.turns @ np.array([30.0, 5, -4])
    away = away[:, None]
    more = {
        name: np.concatenate([getattr(scene, name), getattr(scene, name) + away], axis=1)
        for name in ("frames", "other", "training", "points")
    }
    return Change(
        scene.with_arrays(
            faces=np.concatenate([scene.faces, scene.faces + k]),
            known=np.tile(scene.known, (1, 2)),
            normals=np.tile(scene.normals, (1, 2, 1)),
            **more,
        ),
        vertices=slice(0, k),
    )


def repeated(scene: Scene, _: np.random.Generator) -> Change:
    n = len(scene.frames)
    frames = np.concatenate([[0], np.repeat(np.arange(1, n), 2)])
    return Change(scene.picked(frames, 2 * scene.frame), frames=slice(1, None, 2))


def after_a_rest(scene: Scene, _: np.random.Generator) -> Change:
    scene = scene.picked(np.concatenate([[0] * 3, np.arange(len(scene.frames))]), scene.frame + 3)
    return Change(scene, frames=slice(3, None))


def in_single_precision(scene: Scene, _: np.random.Generator) -> Change:
    names = ("frames", "other", "training", "points", "normals", "sensors")
    return Change(scene.with_arrays(**{n: getattr(scene, n).astype(np.float32) for n in names}))


CHANGES: dict[str, Callable[[Scene, np.random.Generator], Change]] = {
    "turned": turned,
    "in another unit": in_another_unit,
    "mirrored": mirrored,
    "vertices renumbered": renumbered,
    "faces and points in another order": in_another_order,
    "beside what rests": beside_what_rests,
    "twice": twice,
    "frames repeated": repeated,
    "after a rest": after_a_rest,
    "single precision": in_single_precision,
}
