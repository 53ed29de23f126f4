"""A human figure of exactly 10002 vertices and 20000 triangles, with a skeleton to pose it by.

The connectivity is the surface of a figure stacked from cells of a cubic lattice. Its shape is
the smooth union of tapered capsules, onto which that surface is projected while it is relaxed.

Rest pose: metres, x to the figure's right, y forward, z up, soles at 0, arms straight out.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Point = tuple[float, float, float]
Bone = tuple[str, int]  # name, and LEFT, RIGHT or MIDLINE

LEFT, MIDLINE, RIGHT = -1, 0, 1
SIDES = (LEFT, RIGHT)

_HIP, _KNEE, _ANKLE = (0.095, 0.025, 0.89), (0.095, 0.0, 0.50), (0.095, -0.01, 0.085)
_SHOULDER, _ELBOW, _WRIST = (0.188, 0.0, 1.408), (0.455, 0.0, 1.42), (0.71, 0.0, 1.42)

# Bone, parent, and the joint between them, parents first. Joints at positive x come in pairs.
_SKELETON = (
    ("pelvis", "", (0.0, 0.0, 0.92)),
    ("spine", "pelvis", (0.0, -0.01, 1.06)),
    ("chest", "spine", (0.0, -0.01, 1.20)),
    ("neck", "chest", (0.0, -0.01, 1.46)),
    ("head", "neck", (0.0, 0.01, 1.55)),
    ("clavicle", "chest", (0.03, 0.0, 1.42)),
    ("upper arm", "clavicle", _SHOULDER),
    ("forearm", "upper arm", _ELBOW),
    ("hand", "forearm", _WRIST),
    ("thigh", "pelvis", _HIP),
    ("shin", "thigh", _KNEE),
    ("foot", "shin", _ANKLE),
)

# Bone, ends and radii of each capsule of flesh. Capsules that start at positive x come in pairs.
_CAPSULES = (
    ("pelvis", (-0.055, -0.005, 0.94), (0.055, -0.005, 0.94), 0.094, 0.094),
    ("pelvis", (-0.052, 0.0, 1.00), (0.052, 0.0, 1.00), 0.083, 0.083),
    ("pelvis", (0.07, -0.055, 0.90), (0.07, -0.045, 0.95), 0.070, 0.060),
    ("spine", (-0.05, 0.003, 1.07), (0.05, 0.003, 1.07), 0.077, 0.077),
    ("spine", (-0.053, 0.005, 1.14), (0.053, 0.005, 1.14), 0.078, 0.078),
    ("chest", (-0.062, 0.004, 1.21), (0.062, 0.004, 1.21), 0.084, 0.084),
    ("chest", (-0.076, 0.003, 1.28), (0.076, 0.003, 1.28), 0.088, 0.088),
    ("chest", (-0.090, 0.0, 1.345), (0.090, 0.0, 1.345), 0.084, 0.084),
    ("clavicle", (0.05, -0.012, 1.435), (0.16, -0.004, 1.418), 0.054, 0.047),
    ("clavicle", (0.03, -0.018, 1.475), (0.13, -0.010, 1.43), 0.030, 0.042),
    ("neck", (0.0, -0.02, 1.44), (0.0, 0.005, 1.55), 0.060, 0.053),
    ("head", (0.0, -0.012, 1.650), (0.0, 0.012, 1.655), 0.084, 0.084),
    ("head", (0.0, 0.038, 1.625), (0.0, 0.052, 1.57), 0.060, 0.043),
    ("head", (0.0, 0.088, 1.645), (0.0, 0.104, 1.62), 0.016, 0.016),
    ("upper arm", (0.185, 0.0, 1.42), (0.435, 0.0, 1.42), 0.053, 0.037),
    ("forearm", (0.475, 0.0, 1.42), _WRIST, 0.038, 0.022),
    ("hand", (0.735, 0.022, 1.42), (0.855, 0.022, 1.415), 0.012, 0.009),
    ("hand", (0.735, 0.0, 1.42), (0.875, 0.0, 1.415), 0.012, 0.009),
    ("hand", (0.735, -0.022, 1.42), (0.845, -0.022, 1.415), 0.012, 0.009),
    ("hand", (0.745, 0.02, 1.415), (0.79, 0.068, 1.41), 0.016, 0.014),
    ("thigh", (0.095, 0.0, 0.92), (0.095, 0.0, 0.515), 0.078, 0.045),
    ("shin", (0.095, 0.0, 0.475), _ANKLE, 0.043, 0.032),
    ("shin", (0.096, -0.024, 0.40), (0.094, -0.020, 0.30), 0.034, 0.030),
    ("foot", (0.095, -0.04, 0.034), (0.10, 0.05, 0.045), 0.030, 0.030),
    ("foot", (0.10, 0.04, 0.040), (0.112, 0.145, 0.022), 0.030, 0.018),
    ("foot", (0.095, 0.04, 0.040), (0.088, 0.155, 0.022), 0.030, 0.020),
)
_BLEND = 0.013  # metres over which neighbouring capsules melt into one another

# The lattice figure's right half, in cells from the mirror plane, the ankles' axis and the floor.
# Sizes follow the girths and lengths of the limbs and make a surface of exactly 10000 squares.
_CELL = 0.015  # metres
_BOXES = (
    ((2, 10), (-5, 4), (32, 54)),  # thigh
    ((3, 9), (-4, 3), (5, 32)),  # shin
    ((3, 9), (-5, 12), (0, 5)),  # foot
    ((0, 11), (-7, 5), (54, 65)),  # pelvis
    ((0, 10), (-6, 5), (65, 81)),  # waist
    ((0, 11), (-7, 5), (81, 97)),  # chest
    ((11, 47), (-3, 2), (92, 97)),  # arm
    ((47, 59), (-4, 3), (93, 96)),  # hand
    ((49, 53), (3, 6), (93, 96)),  # thumb
    ((0, 3), (-4, 3), (97, 103)),  # neck
    ((0, 5), (-5, 7), (103, 117)),  # head
)
_RELAXATIONS = 20
_WEIGHT_DIFFUSIONS = 45  # a standard deviation of about four edges, the bend of a joint


def _sides(point: Point) -> tuple[int, ...]:
    return SIDES if point[0] > 0.0 else (MIDLINE,)


def _on_side(point: Point, side: int) -> Floats:
    return np.array(point) * (side or 1, 1, 1)


JOINTS: dict[Bone, Floats] = {
    (name, side): _on_side(joint, side) for name, _, joint in _SKELETON for side in _sides(joint)
}


def _parent(bone: Bone) -> Bone | None:
    """Return the bone that carries `bone`, on its own side if that side has one."""
    name, side = bone
    above = next(parent for child, parent, _ in _SKELETON if child == name)
    return next((b for b in ((above, side), (above, MIDLINE)) if b in JOINTS), None)


PARENTS: dict[Bone, Bone | None] = {bone: _parent(bone) for bone in JOINTS}


@dataclass(frozen=True, eq=False)
class Pose:
    """Where the bones are in `n` frames: (n, 3, 3) rotations from rest and (n, 3) joints."""

    rotations: dict[Bone, Floats]
    joints: dict[Bone, Floats]

    def carried(self, bone: Bone, point: Floats) -> Floats:
        """Return where (n, 3) the rest pose `point` (3,) is when it moves with `bone`."""
        return self.joints[bone] + self.rotations[bone] @ (point - JOINTS[bone])


@dataclass(frozen=True, eq=False)
class Body:
    """The figure at rest.

    `vertices` (10002, 3) in metres, `faces` (20000, 3) oriented outward, and skinning `weights`
    (10002, b), one column per bone in the order of `JOINTS`, rows summing to one.
    """

    vertices: Floats
    faces: NDArray[np.int32]
    weights: Floats

    def skinned(self, pose: Pose) -> NDArray[np.float32]:
        """Return the vertices (n, 10002, 3) in `pose`, by dual quaternions (Kavan et al. 2007)."""
        bones = _dual_quaternions(pose)
        points = np.ascontiguousarray(self.vertices.T)
        weights = np.ascontiguousarray(self.weights.T)
        frames = np.empty((len(bones), *self.vertices.shape), dtype=np.float32)
        for frame, dual_quaternions in zip(frames, bones, strict=True):
            blend = dual_quaternions.T @ weights
            blend /= np.linalg.norm(blend[:4], axis=0)
            w, v, dual_w, dual_v = blend[0], blend[1:4], blend[4], blend[5:]
            turned = np.cross(v, np.cross(v, points, axis=0) + w * points + dual_v, axis=0)
            frame[:] = (points + 2.0 * (turned + w * dual_v - dual_w * v)).T
        return frames


@lru_cache(maxsize=4)
def body_of_girth(girth: float) -> Body:
    """Return the figure with all its flesh `girth` times as thick as usual.

    All calls share its arrays, which are read-only.
    """
    corners, squares = _lattice_surface()
    neighbours = _neighbour_table(squares)
    flesh = _Flesh(girth)
    vertices = corners.astype(np.float64) * _CELL
    for _ in range(_RELAXATIONS):
        vertices = flesh.project(_averaged(vertices, neighbours))
    bones = list(JOINTS)
    owners = np.array([bones.index(bone) for bone in flesh.bones])
    weights = np.eye(len(bones))[owners[flesh.nearest(vertices)]]
    for _ in range(_WEIGHT_DIFFUSIONS):
        weights = _averaged(weights, neighbours)
    triangles = np.concatenate([squares[:, [0, 1, 2]], squares[:, [0, 2, 3]]])
    body = Body(vertices, triangles.astype(np.int32), weights)
    for array in (body.vertices, body.faces, body.weights):
        array.flags.writeable = False
    return body


def _lattice_surface() -> tuple[Integers, Integers]:
    """Return the lattice figure's corners (k, 3) in cells and its squares (q, 4), outward."""
    boxes = np.array(_BOXES)
    high = boxes[:, :, 1].max(axis=0) + 1
    low = np.array([-high[0], *(boxes[:, 1:, 0].min(axis=0) - 1)])
    filled = np.zeros(high - low, dtype=np.int8)
    for x, y, z in boxes:
        for x0, x1 in (x, -x[::-1]):
            filled[x0 - low[0] : x1 - low[0], slice(*y - low[1]), slice(*z - low[2])] = 1
    unit = np.eye(3, dtype=np.int64)
    squares = []
    for axis in range(3):
        a, b = unit[(axis + 1) % 3], unit[(axis + 2) % 3]
        outward_up = np.array([0 * a, a, a + b, b])
        for step, ring in ((-1, outward_up), (1, outward_up[::-1])):
            cells = np.argwhere(np.diff(filled, axis=axis) == step) + unit[axis]
            squares.append(cells[:, None] + ring)
    corners, index = np.unique(np.concatenate(squares).reshape(-1, 3), axis=0, return_inverse=True)
    return corners + low, index.reshape(-1, 4)


