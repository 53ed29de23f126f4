"""Pages that play sequences."""

import json
import re
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from browser import Page, bluish, in_colour, middle, page_of, reddish
from meshes import join, sheet
from shown import COMPLETED, MOVING, PARTIAL, TRUTH

from dynmesh import Sequence, view, write
from dynmesh import open as open_sequence
from dynmesh.draw.figures import thin
from dynmesh.draw.page import Shown
from dynmesh.draw.page import page as page_for
from dynmesh.scans import PointScan, Rig, ScanCamera, scan_folder


def test_a_page_needs_nothing_but_itself_to_show_what_it_names(
    tmp_path: Path, browser: Any
) -> None:
    page = page_of(MOVING, tmp_path, browser)
    assert page.text("name") == "sheet.npz"
    assert page.text("note") == ""
    assert page.text("title") == "generation: steps from the observed"
    assert page.text("bar").split("\n") == ["0, observed", "1", "2"]
    assert page.captions() == []
    page.press("f")  # the view stays, and the sheet moves
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
    page.press("f")
    followed = []
    for frame in (0, 4, 8):
        page.scrub(frame)
        followed.append(middle(in_colour(page.picture())))
    assert np.ptp(followed) < 0.1 * (columns[2] - columns[0])
    assert [url for url in page.requests if not url.startswith("blob:")] == [
        (tmp_path / "page.html").as_uri()
    ]
    assert page.complaints == []


def test_play_plays_and_pause_stops(tmp_path: Path, browser: Any) -> None:
    page = page_of(MOVING, tmp_path, browser)
    page.scrub(0)
    page.choose("speed", "0.5")
    before = page.picture()
    page.stop_clocks()
    page.page.click("#dynmesh-play")
    assert page.text("play") == "Pause"
    page.page.clock.run_for(700)  # 3.5 frames
    page.page.click("#dynmesh-play")
    assert (page.picture() != before).any(axis=2).mean() > 0.01
    page.page.clock.run_for(500)
    assert (page.text("play"), page.text("counter")) == ("Play", "frame 3 / 8, 0.30 s")
    page.choose("speed", "2")
    page.press(" ")
    page.page.clock.run_for(375)  # 7.5 frames: the last is followed by the first
    assert (page.text("play"), page.text("counter")) == ("Pause", "frame 1 / 8, 0.10 s")
    assert page.complaints == []


def test_the_page_states_its_name_and_what_is_left_out(tmp_path: Path, browser: Any) -> None:
    name = "<img src=x onerror=alert(1)>'\"&amp; ✓.npz"
    mesh = sheet(40)
    vertices = np.stack([mesh.vertices] * 7).astype(np.float32)
    write(tmp_path / name, Sequence(vertices, mesh.faces))
    with open_sequence(tmp_path / name) as reader:
        view(reader, max_frames=3, max_vertices=400).write(tmp_path / "page.html")
    page = Page(browser, tmp_path / "page.html")
    assert page.text("name") == name
    assert all(url.startswith(("file:", "blob:")) for url in page.requests)
    assert not any(url.endswith("/x") for url in page.requests)
    assert page.text("note").startswith("shown: every 3rd of 7 frames, 4")
    assert "of 3042 triangles; assuming that z is up" in page.text("note")
    made = page_for(Sequence(vertices, mesh.faces), max_frames=4)
    assert made.shown == Shown(4, 7, 2, 1600, 1600, 3042, 3042)
    page.scrub(2)
    assert page.text("counter") == "frame 6 / 6"


UPRIGHT = np.eye(4)[[0, 2, 1, 3]] * [1, -1, 1, 1]  # a camera that looks along y, with z up


@pytest.mark.parametrize(
    ("pose", "seen_at", "up"),
    [
        (np.eye(4), [0, 0, 5], "-y"),
        (np.diag([1.0, -1, -1, 1]), [0, 0, -5], "y"),
        (UPRIGHT * [-1, -1, 1, 1], [0, 5, 0], "-z"),
        (UPRIGHT, [0, 5, 0], "z"),
        (np.eye(4), [0, 5, 0], ""),  # does not see the scan, so that its axes say nothing
        (UPRIGHT[[1, 2, 0, 3]], [5, 0, 0], "y"),
    ],
)
def test_a_page_with_scans_is_upright_as_their_cameras_are(
    pose: Any, seen_at: list[float], up: str, tmp_path: Path
) -> None:
    mesh = sheet(12)
    points = mesh.vertices - mesh.vertices.mean(axis=0)
    points = points / np.abs(points).max() + seen_at
    cameras = Rig((ScanCamera("only", pose),))
    with scan_folder(tmp_path / "scans", cameras) as append:
        append(PointScan(points, None, None))
    shown = Sequence(points[None], mesh.faces)
    page = view(shown, scans=tmp_path / "scans")
    guess = f"{up} is up, as the cameras are held" if up else "z is up, as no file states it"
    assert page.remarks == (f"assuming that {guess}",)
    (told,) = re.findall(r'"up": (\[[^]]*\])', page.html)
    upwards = np.eye(3)["xyz".index((up or "z")[-1])] * (-1 if up.startswith("-") else 1)
    np.testing.assert_array_equal(json.loads(told), upwards)
    assert view(shown, scans=tmp_path / "scans", up="x").remarks == ()


