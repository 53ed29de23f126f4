"""Parts of which nothing or little is known move with the parts that they belong to."""

from collections.abc import Callable
from functools import partial
from typing import Any, Literal

import numpy as np
import pytest
from meshes import Array, Mesh
from numpy.typing import NDArray
from parts import Part, ball, joined, on_joints, turned

import dynmesh

Mask = NDArray[np.bool_]
Method = Literal["detail", "motion"]
METHODS: list[Method] = ["detail", "motion"]
FRAMES = 20


def eye_beside_a_hand() -> list[Part]:
    """An eye in a head that turns, and a hand that touches it in frame 0 and leaves."""
    head = ball(4, (0.8, 0.9, 1.1), np.zeros(3))
    place = head.vertices[np.linalg.norm(head.vertices - [0.3, -0.8, 0.1], axis=1).argmin()]

    def shaken(x: Array, frame: int) -> Array:
        return turned((0, 0.2, 1), 0.2 * np.sin(0.4 * frame), x, np.zeros(3))

    return [
        Part(head, shaken),
        Part(ball(3, (0.4, 0.3, 0.3), 1.45 * place), lambda x, n: x + n * np.array([0, -0.1, 0])),
        Part(ball(2, (0.12, 0.12, 0.12), 0.97 * place), shaken),
    ]


def balls_in_joints() -> list[Part]:
    """Six links, each of which turns on the one before, and a ball inside of each joint."""

    def part(subdivisions: int, radii: tuple[float, float, float], x: float, link: int) -> Part:
        centre = np.array([0.98 * x, 0, 0])
        return Part(ball(subdivisions, radii, centre), partial(on_joints, link=link))

    links = [part(3, (0.52, 0.35, 0.25), n, n) for n in range(6)]
    return links + [part(1, (0.08, 0.07, 0.06), n + 0.47, n) for n in range(5)]


def button_beside_a_table() -> list[Part]:
    """A sleeve that leaves a table, which its button is nearer to in frame 0."""

    def lifted(x: Array, frame: int) -> Array:
        x = x + frame * np.array([0, 0.02, 0.04])
        return turned((0, 1, 0.3), 0.06 * frame, x, np.zeros(3))

    return [
        Part(ball(3, (0.8, 0.2, 0.2), np.array([0, 0, 0.25])), lifted),
        Part(ball(3, (1, 1, 0.2), np.array([0, 0, -0.22])), lambda x, _: x),
        Part(ball(1, (0.05, 0.05, 0.03), np.array([0, 0, -0.02])), lifted),
    ]


Known = Callable[[int, NDArray[np.int64], np.random.Generator], Mask]


def errors(
    parts: list[Part], known: Known, **settings: Any
) -> tuple[Array, NDArray[np.int64], dynmesh.Completer]:
    """The error of each vertex in each frame but the first, in mean edges."""
    faces, frames, labels = joined(parts, FRAMES)
    completer = dynmesh.Completer(faces, frames[0], **settings)
    rng = np.random.default_rng(0)
    edges = frames[0][faces] - frames[0][np.roll(faces, 1, axis=1)]
    found = []
    for n, truth in enumerate(frames[1:], 1):
        completed = completer.push(truth, known(n, labels, rng))
        found.append(np.linalg.norm(completed - truth, axis=1))
    return np.array(found) / np.linalg.norm(edges, axis=2).mean(), labels, completer


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("scene", "seen", "largest"),
    [
        (eye_beside_a_hand, 2, 0.1),
        (balls_in_joints, 6, 2.0),  # led by one of two links, which turn by up to 1 radian
    ],
)
def test_what_is_never_seen_stays_where_it_belongs(
    method: Method, scene: Callable[[], list[Part]], seen: int, largest: float
) -> None:
    """The bounds are in mean edges."""

    def half(_: int, labels: NDArray[np.int64], rng: np.random.Generator) -> Mask:
        return np.asarray((labels < seen) & (rng.random(len(labels)) < 0.5))

    found, labels, _ = errors(scene(), half, method=method)
    assert found[:, labels >= seen].max() < largest


def button_is_seen_until(last: int, n: int, labels: NDArray[np.int64], _: Any) -> Mask:
    return np.asarray((labels < 2) | (n <= last))


@pytest.mark.parametrize("method", METHODS)
def test_a_part_follows_what_kept_its_distance_while_both_were_seen(method: Method) -> None:
    parts = button_beside_a_table()
    for last, least, most in ((0, 4.0, np.inf), (3, 0.0, 1e-6)):
        found, labels, completer = errors(
            parts, partial(button_is_seen_until, last), method=method, disconnected="follow"
        )
        assert least <= found[-1, labels == 2].max() <= most
    faces, frames, _ = joined(parts, FRAMES + 1)
    known = labels < 2
    other = dynmesh.Completer(faces, frames[1], method=method)  # with other pairs of components
    other.restore(completer.state())
    expected = completer.push(frames[-1], known)
    np.testing.assert_array_equal(other.push(frames[-1], known), expected)
    np.testing.assert_array_equal(other.state(), completer.state())


def test_a_part_follows_what_kept_its_distance_in_training() -> None:
    parts = button_beside_a_table()
    _, frames, _ = joined(parts, 6)
    never = partial(button_is_seen_until, 0)
    found, labels, _ = errors(parts, never, training=list(frames))
    assert found[:, labels == 2].max() < 1e-6