def _neighbour_table(squares: Integers) -> Integers:
    """Return each vertex's neighbours (k, valence), short rows filled up with the vertex itself."""
    source = squares.ravel()
    order = np.argsort(source, kind="stable")
    valence = np.bincount(source)
    rank = np.arange(len(source)) - np.repeat(np.cumsum(valence) - valence, valence)
    table = np.repeat(np.arange(len(valence))[:, None], valence.max(), axis=1)
    table[source[order], rank] = np.roll(squares, -1, axis=1).ravel()[order]
    return table


def _averaged(values: Floats, neighbours: Integers) -> Floats:
    """Return each vertex's mean over its row of `neighbours`: one step of diffusion."""
    return np.asarray(np.mean([values[column] for column in neighbours.T], axis=0))


class _Flesh:
    """The smooth union of the capsules: the zero level of a soft minimum of their distances."""

    def __init__(self, girth: float) -> None:
        rows = [
            ((bone, side), _on_side(start, side), _on_side(end, side), (r0 * girth, r1 * girth))
            for bone, start, end, r0, r1 in _CAPSULES
            for side in _sides(start)
        ]
        bones, starts, ends, radii = zip(*rows, strict=True)
        # Paired flesh may belong to a bone on the midline.
        self.bones = [bone if bone in JOINTS else (bone[0], MIDLINE) for bone in bones]
        self._starts, self._radii = np.array(starts), np.array(radii)
        self._spans = np.array(ends) - self._starts

    def nearest(self, points: Floats) -> Integers:
        """Return the index of the capsule nearest to each of `points` (k, 3)."""
        return np.asarray(np.argmin(self._distances(points)[0], axis=1))

    def project(self, points: Floats) -> Floats:
        """Return `points` (k, 3) moved by one Newton step towards the surface."""
        distances, lengths, along = self._distances(points)
        nearest = distances.min(axis=1, keepdims=True)
        shares = np.exp((nearest - distances) / _BLEND)
        total = shares.sum(axis=1, keepdims=True)
        level = nearest - _BLEND * np.log(total)
        pull = shares / (total * lengths)
        axis_points = pull @ self._starts + (pull * along) @ self._spans
        gradient = points * pull.sum(axis=1, keepdims=True) - axis_points
        return np.asarray(points - level * gradient / np.sum(gradient**2, axis=1, keepdims=True))

    def _distances(self, points: Floats) -> tuple[Floats, Floats, Floats]:
        """Return (k, c) distances to the capsules and their axes, and places in 0..1 on these."""
        squared_span = np.sum(self._spans**2, axis=1)
        projected = points @ self._spans.T - np.sum(self._starts * self._spans, axis=1)
        along = np.clip(projected / squared_span, 0.0, 1.0)
        to_start = (
            np.sum(points**2, axis=1, keepdims=True)
            - 2.0 * points @ self._starts.T
            + np.sum(self._starts**2, axis=1)
        )
        squared = to_start + along * (along * squared_span - 2.0 * projected)
        lengths = np.sqrt(np.maximum(squared, 1e-12))
        growth = self._radii[:, 1] - self._radii[:, 0]
        return lengths - self._radii[:, 0] - along * growth, lengths, along


