"""Verb after verb, over every format: they agree with the single steps, and none runs again."""

import contextlib
import math
import pickle
from collections.abc import Callable
from copy import copy, deepcopy
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from every_format import FORMATS, KNOWN, PARTIAL, place
from scan_files import moving_body
from sequences import sea
from stages import BODY, production

import dynmesh
from dynmesh.completion.passes import Tally
from dynmesh.formats.writing import Place
from dynmesh.scans import open_scans

Verb = Callable[[Any], Any]
TRUTH = sea(len(PARTIAL), 12, **PARTIAL.described() | {"faces": PARTIAL.faces})


def converted(frames: Any) -> Any:
    """In other axes and another unit, which are given where a file states none."""
    header = (frames if hasattr(frames, "header") else dynmesh.open(frames)).header
    stated: Any = {"up": header.up_axis or "y", "unit": header.metres_per_unit or "cm"}
    return dynmesh.convert(frames, to_unit="mm", to_up="z", **stated)


VERBS: dict[str, Verb] = {
    "convert": converted,
    "cut": lambda frames: dynmesh.convert(frames, frames=slice(0, 5), fps=30),
    "degrade": lambda frames: dynmesh.degrade(frames, known=0.8, seed=7),
    "complete": lambda frames: dynmesh.complete(frames, start="best"),
}
PAIRS = [*product(VERBS, VERBS)]