@pytest.mark.parametrize("method", METHODS)
def test_a_part_follows_through_parts_that_are_not_seen_if_no_other_is_near(method: Method) -> None:
    """A chain of parts, of which the first alone is seen, beside one that is a hundred away."""

    def moved(x: Array, frame: int) -> Array:
        return turned((0, 0.3, 1), 0.1 * frame, x, np.array([0, 1.0, 0]))

    chain = [Part(ball(1, (0.6, 0.4, 0.3), np.array([1.15 * n, 0, 0])), moved) for n in range(9)]
    far = Part(ball(1, (0.6, 0.4, 0.3), np.array([60.0, 0, 0])), lambda x, n: x + 0.3 * n)

    def ends(_: int, labels: NDArray[np.int64], __: Any) -> Mask:
        return np.asarray((labels == 0) | (labels == 9))

    found, _, _ = errors([*chain, far], ends, method=method)
    assert found.max() < 1e-6


def test_two_known_vertices_leave_the_turn_about_their_line_to_what_leads() -> None:
    """A box on a shaft that spins about the line of the two, beside another body that does not."""
    axis = np.array([1.0, 0.3, -0.2]) / np.linalg.norm([1.0, 0.3, -0.2])

    def spun(x: Array, frame: int) -> Array:
        return np.asarray(
            turned(tuple(axis), 0.2 * frame, x, np.zeros(3)) + 0.1 * frame * axis[::-1]
        )

    box = ball(1, (0.3, 0.3, 0.3), 1.3 * axis)
    on_axis = np.concatenate([box.vertices, [1.1 * axis, 1.5 * axis]])
    caps = [[len(box.vertices), 0, 1], [len(box.vertices) + 1, 2, 3]]  # join both to the box
    parts = [
        Part(ball(3, (1, 0.7, 0.8), np.zeros(3)), spun),
        Part(ball(3, (0.8, 0.7, 0.9), 2.2 * axis + [0, 0.5, 0.3]), lambda x, n: x - 0.1 * n),
        Part(Mesh(np.concatenate([box.faces, caps]), on_axis), spun),
    ]

    def known(count: int, _: int, labels: NDArray[np.int64], rng: np.random.Generator) -> Mask:
        mask = (labels < 2) & (rng.random(len(labels)) < 0.5)
        mask[len(mask) - count :] = True
        return mask

    for count in (0, 1, 2):
        found, labels, _ = errors(parts, partial(known, count))
        assert found[:, labels == 2].max() < 0.05  # mean edges


def debris(seed: int) -> list[Part]:
    """Twelve bodies each of which tumbles and moves on its own."""
    rng = np.random.default_rng(seed)

    def body() -> Part:
        centre, axis, step = 3 * rng.normal(size=3), rng.normal(size=3), 0.1 * rng.normal(size=3)
        angle = rng.uniform(0.03, 0.2)

        def moved(x: Array, frame: int) -> Array:
            return turned(tuple(axis), angle * frame, x, centre) + frame * step

        return Part(ball(2, tuple(rng.uniform(0.3, 0.7, 3)), centre), moved)

    return [body() for _ in range(12)]


@pytest.mark.parametrize("number", [1, 2])
@pytest.mark.parametrize("are_same", [True, False])
@pytest.mark.parametrize("are_others_seen", [True, False])
def test_standard_errors_say_that_a_turn_is_not_known(
    number: int, are_same: bool, are_others_seen: bool
) -> None:
    """Of all bodies, or of half of them, only so many vertices are known, the same or others."""

    def few(_: int, labels: NDArray[np.int64], rng: np.random.Generator) -> Mask:
        known = are_others_seen & (labels >= 6) & (rng.random(len(labels)) < 0.3)
        rng = np.random.default_rng(3) if are_same else rng
        for part in range(6 if are_others_seen else 12):
            known[rng.choice(np.flatnonzero(labels == part), number, replace=False)] = True
        return known

    ratios = []
    for seed in range(3):
        faces, frames, labels = joined(debris(seed), FRAMES)
        completer = dynmesh.Completer(faces, frames[0], uncertainty=True)
        rng = np.random.default_rng(seed)
        for n, truth in enumerate(frames[1:], 1):
            known = few(n, labels, rng)
            off = np.linalg.norm(completer.push(truth, known) - truth, axis=1)
            is_filled = ~known & ((labels < 6) | (not are_others_seen))
            ratios.append(off[is_filled] / completer.standard_error[is_filled])
    ratio = np.concatenate(ratios)
    assert (ratio <= 2.5).mean() > 0.8
    assert (ratio <= 0.5).mean() < 0.5  # nor are they far too large


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("known", [0, 1, 2])
def test_numbers_of_vertices_and_components_do_not_decide(
    method: Method, known: int, rng: np.random.Generator
) -> None:
    """Equal boxes in a grid, of which many are equally near to each other."""
    box = ball(1, (0.3, 0.3, 0.3), np.zeros(3))
    symmetric = box.vertices / np.linalg.norm(box.vertices, axis=1)[:, None] * 0.3

    def moved(x: Array, frame: int, place: Array) -> Array:
        return turned((place[0] + 1, 1, place[1]), 0.1 * frame, x, np.zeros(3)) + 0.05 * frame

    places = [np.array([x, y, 0.0]) for x in range(3) for y in range(3)]
    parts = [Part(Mesh(box.faces, symmetric + at), partial(moved, place=at)) for at in places]
    faces, frames, labels = joined(parts, 12)
    order = rng.permutation(len(labels))
    place_of = np.argsort(order)
    first, second = (
        dynmesh.Completer(f, x, method=method)
        for f, x in ((faces, frames[0]), (rng.permutation(place_of[faces]), frames[0][order]))
    )
    for n, truth in enumerate(frames[1:]):
        mask = (labels % 4 == 0) & (rng.random(len(labels)) < 0.5)
        for part in (1, 5, 6):
            mask[rng.choice(np.flatnonzero(labels == part), known if n else 9, replace=False)] = (
                True
            )
        expected = first.push(truth, mask)
        np.testing.assert_allclose(
            second.push(truth[order], mask[order]), expected[order], atol=1e-9
        )
