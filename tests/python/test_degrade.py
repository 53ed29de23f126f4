"""Simulated losses and noise."""

import inspect
from collections.abc import Callable, Iterator
from typing import Any

import meshes
import numpy as np
import pytest
from broken_sequences import walker
from hypothesis import given, settings
from hypothesis import strategies as st
from meshes import Mesh

import dynmesh
from dynmesh import degrade
from dynmesh.degrade import Camera

Array = meshes.Array

NEAR_X = Camera((4.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 60.0)
"""A camera that looks along -x at the origin, with z up and y to the right."""


def seen(mesh: Mesh, *cameras: Camera) -> Array:
    """Returns the mask of frame 1, since frame 0 is always complete."""
    frames = [mesh.vertices, mesh.vertices]
    return list(degrade.camera_known(frames, mesh.faces, cameras))[1]


def in_image(vertices: Array, camera: Camera) -> Array:
    """Decides visibility by angles, unlike the implementation."""
    ray = vertices - camera.position
    ahead = np.subtract(camera.target, camera.position)
    right = np.cross(ahead, camera.up)
    up = np.cross(right, ahead)
    depth = ray @ (ahead / np.linalg.norm(ahead))
    half = np.radians(camera.field_of_view / 2)
    across = [np.arctan2(ray @ (axis / np.linalg.norm(axis)), depth) for axis in (right, up)]
    return np.asarray((depth > 0) & (np.abs(across) <= half).all(axis=0))


def hidden_by_rays(mesh: Mesh, camera: Camera, which: Array) -> Array:
    """Tests segments from camera to vertex against every triangle (Moeller and Trumbore 1997)."""
    a, b, c = mesh.vertices[mesh.faces.T].astype(np.float64)
    start = np.array(camera.position)
    s = start - a
    q = np.cross(s, b - a)
    hidden = []
    for vertex in which:
        ray = mesh.vertices[vertex] - start
        p = np.cross(ray, c - a)
        with np.errstate(divide="ignore", invalid="ignore"):  # degenerate triangles hide nothing
            determinant = ((b - a) * p).sum(axis=1)
            u = (s * p).sum(axis=1) / determinant
            v = (q @ ray) / determinant
            t = ((c - a) * q).sum(axis=1) / determinant
            inside = (u >= 0) & (v >= 0) & (u + v <= 1)
        hit = inside & (t > 0) & (t < 1 - 1e-7)
        hidden.append((hit & ~(mesh.faces == vertex).any(axis=1)).any())
    return np.array(hidden, bool)


def seen_by_rays(mesh: Mesh, camera: Camera) -> Array:
    visible = in_image(mesh.vertices, camera)
    which = np.flatnonzero(visible)
    visible[which] = ~hidden_by_rays(mesh, camera, which)
    return visible


def potato(rng: np.random.Generator) -> Mesh:
    """A closed surface with dents: an octahedron with edges halved twice and random radii."""
    vertices = [*np.eye(3), *-np.eye(3)]
    faces = [(x, y, z) for x in (0, 3) for y in (1, 4) for z in (2, 5)]
    for _ in range(2):
        middles: dict[tuple[int, int], int] = {}

        def middle(a: int, b: int, middles: dict[tuple[int, int], int] = middles) -> int:
            edge = (min(a, b), max(a, b))
            if edge not in middles:
                middles[edge] = len(vertices)
                vertices.append(vertices[a] + vertices[b])
            return middles[edge]

        halved = [(a, b, c, middle(a, b), middle(b, c), middle(c, a)) for a, b, c in faces]
        faces = [
            face
            for a, b, c, ab, bc, ca in halved
            for face in [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        ]
    directions = np.array(vertices) / np.linalg.norm(vertices, axis=1, keepdims=True)
    return Mesh(np.array(faces), directions * rng.uniform(0.5, 1.3, (len(vertices), 1)))


def square(x: float, size: float = 1.0, n: int = 12) -> Mesh:
    """A flat grid perpendicular to x."""
    faces = meshes.sheet(n).faces
    z, y = (a.ravel() for a in np.indices((n, n)) / (n - 1) - 0.5)
    return Mesh(faces, np.stack([np.full(n * n, x), size * y, size * z], axis=1))


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_closed_meshes_hide_what_exact_rays_say(seed: int) -> None:
    rng = np.random.default_rng(seed)
    apart = rng.normal(size=3)
    first, second = potato(rng), potato(rng)
    mesh = meshes.join(first, Mesh(second.faces, second.vertices + apart))
    position = 4 * (direction := rng.normal(size=3)) / np.linalg.norm(direction)
    camera = Camera(tuple(position), (0, 0, 0), tuple(rng.normal(size=3)), 35.0)
    expected = seen_by_rays(mesh, camera)
    assert expected.mean() < 0.9
    np.testing.assert_array_equal(seen(mesh, camera), expected)


@given(meshes.meshes(), st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_triangles_through_the_plane_of_the_camera_hide_what_exact_rays_say(
    mesh: Mesh, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    position, target, up = (tuple(vector) for vector in rng.normal(size=(3, 3)))
    camera = Camera(position, target, up, 120.0)
    np.testing.assert_array_equal(seen(mesh, camera), seen_by_rays(mesh, camera))


@pytest.mark.parametrize("frame", [2, 20])
def test_the_walker_hides_what_exact_rays_say(frame: int) -> None:
    figure = walker()
    mesh = Mesh(figure.faces.astype(np.int64), figure.vertices[frame])
    (camera,) = degrade.orbit(figure.vertices[0])(5 * frame // 2)
    known = seen(mesh, camera)
    some = np.random.default_rng(frame).choice(len(known), 500, replace=False)
    expected = in_image(mesh.vertices, camera)[some] & ~hidden_by_rays(mesh, camera, some)
    assert 0.1 < expected.mean() < 0.5
    assert (known[some] == expected).mean() >= 0.998  # one vertex, which depends on rounding


@pytest.mark.parametrize("cells", [1, 7, 2000])
def test_the_grid_has_no_influence(cells: int, monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = potato(np.random.default_rng(3))
    expected = seen(mesh, NEAR_X)
    monkeypatch.setattr(inspect.getmodule(Camera), "_GRID", cells)
    np.testing.assert_array_equal(seen(mesh, NEAR_X), expected)


def test_work_in_small_portions_is_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    mesh = potato(np.random.default_rng(4))
    expected = seen(mesh, NEAR_X)
    monkeypatch.setattr(inspect.getmodule(Camera), "_PAIRS_AT_ONCE", 10)
    np.testing.assert_array_equal(seen(mesh, NEAR_X), expected)


@pytest.mark.parametrize("gap", [1.0, 0.01, 1e-4])
@pytest.mark.parametrize("turned", [False, True])
def test_the_front_sheet_hides_the_back_one(gap: float, turned: bool) -> None:
    front, back = square(0.0), square(-gap, 0.99)
    if turned:
        front = Mesh(front.faces[:, ::-1], front.vertices)
    known = seen(meshes.join(front, back), NEAR_X)
    assert known[:144].all()
    assert not known[144:].any()


@pytest.mark.parametrize("size", [1e-3, 1e4])
def test_what_hides_does_not_depend_on_the_unit(size: float) -> None:
    mesh = potato(np.random.default_rng(5))
    camera = Camera((4 * size, 0, 0), (0, 0, 0), (0, 0, 1), 60.0)
    larger = Mesh(mesh.faces, mesh.vertices * size)
    np.testing.assert_array_equal(seen(larger, camera), seen(mesh, NEAR_X))


@pytest.mark.parametrize("degrees", [0.0, 60.0, 85.0, 89.0, 89.9])
def test_a_sheet_at_a_grazing_angle_does_not_hide_itself(degrees: float) -> None:
    flat = square(0.0, n=40)
    vertices = meshes.turned(flat.vertices, np.radians(degrees)).astype(np.float32)
    assert seen(Mesh(flat.faces, vertices), NEAR_X).all()


def test_a_triangle_seen_edge_on_does_not_hide_its_own_vertices() -> None:
    rng = np.random.default_rng(8)
    for _ in range(300):
        a, b = rng.uniform(-0.5, 0.5, (2, 3))
        c = a + rng.uniform(0.2, 0.8) * (np.array(NEAR_X.position) - a)
        assert seen(Mesh(np.array([[0, 1, 2]]), np.stack([a, b, c])), NEAR_X).all()


def test_a_large_triangle_hides_many_vertices_and_a_small_one_few() -> None:
    back = square(-1.0)
    large = Mesh(np.array([[0, 1, 2]]), np.array([[1.0, -9, -9], [1, 9, -9], [1, 0, 30]]))
    assert not seen(meshes.join(back, large), NEAR_X)[:144].any()
    vertex = 5 * 12 + 5
    between = 0.5 * (back.vertices[vertex] + NEAR_X.position)
    small = Mesh(large.faces, between + 1e-5 * large.vertices * [0, 1, 1])
    known = seen(meshes.join(back, small), NEAR_X)[:144]
    assert np.flatnonzero(~known).tolist() == [vertex]


def test_vertices_behind_or_beside_the_image_are_not_seen() -> None:
    points = np.array([[0, 0, 0], [9, 0, 0], [4, 0, 0], [0, 2.2, 0], [0, 2.4, 0], [0, 0, -2.4]])
    nothing = np.empty((0, 3), np.int64)
    known = seen(Mesh(nothing, points.astype(np.float64)), NEAR_X)
    assert known.tolist() == [True, False, False, True, False, False]
    assert not seen(Mesh(nothing, points[1:3].astype(np.float64)), NEAR_X).any()


def test_a_triangle_that_passes_the_camera_hides_only_what_is_ahead() -> None:
    back = square(0.0)
    roof = Mesh(np.array([[0, 1, 2]]), np.array([[6.0, -9, 0.1], [6, 9, 0.1], [1, 0, 0.1]]))
    known = seen(meshes.join(back, roof), NEAR_X)[:144]
    # The tip of the roof is at 0.1 above the axis, 3 ahead of the camera.
    hidden = back.vertices[~known]
    assert len(hidden) > 5
    assert hidden[:, 2].min() > 0.1 / 3 * 4 - 1e-9
    behind = Mesh(roof.faces, roof.vertices + np.array([4.0, 0, 0]))
    assert seen(meshes.join(back, behind), NEAR_X)[:144].all()


def test_vertices_in_one_place_do_not_hide_each_other() -> None:
    sheet = square(0.0)
    known = seen(meshes.join(sheet, sheet), NEAR_X)
    assert known.all()


def test_what_is_not_finite_is_not_seen_and_hides_nothing() -> None:
    for value in (np.nan, np.inf, -np.inf):
        front, back = square(1.0), square(-1.0)
        front.vertices[::2, 1] = value
        known = seen(meshes.join(front, back), NEAR_X)
        assert not known[:144:2].any()
        assert known[1:144:2].all()
        assert known[144:].all()


def test_several_cameras_see_what_any_of_them_sees() -> None:
    mesh = potato(np.random.default_rng(6))
    opposite = Camera((-4, 0, 0), (0, 0, 0), (0, 0, 1), 60.0)
    one, other = seen(mesh, NEAR_X), seen(mesh, opposite)
    assert (one != other).any()
    np.testing.assert_array_equal(seen(mesh, NEAR_X, opposite), one | other)


def test_moving_cameras_are_asked_for_every_frame_after_the_first() -> None:
    mesh = potato(np.random.default_rng(7))
    cameras = degrade.orbit(mesh.vertices, 2, degrees_per_frame=30.0)
    asked = []

    def logged(frame: int) -> list[Camera]:
        asked.append(frame)
        return cameras(frame)

    masks = list(degrade.camera_known([mesh.vertices] * 4, mesh.faces, logged))
    assert masks[0].all()
    assert asked == [1, 2, 3]
    for frame in (1, 2, 3):
        np.testing.assert_array_equal(masks[frame], seen(mesh, *cameras(frame)))
    assert (masks[1] != masks[2]).any()


def test_cameras_orbit_the_middle_of_the_mesh() -> None:
    box = np.array([[1.0, 2, 3], [3, 5, 9]], np.float32)  # a diagonal of 7 around (2, 3.5, 6)
    cameras = degrade.orbit(box, 4, degrees_per_frame=10.0, elevation=30.0, distance=3.0)
    level, height = 21 * np.cos(np.pi / 6), 21 * 0.5
    offsets = np.array([np.subtract(camera.position, camera.target) for camera in cameras(0)])
    expected = [[level, 0, height], [0, level, height], [-level, 0, height], [0, -level, height]]
    np.testing.assert_allclose(offsets, expected, atol=1e-9)
    for camera in cameras(0):
        assert camera.target == (2.0, 3.5, 6.0)
        assert camera.field_of_view == 40.0
    np.testing.assert_allclose(cameras(9)[0].position, cameras(0)[1].position, atol=1e-9)
    (ahead,) = degrade.orbit(box, up=(5, 0, 0), elevation=0.0)(0)
    np.testing.assert_allclose(ahead.position, [2, 3.5 + 14, 6], atol=1e-9)
    assert ahead.up == (1.0, 0.0, 0.0)


def hidden_patches(**settings: Any) -> Array:
    """Patches on a sheet of 900 vertices, (n, 900), True where hidden."""
    faces = meshes.sheet(30).faces
    arguments = {"n_frames": 100, "share": 0.3, "seed": 2, **settings}
    return ~np.stack(list(degrade.patch_known(faces, n_vertices=900, **arguments)))


def is_connected(patch: Array, faces: Array) -> bool:
    offsets, neighbours = dynmesh.cells(faces, len(patch))
    reached, stack = set(), [int(patch.argmax())]
    while stack:
        v = stack.pop()
        if patch[v] and v not in reached:
            reached.add(v)
            stack.extend(neighbours[offsets[v] : offsets[v + 1]].tolist())
    return len(reached) == int(patch.sum())


def test_a_patch_is_connected_compact_and_of_its_share() -> None:
    for share in (0.0001, 0.1, 0.5, 0.9):
        hidden = hidden_patches(patches=1, share=share)
        assert not hidden[0].any()
        assert (hidden[1:].sum(axis=1) == max(1, round(share * 900))).all()
        assert all(is_connected(patch, meshes.sheet(30).faces) for patch in hidden[1:])
    rows, columns = np.divmod(np.flatnonzero(hidden_patches(patches=1, share=0.1)[1]), 30)
    assert np.ptp(rows) < 20  # 90 vertices: a disc has a diameter of 11
    assert np.ptp(columns) < 20


@pytest.mark.parametrize(("patches", "share"), [(2, 0.3), (4, 0.3), (4, 0.7), (10, 0.2)])
def test_patches_hide_their_share_together(patches: int, share: float) -> None:
    hidden = hidden_patches(patches=patches, share=share, lifetime=1, n_frames=400)
    assert hidden[1:].mean() == pytest.approx(share, abs=0.03)


def test_a_patch_stays_for_its_lifetime_and_jumps() -> None:
    hidden = hidden_patches(patches=1, lifetime=15)
    jumps = 1 + np.flatnonzero((hidden[2:] != hidden[1:-1]).any(axis=1)) + 1
    assert jumps.tolist() == [16, 31, 46, 61, 76, 91]


def test_patches_do_not_jump_all_at_once() -> None:
    hidden = hidden_patches(patches=4, lifetime=12)
    changes = (hidden[2:] & ~hidden[1:-1]).sum(axis=1)
    assert np.flatnonzero(changes).tolist() == list(range(2, 98, 3))
    assert changes.max() <= round((1 - 0.7 ** (1 / 4)) * 900)  # one patch


def test_a_patch_keeps_to_its_component() -> None:
    two = meshes.join(meshes.sheet(3), meshes.sheet(20)).faces
    masks = list(degrade.patch_known(two, 200, 409, 0.5, patches=1, lifetime=1))
    hidden = ~np.stack(masks)[1:]
    assert set(hidden.sum(axis=1).tolist()) == {9, 204}
    assert (hidden[:, :9].any(axis=1) != hidden[:, 9:].any(axis=1)).all()


def test_frames_are_lost_whole_and_at_random() -> None:
    masks = np.stack(list(degrade.dropout(2001, 5, 0.2)))
    assert masks[0].all()
    assert (masks.all(axis=1) | ~masks.any(axis=1)).all()
    lost = ~masks[1:, 0]
    assert lost.mean() == pytest.approx(0.2, abs=0.03)
    assert (lost[1:] & lost[:-1]).mean() == pytest.approx(0.04, abs=0.015)


def frames_of(mesh: Mesh, n: int, dtype: Any = np.float64) -> Array:
    return np.stack([mesh.vertices + i for i in range(n)]).astype(dtype)


def mean_edge(mesh: Mesh) -> float:
    i, j = np.array(sorted({(a, b) for f in mesh.faces.tolist() for a in f for b in f if a < b})).T
    return float(np.linalg.norm(mesh.vertices[i] - mesh.vertices[j], axis=1).mean())


def test_noise_is_gaussian_and_in_mean_edges() -> None:
    mesh = meshes.sheet(40)
    truth = frames_of(mesh, 6)
    noisy = np.stack(list(degrade.add_noise(truth, mesh.faces, 0.25)))
    np.testing.assert_array_equal(noisy[0], truth[0])
    z = (noisy[1:] - truth[1:]) / (0.25 * mean_edge(mesh))  # 24000 numbers
    np.testing.assert_allclose(z.mean(axis=(0, 1)), 0, atol=0.05)
    np.testing.assert_allclose(z.std(axis=(0, 1)), 1, atol=0.04)
    assert (z**4).mean() == pytest.approx(3, abs=0.2)
    correlation = np.corrcoef(z.transpose(0, 2, 1).reshape(15, -1))
    assert np.abs(correlation - np.eye(15)).max() < 0.12
    silent = list(degrade.add_noise(truth, mesh.faces, 0))
    np.testing.assert_array_equal(silent, truth)


def test_outliers_are_few_and_at_their_distance_in_all_directions() -> None:
    mesh = meshes.sheet(40)
    truth = frames_of(mesh, 11)
    frames = np.stack(list(degrade.add_outliers(truth, mesh.faces, 0.05, distance=7.0)))
    np.testing.assert_array_equal(frames[0], truth[0])
    moved = (frames != truth).any(axis=2)
    assert (moved[1:].sum(axis=1) == 80).all()
    assert (moved[1] != moved[2]).any()
    offsets = (frames - truth)[moved] / mean_edge(mesh)
    np.testing.assert_allclose(np.linalg.norm(offsets, axis=1), 7.0)
    np.testing.assert_allclose(offsets.mean(axis=0), 0, atol=0.6)
    np.testing.assert_allclose((offsets**2).mean(axis=0), 49 / 3, rtol=0.15)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_frames_keep_their_dtype_and_their_givers_own_arrays(dtype: Any) -> None:
    mesh = meshes.sheet(5)
    truth = frames_of(mesh, 3, dtype)
    given = truth.copy()
    for frames in (
        degrade.add_noise(given, mesh.faces, 0.1),
        degrade.add_outliers(given, mesh.faces, 0.1),
    ):
        assert {frame.dtype for frame in frames} == {np.dtype(dtype)}
    np.testing.assert_array_equal(given, truth)


SHEET = meshes.sheet(6)

RANDOM: list[Callable[[int, int], Iterator[Array]]] = [
    lambda n, seed: degrade.random_known(n, 36, 0.3, seed=seed),
    lambda n, seed: degrade.patch_known(SHEET.faces, n, 36, 0.3, seed=seed),
    lambda n, seed: degrade.dropout(n, 36, 0.5, seed=seed),
    lambda n, seed: degrade.add_noise(frames_of(SHEET, n), SHEET.faces, 0.1, seed=seed),
    lambda n, seed: degrade.add_outliers(frames_of(SHEET, n), SHEET.faces, 0.2, seed=seed),
]


@pytest.mark.parametrize("make", RANDOM)
def test_equal_seeds_give_equal_frames_however_many(make: Any) -> None:
    frames, again, shorter, other = make(40, 5), make(40, 5), make(7, 5), make(40, 6)
    whole = np.stack(list(frames))
    assert len(whole) == 40
    np.testing.assert_array_equal(whole, np.stack(list(again)))
    np.testing.assert_array_equal(whole[:7], np.stack(list(shorter)))
    assert (whole != np.stack(list(other))).any()


def test_one_seed_for_several_purposes_picks_other_vertices() -> None:
    truth = frames_of(meshes.sheet(30), 2)
    known = list(degrade.random_known(2, 900, 0.1, seed=1))[1]
    frames = list(degrade.add_outliers(truth, meshes.sheet(30).faces, 0.1, seed=1))
    moved = (frames[1] != truth[1]).any(axis=1)
    assert (known & moved).sum() < 30  # 9 on the average


def test_frames_are_taken_one_at_a_time() -> None:
    taken = []

    def stream() -> Iterator[Array]:
        for i, frame in enumerate(frames_of(SHEET, 5)):
            taken.append(i)
            yield frame

    for made in (
        degrade.add_noise(stream(), SHEET.faces, 0.1),
        degrade.add_outliers(stream(), SHEET.faces, 0.1),
        degrade.camera_known(stream(), SHEET.faces, [NEAR_X]),
    ):
        assert taken == []
        for i, _ in enumerate(made):
            assert taken == list(range(i + 1))
        taken.clear()


FRAMES = [SHEET.vertices] * 2
NAN_FRAME = np.where(np.arange(36)[:, None] == 7, np.nan, SHEET.vertices)
POINT = np.ones((4, 3))


@pytest.mark.parametrize("share", [0, 1, np.nan, -0.1])
def test_bad_shares_are_refused_at_the_call(share: float) -> None:
    message = "^share: must be above 0 and below 1, not"
    with pytest.raises(ValueError, match=message):
        degrade.random_known(2, 36, share)
    with pytest.raises(ValueError, match=message):
        degrade.patch_known(SHEET.faces, 2, 36, share)
    with pytest.raises(ValueError, match=message):
        degrade.dropout(2, 36, share)
    with pytest.raises(ValueError, match=message):
        degrade.add_outliers(FRAMES, SHEET.faces, share)


def bad(value: Any) -> Any:
    """Hides the type of an argument from the type checker."""
    return value


@pytest.mark.parametrize(
    ("error", "message", "settings"),
    [
        (TypeError, "share: must be a number, not 'x'", {"share": "x"}),
        (ValueError, "n_frames: must be at least 1, not 0", {"n_frames": 0}),
        (TypeError, "n_frames: must be an integer, not 2.5", {"n_frames": 2.5}),
        (ValueError, "n_vertices: must be at least 1, not 0", {"n_vertices": 0}),
        (TypeError, "n_vertices: must be an integer, not True", {"n_vertices": True}),
        (ValueError, "seed: must be at least 0, not -1", {"seed": -1}),
    ],
)
def test_bad_masks_are_refused_at_the_call(
    error: type[Exception], message: str, settings: Any
) -> None:
    arguments = {"n_frames": 2, "n_vertices": 36, "share": 0.5, **settings}
    for make in (degrade.random_known, degrade.dropout):
        with pytest.raises(error, match=message):
            make(**arguments)
    with pytest.raises(error, match=message):
        degrade.patch_known(SHEET.faces, **arguments)


@pytest.mark.parametrize(
    ("error", "message", "call"),
    [
        (ValueError, "patches: must be at least 1, not 0", lambda: hidden_patches(patches=0)),
        (ValueError, "lifetime: must be at least 1, not 0", lambda: hidden_patches(lifetime=0)),
        (TypeError, "lifetime: must be an integer", lambda: hidden_patches(lifetime=1.5)),
        (
            ValueError,
            "face 0 refers to vertex 6",
            lambda: degrade.patch_known(SHEET.faces, 2, 3, 0.5),
        ),
        (
            ValueError,
            "sigma: must be at least 0, not -0.1",
            lambda: degrade.add_noise(FRAMES, SHEET.faces, -0.1),
        ),
        (
            ValueError,
            "sigma: must be finite, not nan",
            lambda: degrade.add_noise(FRAMES, SHEET.faces, np.nan),
        ),
        (
            ValueError,
            "seed: must be at least 0, not -1",
            lambda: degrade.add_noise(FRAMES, SHEET.faces, 0.1, seed=-1),
        ),
        (
            TypeError,
            "faces: must be integers, not float64",
            lambda: degrade.add_noise(FRAMES, bad(SHEET.faces.astype(float)), 0.1),
        ),
        (
            ValueError,
            "distance: must be positive and finite, not 0",
            lambda: degrade.add_outliers(FRAMES, SHEET.faces, 0.1, distance=0),
        ),
        (
            ValueError,
            "seed: must be at least 0, not -1",
            lambda: degrade.add_outliers(FRAMES, SHEET.faces, 0.1, seed=-1),
        ),
        (
            ValueError,
            r"faces: must have shape \(m, 3\), not \(25, 2\)",
            lambda: degrade.add_outliers(FRAMES, SHEET.faces[:25, :2], 0.1),
        ),
        (
            ValueError,
            "cameras: at least one is needed",
            lambda: degrade.camera_known(FRAMES, SHEET.faces, []),
        ),
        (
            TypeError,
            "faces: must be integers, not float64",
            lambda: degrade.camera_known(FRAMES, bad(SHEET.faces.astype(float)), [NEAR_X]),
        ),
        (
            ValueError,
            "n_cameras: must be at least 1, not 0",
            lambda: degrade.orbit(SHEET.vertices, 0),
        ),
        (
            ValueError,
            "degrees_per_frame: must be finite, not inf",
            lambda: degrade.orbit(SHEET.vertices, degrees_per_frame=np.inf),
        ),
        (
            ValueError,
            "elevation: must be above -90 and below 90, not 90",
            lambda: degrade.orbit(SHEET.vertices, elevation=90),
        ),
        (
            ValueError,
            "distance: must be positive and finite, not -1",
            lambda: degrade.orbit(SHEET.vertices, distance=-1),
        ),
        (
            ValueError,
            r"up: must not be zero, but is \(0, 0, 0\)",
            lambda: degrade.orbit(SHEET.vertices, up=(0, 0, 0)),
        ),
        (
            ValueError,
            "first_frame: must be finite, but vertex 7 is at",
            lambda: degrade.orbit(NAN_FRAME),
        ),
        (
            ValueError,
            "first_frame: must have vertices at more than one position",
            lambda: degrade.orbit(POINT),
        ),
        (
            ValueError,
            r"first_frame: must have shape \(k, 3\) with k at least 1, not \(0, 3\)",
            lambda: degrade.orbit(POINT[:0]),
        ),
        (
            TypeError,
            "first_frame: must be float32 or float64, not int64",
            lambda: degrade.orbit(bad(POINT.astype(np.int64))),
        ),
    ],
)
def test_bad_arguments_are_refused_at_the_call(
    error: type[Exception], message: str, call: Callable[[], Any]
) -> None:
    with pytest.raises(error, match=message):
        call()


@pytest.mark.parametrize(
    ("error", "message", "settings"),
    [
        (ValueError, "position: must be finite, not nan", {"position": (0, np.nan, 0)}),
        (ValueError, r"target: must be three numbers, not \(1, 2\)", {"target": (1, 2)}),
        (TypeError, "up: must be a number, not 'x'", {"up": (0, 0, "x")}),
        (ValueError, "target: must differ from position", {"target": (4, 0, 0)}),
        (ValueError, "up: must not be zero or parallel to the view", {"up": (2, 0, 0)}),
        (ValueError, "up: must not be zero or parallel to the view", {"up": (0, 0, 0)}),
        (ValueError, "field_of_view: must be above 0 and below 180", {"field_of_view": 0}),
        (ValueError, "field_of_view: must be above 0 and below 180", {"field_of_view": 180}),
        (ValueError, "field_of_view: must be above 0 and below 180", {"field_of_view": np.nan}),
        (TypeError, "field_of_view: must be a number, not None", {"field_of_view": None}),
    ],
)
def test_objects_other_than_cameras_are_refused(
    error: type[Exception], message: str, settings: Any
) -> None:
    arguments = {"position": (4, 0, 0), "target": (0, 0, 0), "up": (0, 0, 1), **settings}
    with pytest.raises(error, match=message):
        Camera(**arguments)


@pytest.mark.parametrize(
    "make",
    [
        lambda frames, faces: degrade.add_noise(frames, faces, 0.1),
        lambda frames, faces: degrade.add_outliers(frames, faces, 0.1),
        lambda frames, faces: degrade.camera_known(frames, faces, [NEAR_X]),
    ],
)
def test_bad_frames_are_refused_with_their_number(make: Any) -> None:
    good = SHEET.vertices
    with pytest.raises(ValueError, match=r"frame 2: must have shape \(36, 3\) like frame 0, not"):
        list(make([good, good, good[:-1]], SHEET.faces))
    with pytest.raises(ValueError, match=r"frame 1: must have shape \(k, 3\) .*, not \(36, 2\)"):
        list(make([good, good[:, :2]], SHEET.faces))
    with pytest.raises(TypeError, match="frame 0: must be float32 or float64, not int64"):
        list(make([good.astype(np.int64)], SHEET.faces))
    with pytest.raises(ValueError, match="face 49 refers to vertex 35"):
        list(make([good[:-1]], SHEET.faces))
    assert list(make([], SHEET.faces)) == []


@pytest.mark.parametrize("add", [degrade.add_noise, degrade.add_outliers])
def test_a_first_frame_without_edges_is_refused(add: Any) -> None:
    with pytest.raises(ValueError, match="frame 0: must be finite, but vertex 7 is at"):
        list(add([NAN_FRAME], SHEET.faces, 0.1))
    with pytest.raises(ValueError, match="frame 0 must have edges longer than 0"):
        list(add([POINT], np.array([[0, 1, 2]]), 0.1))
    with pytest.raises(ValueError, match="frame 0 must have edges longer than 0"):
        list(add([POINT], np.empty((0, 3), np.int64), 0.1))


def test_a_frame_without_a_camera_is_refused() -> None:
    def cameras(frame: int) -> list[Camera]:
        return [NEAR_X] if frame < 2 else []

    with pytest.raises(ValueError, match="cameras: at least one is needed, but frame 2 has none"):
        list(degrade.camera_known([SHEET.vertices] * 4, SHEET.faces, cameras))