@pytest.fixture(autouse=True)
def pushes(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How often a completer has completed a frame, a number for each time."""
    counted, push = list[int](), dynmesh.Completer.push

    def counting(self: Any, *given: Any, **options: Any) -> Any:
        counted.append(self.n_frames)
        return push(self, *given, **options)

    monkeypatch.setattr(dynmesh.Completer, "push", counting)
    return counted


def assert_alike(one: dynmesh.Sequence, other: dynmesh.Sequence) -> None:
    """In arrays, in all that they say, and in the quality and the words of their reports."""
    arrays = (one.vertices, one.attributes()), (other.vertices, other.attributes())
    np.testing.assert_equal(*arrays)
    np.testing.assert_equal(one.described(), other.described())
    assert (one.faces.tolist(), one.origin) == (other.faces.tolist(), other.origin)
    told = [
        None if each is None else (type(each), each.quality, each.reason, each.remarks)
        for each in (one.report, other.report)
    ]
    assert told[0] == told[1]


def opened(folder: Path, format: str) -> tuple[Path, dict[str, Any]]:
    """A file of the format with what it can hold, behind a link, and how it is read."""
    (folder / "disk").mkdir()
    (folder / "linked").symlink_to("disk")
    path = place(folder / "linked", format)
    dynmesh.write(path, PARTIAL)
    return path, {"known": KNOWN} if format in ("pc2", "obj") else {}


@pytest.mark.filterwarnings("ignore::dynmesh.DoubtfulWarning")
@pytest.mark.parametrize("format", FORMATS)
def test_two_verbs_of_a_file_are_those_of_what_is_in_memory(tmp_path: Path, format: str) -> None:
    """Also if the file is given as seen from a folder that is left before its frames are read."""
    path, how = opened(tmp_path, format)
    for part in (slice(1, 6, 2), slice(5, None), [0, 4]):
        assert_alike(dynmesh.read(dynmesh.open(path, **how)[part]), dynmesh.read(path, **how)[part])
    for first, second in PAIRS:
        one, other = VERBS[first], VERBS[second]
        with contextlib.chdir(tmp_path):
            run = other(one(dynmesh.open(path.relative_to(tmp_path), **how)))
        assert isinstance(run, dynmesh.frames.Run)
        once = one(dynmesh.read(path, **how))
        in_memory = other(once)
        assert isinstance(in_memory, dynmesh.Sequence)
        assert_alike(other(once), in_memory)
        by_steps = other(one(dynmesh.open(path, **how)).read())
        kept = run.read()
        assert_alike(kept, in_memory)
        assert_alike(kept, by_steps)
        with pytest.raises(ValueError, match=r"gone through.*read\(\)"):
            run.read()
        if second == "complete":  # which leaves nothing missing
            moved = replace(kept, vertices=kept.vertices * np.float32(1.01), report=None)
            again = other(one(dynmesh.open(path, **how)))
            of_run, of_memory = (dynmesh.evaluate(each, moved).to_dict() for each in (again, kept))
            np.testing.assert_equal(of_run, of_memory)


@pytest.mark.filterwarnings("ignore::dynmesh.DoubtfulWarning")
@pytest.mark.parametrize("format", FORMATS)
def test_a_file_between_two_verbs_changes_nothing_that_it_can_hold(
    tmp_path: Path, format: str
) -> None:
    path, how = opened(tmp_path, format)
    for number, (first, second) in enumerate(PAIRS):
        between, direct = place(tmp_path / str(number), format), place(tmp_path / "direct", format)
        VERBS[first](dynmesh.open(path, **how)).write(between)
        VERBS[second](between).write(between.with_name(f"last_{between.name}"))
        VERBS[second](VERBS[first](dynmesh.open(path, **how))).write(direct)
        one, other = (dynmesh.read(p) for p in (between.with_name(f"last_{between.name}"), direct))
        same = ("up_axis", "metres_per_unit", "fps", "start", "name")
        for name in same:
            ours, theirs = getattr(one, name), getattr(other, name)
            assert ours == theirs or ours == pytest.approx(theirs), (first, second, name)
        if format in ("npz", "hdf5"):
            np.testing.assert_equal(one.vertices, other.vertices)
            np.testing.assert_equal(one.attributes(), other.attributes())


@pytest.mark.parametrize("kind", [{"scan": True, "points": 1500}, {"depth": "80x60"}], ids=str)
def test_scans_in_memory_are_tracked_as_those_in_files(tmp_path: Path, kind: Any) -> None:
    pytest.importorskip("PIL")
    body = moving_body(2)
    scans = dynmesh.degrade(body, **kind)
    scans.write(tmp_path / "scans")
    of_files = dynmesh.track(tmp_path / "scans", template=body[:1]).read()
    tracked: Any = dynmesh.track(dynmesh.degrade(body, **kind), template=body[:1])
    assert_alike(tracked, of_files)
    for name in ("convert", "complete"):
        of_run = VERBS[name](dynmesh.track(tmp_path / "scans", template=body[:1])).read()
        assert_alike(of_run, VERBS[name](tracked))
    turned = converted(tracked)
    dynmesh.degrade(turned, **kind).write(tmp_path / "again")
    again: Any = dynmesh.track(dynmesh.degrade(turned, **kind), template=turned[:1])
    assert_alike(again, dynmesh.track(tmp_path / "again", template=turned[:1]).read())
    with pytest.raises(ValueError, match="gone through"):
        dynmesh.track(scans, template=body[:1])
    assert dynmesh.evaluate(tracked, body).mean < 0.01
    read: Any = open_scans(tmp_path / "scans")
    assert_alike(dynmesh.track(read, template=body[:1]).read(), of_files)
    given: list[Any] = [[*read], (None, *read)]
    if "scan" in kind:
        given += [[(scan.points, scan.normals) for scan in read], [scan.points for scan in read]]
        given.append(np.stack([np.concatenate([one, one[:9] * np.nan]) for one in given[-1]]))
    for each in given:
        listed: Any = dynmesh.track(each, template=body[:1])
        assert listed.report.quality == "good"
        assert dynmesh.evaluate(listed[-2:], body).mean < 0.01
        has_cameras = any(each is one for one in given[:2])
        assert len(listed.report.cameras) == (4 if has_cameras else 0)


def test_scans_in_memory_are_checked(tmp_path: Path) -> None:
    body = moving_body(4)
    dynmesh.degrade(body, scan=True, points=100).write(tmp_path)
    scans: Any = open_scans(tmp_path, frames=slice(1, 4))
    points = [scan.points for scan in scans]
    scans.choose(slice(2, 3))
    assert scans.numbers == [2]
    np.testing.assert_array_equal(next(iter(scans)).points, points[1])
    wrong: dict[str, Any] = {
        "scans: frame 1: points: must have shape": [points[0], points[1][:, :2]],
        "scans: frame 0: has 100 points, but 99 normals": [(points[0], points[0][:99])],
        "scans: frame 0: point 0: is at .*, which is not finite": [[[0, math.nan, 1]]],
        "scans: must be a path or a list of scans": iter(points),
        "scans: are none": [],
    }
    for message, given in wrong.items():
        with pytest.raises((TypeError, ValueError), match=message):
            dynmesh.track(given, template=body[:1])
    with pytest.raises(ValueError, match="cameras: is for the files of scans"):
        dynmesh.track(points, template=body[:1], cameras="cameras.json")


@pytest.mark.filterwarnings("ignore::dynmesh.DoubtfulWarning")
def test_no_verb_runs_again(pushes: list[int], tmp_path: Path) -> None:
    n = len(PARTIAL)
    completed = dynmesh.complete(dynmesh.degrade(PARTIAL, known=0.9), start=0)
    assert len(pushes) == n - 1
    dynmesh.evaluate(completed, TRUTH)
    dynmesh.info(completed)
    dynmesh.convert(completed, scale=2)
    completed.write(tmp_path / "a.npz")
    completed.write(tmp_path / "b.usda")
    assert len(pushes) == n - 1
    pushes.clear()
    dynmesh.complete(dynmesh.complete(dynmesh.complete(tmp_path / "a.npz", start=0))).read()
    assert len(pushes) == 3 * (n - 1)
    pushes.clear()
    run = dynmesh.complete(tmp_path / "a.npz", start=0)
    dynmesh.evaluate(run, TRUTH)
    assert run.report.completed == len(pushes) == n - 1
    uses: list[Any] = [list, dynmesh.info, lambda frames: dynmesh.complete(frames).read()]
    for again in (*uses, lambda frames: frames.write("c.npz")):
        with pytest.raises(ValueError, match=r"a\.npz: its frames were gone through"):
            again(run)
    assert len(pushes) == n - 1


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.filterwarnings("ignore::dynmesh.DoubtfulWarning")
def test_a_writer_that_fails_leaves_nothing_and_the_run_is_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, verb: str
) -> None:
    def fail(*_: object) -> None:
        raise OSError("the disk is full")

    dynmesh.write(tmp_path / "in.npz", PARTIAL)
    run = VERBS[verb](tmp_path / "in.npz")
    (tmp_path / "out.npz").write_text("older")
    with pytest.raises(FileExistsError):
        run.write(tmp_path / "out.npz", overwrite=False)
    with monkeypatch.context() as patched:
        patched.setattr(Place, "fill", fail)
        with pytest.raises(OSError, match="the disk is full"):
            run.write(tmp_path / "out.npz")
    assert (tmp_path / "out.npz").read_text() == "older"
    with pytest.raises(ValueError, match="gone through"):
        run.write(tmp_path / "out.npz")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["in.npz", "out.npz"]


@pytest.mark.filterwarnings("ignore::dynmesh.DoubtfulWarning")
def test_an_origin_goes_on_until_more_than_positions_change(tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    scene = production(tmp_path / "scene.usda")
    body: Any = dynmesh.read(scene, prim=BODY)
    scaled: Verb = lambda given: dynmesh.convert(given, scale=2)  # noqa: E731
    for frames in (dynmesh.open(scene, prim=BODY), body):
        for verb in (VERBS["degrade"], scaled):
            assert verb(frames).origin == body.origin
        completed = dynmesh.complete(frames, start="best")
        assert completed.origin == replace(body.origin, is_below=True)
        for changes in (
            {"to_unit": "inch"},
            {"to_up": "y"},
            {"fps": 50},
            {"frames": slice(502, 503)},
        ):
            changed: Any = dynmesh.convert(frames, **changes)
            assert len(changed.origin.changed) == 1
            again = dynmesh.complete(dynmesh.convert(changed, scale=3), start="best")
            remarks = " ".join(again.write(tmp_path / "out.usda").remarks)
            assert f"mesh alone, as scene.usda has another {changed.origin.changed[0]}" in remarks


def test_a_ruined_second_pass_replaces_a_doubtful_first_one() -> None:
    nothing: Any = None
    tally, known = Tally(np.zeros(3, np.bool_), nothing), np.ones(3, np.bool_)
    report = dynmesh.Completer([[0, 1, 2]], np.eye(3)).report
    for quality in ("doubtful", "ruined", "doubtful"):
        tally.add(1, replace(report, known=3, quality=quality), known)
    assert tally.wrong[1].quality == "ruined"


@pytest.mark.filterwarnings("ignore::dynmesh.DoubtfulWarning")
def test_what_was_put_together_is_as_old_as_the_way_from_there() -> None:
    known = np.random.default_rng(0).random((9, 100)) < 0.6
    known[2:, 7] = False  # seen in the first two frames alone
    for both in (False, True):  # a pass that comes from frame 1 is older
        age = dynmesh.complete(sea(9, known=known), start=4, bidirectional=both).age[:, 7]
        assert age[4:].tolist() == [0, 1, 2, 3, 4]  # from the whole frame on, which has it


def test_meshes_of_other_libraries_are_a_sequence() -> None:
    trimesh, pyvista = pytest.importorskip("trimesh"), pytest.importorskip("pyvista")
    completed = dynmesh.complete(sea(4, share=0.5, whole=[0]))
    for back, kind in (("to_trimesh", trimesh.Trimesh), ("to_pyvista", pyvista.PolyData)):
        meshes = [getattr(completed, back)(at) for at in range(4)]
        assert isinstance(meshes[0], kind)
        again = dynmesh.Sequence(meshes)
        np.testing.assert_allclose(again.vertices, completed.vertices)
        np.testing.assert_array_equal(again.faces, completed.faces)
        np.testing.assert_array_equal(again.generation, completed.generation)
        assert dynmesh.complete(meshes).report.completed == 3
        known = np.arange(again.vertices.shape[1]) % 2 > 0
        half = dynmesh.Sequence(meshes, known=np.broadcast_to(known, again.vertices.shape[:2]))
        np.testing.assert_array_equal(half[3].known, known)
        with pytest.raises(ValueError, match="faces: are those of the meshes"):
            dynmesh.Sequence(meshes, half.known)
        with pytest.raises(ValueError, match="frame 2: has other vertices or faces than frame 0"):
            dynmesh.Sequence([*meshes[:2], getattr(sea(1, grid=5), back)(0)])
    with pytest.raises(TypeError, match="faces: are missing"):
        dynmesh.Sequence(completed.vertices)
    arrays = np.where(np.arange(100)[:, None] % 2, completed.vertices, np.nan)
    arrays[0] = completed.vertices[0]
    for given in (arrays, [*arrays], tuple(map(np.ndarray.tolist, arrays))):
        assert dynmesh.complete(given, completed.faces).report.filled == 150
        assert dynmesh.evaluate(given[:1], completed[:1], faces=completed.faces).mean == 0


@pytest.mark.parametrize("kind", ["in memory", "run", "file", "meshes"])
def test_what_frames_have_is_not_given_beside_them(tmp_path: Path, kind: str) -> None:
    """Also not to what reads only some of several sequences with it."""
    path = tmp_path / "in.npz"
    dynmesh.write(path, TRUTH)
    if kind == "meshes":
        pytest.importorskip("trimesh")
    given: Any = {
        "in memory": lambda: TRUTH,
        "run": lambda: dynmesh.convert(path, scale=2),
        "file": lambda: dynmesh.open(path),
        "meshes": lambda: [TRUTH.to_trimesh(at) for at in range(3)],
    }[kind]
    others = TRUTH.faces[:, ::-1]
    verbs: dict[str, Callable[..., Any]] = {
        "complete": dynmesh.complete,
        "convert": dynmesh.convert,
        "degrade": lambda frames, faces: dynmesh.degrade(frames, faces, known=0.5),
        "info": lambda frames, faces: dynmesh.info(frames, faces=faces),
        "write": lambda frames, faces: dynmesh.write(tmp_path / "out.npz", frames, faces),
        "evaluate": lambda frames, faces: dynmesh.evaluate(frames, frames, faces=faces),
        "picture": lambda frames, faces: dynmesh.picture(frames, source={"faces": faces}),
    }
    for verb in verbs.values():
        with pytest.raises(ValueError, match=r"^faces: (has no effect|are those of the meshes)"):
            verb(given(), others)
    with pytest.raises(ValueError, match=r"^missing: has no effect"):
        dynmesh.info(given(), source={"missing": -1, "gaps": "refuse"})
    if kind != "meshes":
        with pytest.raises(ValueError, match=r"^prim: has no effect"):
            dynmesh.read(given(), prim="/a")


def test_frames_that_are_not_in_memory_stay_in_their_process(tmp_path: Path) -> None:
    dynmesh.write(tmp_path / "in.npz", PARTIAL)
    completed: Any = dynmesh.complete(PARTIAL, start=0)
    for copied in (pickle.loads(pickle.dumps(completed)), deepcopy(completed), copy(completed)):
        assert_alike(copied, completed)
        assert copied.report == completed.report
    opened = dynmesh.open(tmp_path / "in.npz")
    for duplicate in (pickle.dumps, deepcopy, copy):
        with pytest.raises(TypeError, match=r"scans: .*write\(\) them"):
            duplicate(dynmesh.degrade(opened, scan=True))
        for frames in (opened, opened[1:3], dynmesh.convert(opened, scale=2)):
            with pytest.raises(TypeError, match=r"in\.npz: .*dynmesh\.read\(\) keeps them"):
                duplicate(frames)


def test_a_doubt_is_warned_of_where_the_result_was_asked_for(tmp_path: Path) -> None:
    order = np.random.default_rng(0).permutation(144)
    wrong = replace(TRUTH, vertices=np.concatenate([TRUTH.vertices[:1], TRUTH.vertices[1:, order]]))
    dynmesh.write(tmp_path / "wrong.npz", wrong)
    for ask in (lambda: dynmesh.complete(wrong), dynmesh.complete(tmp_path / "wrong.npz").read):
        with pytest.warns(dynmesh.DoubtfulWarning) as caught:
            ask()
        assert caught[0].filename == __file__
