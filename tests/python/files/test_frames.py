"""Frames by the same words, wherever they are, and the reports of those that verbs make."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sequences import sea

import dynmesh
from dynmesh.scans import open_scans

N = 6
TRUTH = sea(N)
PARTIAL = sea(N, share=0.5, whole=[0])
_ORDER = np.random.default_rng(0).permutation(100)
SHUFFLED = replace(
    PARTIAL, vertices=np.concatenate([TRUTH.vertices[:1], TRUTH.vertices[1:, _ORDER]])
)
"""Of which the result is probably ruined."""


@pytest.fixture
def files(tmp_path: Path) -> Path:
    dynmesh.write(tmp_path / "a.npz", PARTIAL)
    return tmp_path / "a.npz"


def test_a_file_and_a_sequence_answer_to_the_same_words(tmp_path: Path) -> None:
    of_frame = np.tile(np.arange(N, dtype=np.int32)[:, None], (1, 100))
    traced = replace(PARTIAL, generation=of_frame, age=of_frame)
    dynmesh.write(tmp_path / "a.npz", traced)
    with dynmesh.open(tmp_path / "a.npz") as opened:
        frames: Any
        for frames in (opened, traced):
            assert (len(frames), frames.n_frames, frames.header.n_frames) == (N, N, N)
            assert [len(frame.points) for frame in frames] == [100] * N
            np.testing.assert_array_equal(frames[-2].points, PARTIAL.vertices[-2])
            for chosen in (slice(1, 5, 2), range(1, 5, 2), [1, 3], np.array([1, 3])):
                part = frames[chosen]
                assert len(part) == 2
                np.testing.assert_array_equal(part[1].known, np.asarray(PARTIAL.known)[3])
                assert part[1].generation[7] == part[1].age[7] == 3
                assert [part.header.number(i) for i in range(2)] == [1, 3]
            with frames[:2] as first:
                assert len(list(first)) == 2
            assert len(list(frames)) == N  # a slice that is closed leaves them open
            with pytest.raises(TypeError, match="frame: must be an integer"):
                frames[1, 2]
            with pytest.raises(ValueError, match="must ascend"):
                frames[[3, 1]]


SELECTIONS: list[tuple[int, int | None, int]] = [
    (3, 0, -1),
    (0, None, 1),
    (1, 99, 2),
    (-2, None, 1),
    (-1, -4, -1),
    (4, 2, 1),
    (0, None, -1),
]


@pytest.mark.parametrize("kind", ["sequence", "file", "part", "masked", "computed", "scans"])
@pytest.mark.parametrize("selection", SELECTIONS)
def test_a_selection_means_the_same_of_all_frames(
    tmp_path: Path, selection: tuple[int, int | None, int], kind: str
) -> None:
    def number(frame: Any) -> float:
        return float(frame.points[0, 0])

    points = np.arange(N, dtype=np.float32)[:, None, None] + np.zeros((N, 4, 3), np.float32)
    counted = dynmesh.Sequence(points, np.array([[0, 1, 2], [0, 2, 3]]))
    frames: Any = counted
    if kind == "scans":
        for at in range(N):
            (tmp_path / f"s_{at}.xyz").write_text(f"{at} 0 0\n")
        frames = open_scans(tmp_path)
    elif kind != "sequence":
        dynmesh.write(tmp_path / "a.npz", counted)
        frames = dynmesh.open(tmp_path / "a.npz", missing="zero" if kind == "masked" else None)
    if kind == "part":
        dynmesh.write(tmp_path / "b.npz", dynmesh.Sequence(np.repeat(points, 2, 0), counted.faces))
        frames = dynmesh.open(tmp_path / "b.npz")[::2]
    if kind == "computed":
        frames = dynmesh.convert(frames)
    start, stop, step = selection
    expected = [*range(N)][start:stop:step]
    assert [number(frame) for frame in frames.frames(start, stop, step)] == expected
    if kind == "computed":
        assert frames.report.quality == "good"  # all were made
    with pytest.raises(ValueError, match="step"):
        frames.frames(0, 2, 0)


@pytest.mark.parametrize(
    "name", ["a.npz", "a.h5", "a.npy", "a.pc2", "a_%d.ply", "a_%d.obj", "a.usdc", "a.abc"]
)
def test_frames_that_are_closed_say_so(tmp_path: Path, name: str) -> None:
    dynmesh.write(tmp_path / name, PARTIAL)
    frames = dynmesh.open(tmp_path / name, missing="zero" if name == "a.npz" else None)
    done, part, begun = dynmesh.convert(frames), frames[1:3], iter(frames)
    next(begun)
    frames.close()
    frames.close()
    for use in (lambda: next(begun), lambda: frames[2], lambda: part[0], lambda: [*done]):
        with pytest.raises(ValueError, match=r"is closed.*open it again") as caught:
            use()
        assert str(caught.value).startswith(f"{frames.path}: ")
    with PARTIAL:
        pass
    assert len([*PARTIAL]) == N


def test_a_report_is_there_when_all_frames_were_made(files: Path) -> None:
    done = dynmesh.complete(files)
    iterator = iter(done)
    for _ in range(N - 1):
        with pytest.raises(ValueError, match="no report yet"):
            done.report  # noqa: B018
        next(iterator)
    next(iterator)
    assert done.report.completed == N - 1


@pytest.mark.filterwarnings("ignore::dynmesh.DoubtfulWarning")
def test_a_doubt_goes_on(tmp_path: Path) -> None:
    dynmesh.write(tmp_path / "a.npz", SHUFFLED)
    wrong = dynmesh.complete(SHUFFLED)
    assert wrong.report.quality == "ruined"
    verbs: list[Any] = [
        lambda done: dynmesh.convert(done, scale=2.0),
        lambda done: dynmesh.convert(done, frames=slice(0, 2)),  # which are good
        lambda done: dynmesh.degrade(done, known=0.9),
        dynmesh.complete,
    ]
    for verb in verbs:
        for done in (wrong, dynmesh.complete(tmp_path / "a.npz")):
            written = dynmesh.write(tmp_path / "b.npz", verb(done))
            assert (written.quality, written.reason) == (wrong.report.quality, wrong.report.reason)


def test_frames_that_are_made_are_no_array() -> None:
    done = dynmesh.complete(dynmesh.frames.Kept(PARTIAL))
    for use in (np.asarray, lambda run: run[3], lambda run: run.generation):
        with pytest.raises((TypeError, AttributeError), match=r"read\(\)"):
            use(done)
    with pytest.raises(TypeError, match="frames: must be those of open, of a verb or a Sequence"):
        dynmesh.write("a.npz", [PARTIAL.vertices])


def test_a_completer_takes_frames() -> None:
    with pytest.raises(TypeError, match="first_frame: the known of a Frame would be ignored"):
        dynmesh.Completer(PARTIAL.faces, PARTIAL[3])
    assert dynmesh.Completer(PARTIAL.faces, PARTIAL[0]).push(PARTIAL[3]).shape == (100, 3)


@pytest.mark.parametrize(
    ("n", "points", "message"),
    [
        (3, TRUTH.vertices[:2], "frames: has only 2 of the 3 frames"),
        (1, TRUTH.vertices[:2], "frames: has more frames than the 1 of"),
        (1, TRUTH.vertices[:1, :1], r"frames: frame 0: must be float32 of shape \(100, 3\)"),
    ],
)
def test_frames_that_are_not_as_their_header_says_are_refused(
    n: int, points: Any, message: str, tmp_path: Path
) -> None:
    header = dynmesh.Header(TRUTH.faces, n, 100, TRUTH.dtype)
    for use in (dynmesh.read, lambda given: dynmesh.write(tmp_path / "a.npz", given)):
        frames: Any = dynmesh.frames.Run(header, lambda: (dynmesh.Frame(one) for one in points))
        with pytest.raises(ValueError, match=message):
            use(frames)
    assert not [*tmp_path.iterdir()]
