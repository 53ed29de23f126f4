"""The page that plays a sequence, in a browser."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import Page, in_colour, middle, page_of
from meshes import Mesh, join, sheet

from dynmesh import Sequence, view, write
from dynmesh import open as open_sequence
from dynmesh.draw.page import Shown
from dynmesh.draw.page import page as page_for
from dynmesh.draw.page.thin import thin
from dynmesh.files.memory import SequenceReader


@pytest.fixture
def moving() -> Sequence:
    """A sheet that moves along x at constant speed, with provenance."""
    mesh = sheet(12)
    vertices = np.stack([mesh.vertices + np.array([i, 0, 0]) for i in range(9)])
    generation = np.zeros(vertices.shape[:2], np.int32)
    generation[1:, mesh.vertices[:, 0] > 5.5] = 2
    return Sequence(vertices, mesh.faces, fps=10.0, generation=generation, age=generation)


def test_a_page_needs_nothing_but_itself_to_show_what_it_names(
    moving: Sequence, tmp_path: Path, browser: Any
) -> None:
    page = page_of(moving, tmp_path, browser)
    assert page.text("name") == "sheet.npz"
    assert page.text("note") == ""
    assert page.text("title") == "generation: steps from the observed"
    assert page.text("bar").split("\n") == ["0, observed", "1", "2"]
    assert page.captions() == []
    columns = []
    for frame in (0, 4, 8, 0):
        page.scrub(frame)
        assert page.text("counter") == f"frame {frame} / 8, {frame / 10:.2f} s"
        picture = page.picture()
        assert in_colour(picture).sum() > 5000
        assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 50
        columns.append(middle(in_colour(picture)))
    assert columns[1] - columns[0] > 50
    assert columns[2] - columns[1] == pytest.approx(columns[1] - columns[0], rel=0.1)
    assert columns[3] == pytest.approx(columns[0], abs=0.5)
    assert [url for url in page.requests if not url.startswith("blob:")] == [
        (tmp_path / "page.html").as_uri()
    ]
    assert page.complaints == []


def test_play_plays_and_pause_stops(moving: Sequence, tmp_path: Path, browser: Any) -> None:
    page = page_of(moving, tmp_path, browser)
    page.scrub(0)
    page.choose("speed", "0.5")
    before = page.picture()
    page.stop_clocks()
    page.click("play")
    assert page.text("play") == "Pause"
    page.pass_time(700)  # 3.5 frames
    page.click("play")
    assert page.text("counter") == "frame 3 / 8, 0.30 s"
    assert (page.picture() != before).any(axis=2).mean() > 0.01
    page.pass_time(500)
    assert (page.text("play"), page.text("counter")) == ("Play", "frame 3 / 8, 0.30 s")
    page.choose("speed", "2")
    page.press(" ")
    page.pass_time(375)  # 7.5 frames: the last is followed by the first
    assert (page.text("play"), page.text("counter")) == ("Pause", "frame 1 / 8, 0.10 s")
    assert page.complaints == []


def test_holes_are_seen(moving: Sequence, tmp_path: Path, browser: Any) -> None:
    known = np.ones(moving.vertices.shape[:2], np.bool_)
    known[2, moving.vertices[0, :, 0] < 5.5] = False
    known[3] = False
    known[3, 30] = True  # a dot
    known[4] = False  # nothing
    vertices = np.where(known[..., None], np.stack([moving.vertices[0]] * 9), np.nan)
    page = page_of(Sequence(vertices, moving.faces, known), tmp_path, browser)
    areas = []
    for frame in (1, 2, 3, 4, 5):
        page.scrub(frame)
        areas.append(int(in_colour(page.picture()).sum()))
    whole, half, dot, nothing, again = areas
    assert 0.4 * whole < half < 0.6 * whole
    assert 0 < dot < 0.01 * whole
    assert nothing == 0
    assert again == whole
    assert page.complaints == []


def test_the_page_states_its_name_and_what_is_left_out(tmp_path: Path, browser: Any) -> None:
    name = "<img src=x onerror=alert(1)>'\"&amp; ✓.npz"
    mesh = sheet(40)
    vertices = np.stack([mesh.vertices] * 7).astype(np.float32)
    write(tmp_path / name, Sequence(vertices, mesh.faces))
    with open_sequence(tmp_path / name) as reader:
        view(reader, tmp_path / "page.html", max_frames=3, max_vertices=400)
    page = Page(browser, tmp_path / "page.html")
    assert page.text("name") == name
    assert all(url.startswith(("file:", "blob:")) for url in page.requests)
    assert not any(url.endswith("/x") for url in page.requests)
    assert page.text("note").startswith("shown: every 3rd of 7 frames, 4")
    assert page.text("note").endswith("of 3042 triangles")
    page.scrub(2)
    assert page.text("counter") == "frame 6 / 6"


def test_a_page_tells_what_was_left_out(moving: Sequence) -> None:
    made = page_for(SequenceReader(moving), max_frames=4)
    assert made.shown == Shown(3, 9, 3, 144, 144, 242, 242)


def test_thinning_keeps_original_vertices_and_prints_nothing(
    capfd: pytest.CaptureFixture[str],
) -> None:
    mesh = join(sheet(40), sheet(30, 100.0))
    faces = np.concatenate([mesh.faces, mesh.faces[:9], [[5, 5, 6], [7, 7, 7]]])
    kept, triangles = thin(faces, mesh.vertices, 600)
    assert 500 < len(kept) < 700
    assert len(np.unique(kept)) == len(kept)
    corners = mesh.vertices[kept][triangles]
    ups = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2]
    assert (ups >= 0).all()  # none is flipped
    assert abs(ups).sum() / 2 == pytest.approx(39**2 + 29**2, rel=0.01)  # the extent is unchanged
    assert capfd.readouterr() == ("", "")


def test_a_large_mesh_needs_a_complete_frame_0(mesh: Mesh) -> None:
    vertices = mesh.vertices.copy()
    vertices[7, 1] = np.nan
    with pytest.raises(ValueError, match="the first frame lacks vertex 7"):
        thin(mesh.faces, vertices, 40)


def test_vertices_of_no_triangle_go_first(mesh: Mesh) -> None:
    vertices = np.concatenate([np.zeros((500, 3)), mesh.vertices])
    kept, triangles = thin(mesh.faces + 500, vertices, 100)
    assert kept.tolist() == list(range(500, 549))
    np.testing.assert_array_equal(kept[triangles], mesh.faces + 500)
