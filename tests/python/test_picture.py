"""Pictures of sequences, and what sequences show of themselves in notebooks."""

from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import Array, Mesh, sheet
from test_missing_extras import hide

import dynmesh
from dynmesh import Sequence, write
from dynmesh import open as open_sequence
from dynmesh.draw import notebook
from dynmesh.draw.picture import drawn, evenly_spaced
from dynmesh.draw.scales import CountScale
from dynmesh.draw.sheet import contact_sheet

pytest.importorskip("pyvista", reason="pictures need pyvista: pip install 'dynmesh[view]'")
images = pytest.importorskip("PIL.Image")

BLUE = (0, 114, 178)


MESH = sheet(12)
MOVED = (np.arange(5) > 0)[:, None] & (MESH.vertices[:, 0] > 5.5)
SEQUENCE = Sequence(
    np.stack([MESH.vertices] * 4),
    MESH.faces,
    generation=MOVED[:4].astype(np.int32),
    age=MOVED[:4].astype(np.int32),
)
"""Four frames; after frame 0 the vertices right of x = 5.5 are filled in."""
MOVING = dynmesh.Sequence(
    MESH.vertices + np.arange(5)[:, None, None] * np.array([1, 0, 0]),
    MESH.faces,
    fps=10.0,
    generation=2 * MOVED.astype(np.int32),
    age=2 * MOVED.astype(np.int32),
)
"""A sheet that moves along x; of later frames, the vertices beyond x = 5.5 were filled in."""


def pixels(path: Path) -> Array:
    """Reads the pixels, (height, width, 3)."""
    with images.open(path) as image:
        assert image.format == "PNG"
        return np.asarray(image.convert("RGB")).astype(int)


def draw(sequence: Sequence, folder: Path, **options: Any) -> Array:
    """Writes a sequence and its picture, from the front with x to the right."""
    write(folder / "sheet.npz", sequence)
    with open_sequence(folder / "sheet.npz") as reader:
        drawn(reader, **{"up": "z", "azimuth": -90, **options}).save(folder / "sheet.png")
    return pixels(folder / "sheet.png")


def reddish(image: Array) -> Array:
    """Which pixels are red, shaded or not."""
    return np.asarray(image[..., 0] > image[..., 2] + 60)


def bluish(image: Array) -> Array:
    """Which pixels are blue, shaded or not."""
    return np.asarray(image[..., 2] > image[..., 0] + 60)


def test_colours_are_at_their_vertices(tmp_path: Path) -> None:
    first = draw(SEQUENCE, tmp_path, indices=[0], colour="known", size=300)
    left = first[:, :300]  # the colour bar is at the right
    assert bluish(left).sum() > 10_000
    assert not reddish(left).any()
    left = draw(SEQUENCE, tmp_path, indices=[2], colour="known", size=300)[:, :300]
    assert bluish(left).sum() > 4_000
    assert reddish(left).sum() > 4_000
    blue, red = (np.nonzero(mask(left))[1] for mask in (bluish, reddish))
    assert np.percentile(blue, 99) < np.percentile(red, 1) + 20


def test_holes_and_dots_are_drawn(tmp_path: Path) -> None:
    known = np.ones(SEQUENCE.vertices.shape[:2], np.bool_)
    known[1, SEQUENCE.vertices[0, :, 0] < 5.5] = False
    known[2] = False
    known[2, 40] = True
    known[3] = False
    vertices = np.where(known[..., None], SEQUENCE.vertices, np.nan)
    partial = Sequence(vertices, SEQUENCE.faces, known)
    # In one picture, so that they have the same scale and crop.
    sheets = [draw(partial, tmp_path, indices=[0, n]) for n in range(4)]
    whole, half, dot, nothing = (int(bluish(image).sum()) for image in sheets)
    frame, bar = whole - nothing, 2 * nothing - whole
    assert frame > 20_000
    assert 0.4 * frame < half - nothing < 0.6 * frame
    assert 0 < dot - nothing < 0.01 * frame
    assert bar < 2000