def test_no_name_ends_the_script_of_a_page() -> None:
    html = page_for(MOVING[:2], title="</script><b>it is bold</b>").html
    assert "it is bold" in html
    assert "</script><b>" not in html


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
    # Vertices of no triangle go first.
    kept, triangles = thin(mesh.faces + 500, np.pad(mesh.vertices, ((500, 0), (0, 0))), 2500)
    assert kept.tolist() == list(range(500, 3000))
    np.testing.assert_array_equal(kept[triangles], mesh.faces + 500)
    mesh.vertices[7, 1] = np.nan
    with pytest.raises(ValueError, match="the first frame lacks vertex 7"):
        thin(mesh.faces, mesh.vertices, 600)


def test_the_input_and_the_reference_play_and_turn_beside_the_sequence(
    tmp_path: Path, browser: Any
) -> None:
    others = {"reference": TRUTH, "input": PARTIAL}
    page = page_of(COMPLETED, tmp_path, browser, others, colour="plain")
    captions = ["seen: input.npz", "completed: sheet.npz", "true: reference.npz"]
    assert page.captions() == captions
    areas, references = {}, {}
    for frame in (0, 1, 7):
        page.scrub(frame)
        pictures = page.pictures(0, 1, 2)
        areas[frame] = [int(in_colour(picture).sum()) for picture in pictures]
        references[frame] = pictures[2]
    assert min(areas[0]) > 5000
    assert max(areas[0]) < 1.02 * min(areas[0])
    observed, filled_in, true = areas[1]
    assert 0.4 < observed / true < 0.6
    assert filled_in > 0.9 * true
    assert (in_colour(pictures[1]) ^ in_colour(pictures[2])).mean() > 0.01
    assert (references[7] == references[0]).all()  # it stays, whatever happens beside it
    page.scrub(0)  # the same mesh in all
    views = [page.pictures(1, 2)]
    page.drag(0, 60, 0)
    views.append(page.pictures(1, 2))
    page.page.mouse.wheel(0, 400)
    views.append(page.pictures(1, 2))
    for left, right in views:
        assert (in_colour(left) ^ in_colour(right)).mean() < 0.01
    for (before, _), (after, _) in pairwise(views):
        assert (in_colour(before) ^ in_colour(after)).mean() > 0.02
    page.press("r")
    assert (in_colour(page.picture(2)) ^ in_colour(views[0][1])).mean() < 0.005
    assert page.complaints == []


VERDICTS = """frame,far,quality,reason
0,0.1,good,
1,0.2,ruined,"a limb, or more, is lost"
3,0.2,doubtful,most is unseen
4,0.1,good,
"""


@pytest.mark.parametrize(
    ("most", "colours", "clicked", "frame"),
    [
        (9, "good ruined unknown doubtful good unknown unknown unknown unknown", 1, "1"),
        (3, "ruined doubtful unknown", 1, "3"),
    ],
)
def test_a_line_under_the_slider_shows_the_worst_of_the_frames_and_leads_there(
    most: int, colours: str, clicked: int, frame: str, tmp_path: Path, browser: Any
) -> None:
    (tmp_path / "quality.csv").write_text(VERDICTS)
    page = page_of(TRUTH, tmp_path, browser, quality=tmp_path / "quality.csv", max_frames=most)
    marks = page.page.locator("#dynmesh-quality span")
    drawn_colours = marks.evaluate_all("(all) => all.map((mark) => mark.classList[0])")
    assert drawn_colours == colours.split()
    marks.nth(clicked).click()
    assert page.text("counter").split()[1] == frame
    assert page.text("play") == "Play"
    assert {"1": "a limb, or more, is lost", "3": "most is unseen"}[frame] in page.text("verdict")
    assert page.complaints == []


def test_a_dark_page_is_dark(tmp_path: Path, chromium: Any) -> None:
    dark = chromium.new_context(color_scheme="dark")
    page = page_of(MOVING, tmp_path, dark)
    assert page.picture()[0, 0].max() < 60
    assert page.complaints == []
    dark.close()


def test_keys_and_menus_switch_frames_and_colours(tmp_path: Path, browser: Any) -> None:
    page = page_of(COMPLETED, tmp_path, browser, {"reference": TRUTH}, colour="known")
    assert page.text("counter").split()[1] == "7"  # with the largest error
    for key, frame in (("Home", 0), ("ArrowRight", 1), ("End", 8), ("ArrowLeft", 7)):
        page.press(key)
        assert page.text("counter").split()[1] == str(frame)
    pictures = []
    for colour in ("error", "generation", "age", "known", "plain"):
        page.choose("colour", colour)
        pictures.append(page.picture(0))
    surfaces = [picture[in_colour(picture)].mean(axis=0) for picture in pictures]
    for before, after in pairwise(surfaces):
        assert abs(before - after).max() > 3
    assert (pictures[0].max(axis=2) < 110).sum() > 1000  # dark, as the error is the largest
    assert middle(bluish(pictures[3])) < middle(reddish(pictures[3]))  # observed, and filled in
    for grey in (pictures[4], page.picture(1)):  # and so is the reference, always
        assert np.ptp(grey, axis=2).max() < 30
    assert page.complaints == []