def _dual_quaternions(pose: Pose) -> Floats:
    """Return the bones' rigid motions (n, b, 8), each on its parent's side of the hypersphere."""
    real: dict[Bone, Floats] = {}
    motions = []
    for bone, parent in PARENTS.items():
        q = _quaternions(pose.rotations[bone])
        if parent is not None:
            q[np.sum(q * real[parent], axis=1) < 0.0] *= -1.0
        real[bone] = q
        shift = pose.carried(bone, np.zeros(3))
        w, v = q[:, :1], q[:, 1:]
        dual_w = -np.sum(shift * v, axis=1, keepdims=True)
        dual_v = w * shift + np.cross(shift, v)
        motions.append(np.concatenate([q, 0.5 * dual_w, 0.5 * dual_v], axis=1))
    return np.stack(motions, axis=1)


def _quaternions(rotations: Floats) -> Floats:
    """Return unit quaternions (n, 4), scalar first, of `rotations` (n, 3, 3)."""
    trace = np.trace(rotations, axis1=1, axis2=2)
    outer = np.empty((len(rotations), 4, 4))  # four times the quaternion's outer square
    outer[:, 0, 0] = 1.0 + trace
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        outer[:, i + 1, i + 1] = 1.0 - trace + 2.0 * rotations[:, i, i]
        outer[:, 0, i + 1] = outer[:, i + 1, 0] = rotations[:, k, j] - rotations[:, j, k]
        outer[:, i + 1, j + 1] = outer[:, j + 1, i + 1] = rotations[:, i, j] + rotations[:, j, i]
    longest = np.argmax(np.diagonal(outer, axis1=1, axis2=2), axis=1)
    rows = outer[np.arange(len(outer)), longest]
    return np.asarray(rows / np.linalg.norm(rows, axis=1, keepdims=True))