@pytest.mark.parametrize("faces", [[[0, 0, 1], [2, 1, 0]], []])
def test_the_smallest_meshes_are_drawn(faces: list[list[int]], tmp_path: Path) -> None:
    corner = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 0, 1]]], np.float32)
    triangles = np.array(faces, np.int32).reshape(-1, 3)
    image = draw(Sequence(corner, triangles), tmp_path, indices=[0])
    assert (image[60:-40] < 240).any()  # below the heading and above the caption


@pytest.mark.parametrize(
    ("n_frames", "count", "expected"),
    [(175, 3, [0, 87, 174]), (10, 1, [0]), (3, 9, [0, 1, 2]), (1, 6, [0]), (5, 2, [0, 4])],
)
def test_frames_are_spaced_evenly(n_frames: int, count: int, expected: list[int]) -> None:
    assert evenly_spaced(n_frames, count) == expected


def test_a_sheet_is_laid_out_in_full_rows() -> None:
    tile = np.full((100, 100, 3), BLUE, np.uint8)
    scale = CountScale("steps", 2, zero="here")
    image = np.asarray(contact_sheet("six", [tile] * 6, [f"{i}" for i in range(6)], scale))
    tiles = (image == BLUE).all(axis=2)
    assert sorted(set(tiles.sum(axis=1).tolist())) == [0, 300]  # rows of three


def test_a_mesh_far_from_the_origin_is_drawn(mesh: Mesh, tmp_path: Path) -> None:
    near = draw(Sequence(mesh.vertices[None], mesh.faces), tmp_path, indices=[0])
    far = draw(Sequence(mesh.vertices[None] + 5e5, mesh.faces), tmp_path, indices=[0])
    areas = [(image < 235).all(axis=2).sum() for image in (near, far)]
    assert areas[0] == pytest.approx(areas[1], rel=0.05)


def html_of(shown: Any) -> str:
    """What a notebook shows of an object."""
    return str(shown._repr_html_())


def in_colour(picture: Array) -> Array:
    """Which pixels are not white."""
    return np.asarray((picture < 240).any(axis=2))


def size_of(html: str) -> int:
    return len(html.encode())


def test_every_second_frame_is_played_at_half_the_rate() -> None:
    assert '"fps": 10.0' in unescape(html_of(MOVING))
    assert '"fps": 5.0' in unescape(html_of(MOVING[::2]))


def test_long_sequences_of_large_meshes_stay_small(rng: np.random.Generator) -> None:
    mesh = sheet(80)
    noise = rng.normal(0, 0.1, (40, *mesh.vertices.shape))
    html = html_of(dynmesh.Sequence(mesh.vertices + noise, mesh.faces))
    assert "<iframe" in html
    assert size_of(html) < notebook.LARGEST_PLAYER + 1000


LEAST: dict[str, Any] = {"vertices": np.zeros((2, 4, 3)), "faces": np.array([[0, 1, 2]])}
TABLES: dict[str, dict[str, Any]] = {
    "has no frames": {"vertices": np.empty((0, 4, 3))},
    "no vertex is known": {"known": np.zeros((2, 4), bool)},
    "takes long": {"vertices": np.zeros((1, notebook.LARGEST_MESH + 1, 3))},
    "cannot be simplified enough": {},
    "this needs k3d": {},
}


@pytest.mark.parametrize("reason", TABLES)
def test_a_sequence_that_cannot_be_played_is_shown_as_a_table(
    reason: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    change = TABLES[reason]
    sequence = dynmesh.Sequence(**LEAST | change) if change else MOVING
    if "simplified" in reason:
        monkeypatch.setattr(notebook, "LARGEST_PLAYER", 100_000)
    if "k3d" in reason:
        hide(monkeypatch, "k3d")
    html = html_of(sequence)
    assert "<iframe" not in html
    assert reason in html
    assert f"{sequence.vertices.shape[1]} vertices" in html
    assert size_of(html) < 1000
