"""What moves rigidly is completed exactly by method detail, whatever is hidden."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from meshes import Array, Mesh, bumpy_torus, join, sheet
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import dynmesh

Mask = NDArray[np.bool_]

BOX = Mesh(
    np.array([[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4],
              [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5]]),
    np.array([[x, y, z] for x in (0, 1.0) for y in (0, 0.7) for z in (0, 0.5)]),
)  # fmt: skip
TETRAHEDRON = Mesh(
    np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]]),
    np.array([[0, 0, 0], [1, 0, 0.1], [0.2, 0.9, 0], [0.3, 0.2, 1.1]]),
)
WALKER = dynmesh.synth.walker(2)
SHEET = sheet(9)
ROW, NEARLY_1 = SHEET.vertices[:, 1:2] == 4, np.array([0, 1 - 1e-7, 0])
CORNERS = SHEET.vertices[SHEET.faces].reshape(-1, 3)
BODIES = {
    "sheet": SHEET,
    "torus": bumpy_torus(14),
    "box": BOX,
    "tetrahedron": TETRAHEDRON,
    "walker": Mesh(WALKER.faces.astype(np.int64), WALKER.vertices[0].astype(np.float64)),
}
ODD = {
    "two coincident vertices": Mesh(SHEET.faces, SHEET.vertices[[*range(41), 40, *range(42, 81)]]),
    "needles": Mesh(SHEET.faces, SHEET.vertices * [1, 1e-9, 1]),
    "a row of needles": Mesh(SHEET.faces, np.where(ROW, SHEET.vertices - NEARLY_1, SHEET.vertices)),
    "single triangles": Mesh(np.arange(len(CORNERS)).reshape(-1, 3), CORNERS),
}
SETTINGS: dict[str, Callable[[Mesh], dict[str, Any]]] = {
    "plain": lambda _: {},
    "learn": lambda _: {"learn": True},
    "uncertainty": lambda _: {"uncertainty": True},
    "outliers": lambda _: {"reject_outliers": True},
    "noise": lambda _: {"noise": 0.01},
    "training": lambda mesh: {"training": [mesh.vertices * [1, 1, 1 + 0.1 * n] for n in range(4)]},
}


def diagonal(vertices: Array) -> float:
    return float(np.linalg.norm(np.ptp(vertices, axis=0)))


def moved(vertices: Array, axis: Array, angle: float) -> Array:
    """Turned about an axis through the origin, and shifted along it by as much of the diagonal."""
    unit = axis / np.linalg.norm(axis)
    shift = 0.3 * angle * diagonal(vertices) * unit
    return np.asarray(Rotation.from_rotvec(angle * unit).apply(vertices) + shift)


def largest_error(
    mesh: Mesh, frames: list[Array], masks: list[Mask], **settings: Any
) -> tuple[float, dynmesh.Completer]:
    """The largest error of a vertex in all frames, as a share of the diagonal."""
    completer = dynmesh.Completer(mesh.faces, mesh.vertices, **settings)
    largest = 0.0
    for truth, known in zip(frames, masks, strict=True):
        given_points = np.where(known[:, None], truth, np.nan)
        completed = completer.push(given_points, known)
        largest = max(largest, float(np.linalg.norm(completed - truth, axis=1).max()))
        assert abs(completer.report.blend) <= 1.5
    return largest / diagonal(mesh.vertices), completer


def not_in_line(vertices: Array, known: Mask) -> bool:
    if known.sum() < 3:
        return False
    spread = np.linalg.svd(vertices[known] - vertices[known].mean(axis=0), compute_uv=False)
    return bool(spread[1] > 0.01 * spread[0])


def hidden_sets(mesh: Mesh, kind: str, n: int, rng: np.random.Generator) -> list[Mask]:
    """Known masks of n frames in each of which at least three vertices are not in a line."""
    k = len(mesh.vertices)

    def drawn() -> Mask:
        if kind == "half":
            along = mesh.vertices @ rng.normal(size=3)
            return np.asarray(along >= np.sort(along)[-max(k // 2, 3)])
        number = {"three": 3, "four": 4, "tenth": max(k // 10, 3), "all but one": k - 1}[kind]
        known = np.zeros(k, bool)
        known[rng.choice(k, number, replace=False)] = True
        return known

    def chosen() -> Mask:
        while not not_in_line(mesh.vertices, known := drawn()):
            pass
        return known

    if kind in ("half", "all but one"):  # for ever
        return [chosen()] * n
    return [chosen() for _ in range(n)]


@pytest.mark.parametrize("settings", SETTINGS)
@given(
    st.sampled_from([name for name in BODIES if name != "walker"]),
    st.sampled_from(["half", "three", "four", "tenth", "all but one"]),
    st.floats(0.1, 170),
    st.integers(0, 2**32 - 1),
)
def test_a_body_that_turns(settings: str, body: str, kind: str, degrees: float, seed: int) -> None:
    mesh, rng = BODIES[body], np.random.default_rng(seed)
    axis = rng.normal(size=3)
    frames = [moved(mesh.vertices, axis, np.radians(degrees) * n) for n in range(1, 9)]
    masks = hidden_sets(mesh, kind, len(frames), rng)
    assert largest_error(mesh, frames, masks, **SETTINGS[settings](mesh))[0] < 1e-6


@pytest.mark.parametrize(
    ("body", "kind", "degrees", "n"),
    [
        ("torus", "half", 0.1, 400),
        ("torus", "three", 7.0, 400),
        ("sheet", "half", 1.0, 90),
        ("box", "four", 5.0, 400),
        pytest.param("walker", "half", 2.0, 90, marks=pytest.mark.slow),
    ],
)
def test_a_body_that_turns_for_long(
    body: str, kind: str, degrees: float, n: int, rng: np.random.Generator
) -> None:
    mesh = BODIES[body]
    frames = [
        moved(mesh.vertices, np.array([0.2, 1, 0.4]), np.radians(degrees) * i) for i in range(n)
    ]
    assert largest_error(mesh, frames, hidden_sets(mesh, kind, n, rng))[0] < 1e-6


@pytest.mark.parametrize("body", ODD)
def test_an_odd_mesh_that_turns(body: str, rng: np.random.Generator) -> None:
    mesh = ODD[body]
    frames = [moved(mesh.vertices, np.array([0.2, 1, 0.4]), 0.1 * n) for n in range(1, 9)]
    masks = [rng.random(len(mesh.vertices)) < 0.3 for _ in frames]
    assert largest_error(mesh, frames, masks)[0] < 1e-6


def test_a_body_that_has_bent_and_then_turns(rng: np.random.Generator) -> None:
    """Hidden parts keep the shape in which they were last seen."""
    mesh = BODIES["torus"]
    bends = [mesh.vertices + 0.05 * n * mesh.vertices[:, [1, 2, 0]] ** 2 for n in range(1, 6)]
    turns = [moved(bends[-1], np.array([1, 0.3, 0.2]), 0.1 * n) for n in range(1, 60)]
    everything = np.ones(len(mesh.vertices), bool)
    masks = [everything] * len(bends) + hidden_sets(mesh, "half", len(turns), rng)
    assert largest_error(mesh, bends + turns, masks)[0] < 1e-6


PARTS = [bumpy_torus(14), *(Mesh(sheet(4).faces, 0.2 * sheet(4).vertices * [1, 1, 0] + at) for at in
         ([4.5, 0, 0], [-4.5, 1, 0], [0, -4.5, 0.5], [0, 0, 2]))]  # fmt: skip
PARTED = join(*PARTS)
PART = np.repeat(np.arange(len(PARTS)), [len(part.vertices) for part in PARTS])


@pytest.mark.parametrize("number", [*range(13), "row"])
def test_small_parts_of_which_few_vertices_are_known(
    number: int | str, rng: np.random.Generator
) -> None:
    """Also if the known ones are a row, which does not determine a rotation."""
    frames = [moved(PARTED.vertices, np.array([0.3, 1, 0.2]), 0.17 * n) for n in range(1, 12)]
    masks = []
    for _ in frames:
        known = (PART == 0) & (rng.random(len(PART)) < 0.3)
        for part in range(1, len(PARTS)):
            own = np.flatnonzero(part == PART)
            if isinstance(number, int):
                known[rng.choice(own, number, replace=False)] = True
            else:
                known[own[:4]] = True
        masks.append(known)
    assert largest_error(PARTED, frames, masks)[0] < 1e-6


TWO = join(bumpy_torus(12), Mesh(sheet(8).faces, sheet(8).vertices * [2, 0.2, 0.2] + [6, 0, 0]),
           Mesh(BOX.faces, 0.3 * BOX.vertices + [9, 2, 0]))  # fmt: skip
BODY = np.repeat([0, 1, 1], [144, 64, 8])


@pytest.mark.parametrize("kind", ["tenth", "half", "three"])
@pytest.mark.parametrize("of_button", [0, 1, 2, 8])
def test_two_bodies_each_of_which_turns(
    kind: str, of_button: int, rng: np.random.Generator
) -> None:
    """The second one is a long sheet with a small box beside it, which moves with it."""
    frames, masks = [], []
    ends = [hidden_sets(Mesh(TWO.faces, TWO.vertices[a:b]), kind, 20, rng)
            for a, b in ((0, 144), (144, 208))]  # fmt: skip
    for n in range(20):
        one = moved(TWO.vertices, np.array([1, 0.2, 0]), 0.05 * (n + 1))
        other = moved(TWO.vertices, np.array([0, -0.4, 1]), 0.3 * (n + 1))
        frames.append(np.where(BODY[:, None] == 0, one, other))
        button = np.zeros(8, bool)
        button[rng.choice(8, of_button, replace=False)] = True
        masks.append(np.concatenate([ends[0][n], ends[1][n], button]))
    assert largest_error(TWO, frames, masks)[0] < 1e-6


def test_their_standard_errors_are_not_far_too_small(rng: np.random.Generator) -> None:
    for kind in ("half", "four"):
        mesh = BODIES["torus"]
        completer = dynmesh.Completer(mesh.faces, mesh.vertices, uncertainty=True)
        for n, known in enumerate(hidden_sets(mesh, kind, 60, rng), 1):
            truth = moved(mesh.vertices, np.array([0.2, 1, 0.4]), 0.1 * n)
            off = np.linalg.norm(completer.push(truth, known) - truth, axis=1)[~known]
            rounding = 1e-14 * diagonal(mesh.vertices) * n
            assert (100 * completer.standard_error[~known] + rounding > off).all()


GROWTH = 1.01 ** np.arange(1, 61)
"""The sizes of 60 frames, as of a body that grows by 1 % in each."""


@pytest.mark.parametrize("settings", ["plain", "learn", "uncertainty", "outliers", "training"])
@pytest.mark.parametrize("body", ["sheet", "torus", "box", "walker"])
def test_a_body_that_turns_and_grows(body: str, settings: str, rng: np.random.Generator) -> None:
    """One half is never seen. The last frames, four times as large, are as good as any other."""
    mesh = BODIES[body]
    sizes = [*GROWTH, 2.0, 2.8, 4.0, 4.5]
    frames = [
        size * moved(mesh.vertices, np.array([0.2, 1, 0.4]), 0.05 * n)
        for n, size in enumerate(sizes)
    ]
    masks = hidden_sets(mesh, "half", len(frames), rng)
    error, completer = largest_error(mesh, frames, masks, **SETTINGS[settings](mesh))
    assert error < 1e-9
    assert completer.report.quality == "good"


def test_a_body_that_grows_beside_another_one(rng: np.random.Generator) -> None:
    frames = [np.where(BODY[:, None] == 0, size, 1) * TWO.vertices for size in GROWTH]
    known = np.concatenate([hidden_sets(Mesh(TWO.faces, TWO.vertices[own]), "half", 1, rng)[0]
                            for own in (slice(144), slice(144, 208), slice(208, 216))])  # fmt: skip
    assert largest_error(TWO, frames, [known] * len(frames))[0] < 1e-9


def test_a_body_that_bends_and_grows(rng: np.random.Generator) -> None:
    """Its errors and their standard errors grow as it does."""
    mesh = bumpy_torus(20)
    x, y, z = mesh.vertices.T
    bends = [0.15 * np.sin(0.3 * n) for n in range(1, 61)]
    bent = [np.stack([x, y, z + bend * x**2], axis=1) for bend in bends]
    (known,) = hidden_sets(mesh, "half", 1, rng)

    def errors(sizes: Array) -> Array:
        """Of positions, and standard ones, divided by the sizes."""
        completer = dynmesh.Completer(mesh.faces, mesh.vertices, uncertainty=True)
        found = []
        for shape, size in zip(bent, sizes, strict=True):
            off = np.linalg.norm(completer.push(size * shape, known) / size - shape, axis=1)
            standard = completer.standard_error / size
            found.append([off[~known].mean(), standard[~known].mean()])
        return np.asarray(np.mean(found, axis=0))

    of_position, standard = errors(GROWTH) / errors(np.ones(60))
    assert of_position < 1.3
    assert 0.7 < standard < 1.5
