"""Completers and trackers that are pickled and copied continue with the same results."""

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from meshes import Array, Mesh, sheet, turned

import dynmesh

MESH: Mesh = sheet(7)
FRAMES = np.stack(
    [turned(MESH.vertices, 0.05 * i) + 0.02 * i * np.sin(MESH.vertices) for i in range(12)]
)
KNOWN = np.random.default_rng(0).random(FRAMES.shape[:2]) < 0.5
COMPLETERS: dict[str, dict[str, Any]] = {
    "usual": {},
    "motion": {"method": "motion", "extra_iterations": 3, "disconnected": "hold"},
    "noise and outliers": {"noise": 0.01, "reject_outliers": True, "threads": 2},
    "learning": {"learn": True, "uncertainty": True},
    "training": {"training": FRAMES[:5]},
    "much training": {"training": [FRAMES[i % 12] for i in range(200)]},
}
TRACKERS: dict[str, dict[str, Any]] = {
    "usual": {},
    "training": {"training": FRAMES[:5], "uncertainty": True, "threads": 2, "recover": True},
}
Subject = dynmesh.Completer | dynmesh.Tracker
Copy = Callable[[Any], Any]
COPIES: list[Copy] = [lambda s: pickle.loads(pickle.dumps(s)), copy.deepcopy, copy.copy]


def pushed(subject: Subject, number: int) -> Array:
    if isinstance(subject, dynmesh.Completer):
        return subject.push(FRAMES[number], KNOWN[number])
    return subject.push(FRAMES[number][KNOWN[number]])


def all_pushed(subject: Subject, numbers: range) -> tuple[list[Array], bytes]:
    return [pushed(subject, number) for number in numbers], subject.state()


SUBJECTS = [
    pytest.param(kind, settings, id=f"{kind.__name__}, {name}")
    for kind, rows in ((dynmesh.Completer, COMPLETERS), (dynmesh.Tracker, TRACKERS))
    for name, settings in rows.items()
]


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize(("kind", "settings"), SUBJECTS)
def test_copies_continue_bit_for_bit(kind: Any, settings: dict[str, Any], dtype: Any) -> None:
    first = FRAMES[0].astype(dtype)
    faces = MESH.faces.astype(np.int32)
    subject = kind(faces, first, **settings)
    all_pushed(subject, range(1, 5))
    faces[:], first[:] = 0, 0  # what the caller does with its arrays later has no effect
    for copied in [made(subject) for made in COPIES] + [pickle.loads(pickle.dumps(subject))]:
        assert copied.settings == subject.settings
        assert copied.dtype == dtype
        assert copied.state() == subject.state()
        before = subject.state()
        ours, theirs = all_pushed(subject, range(5, 9)), all_pushed(copied, range(5, 9))
        np.testing.assert_array_equal(ours[0], theirs[0])
        assert ours[1] == theirs[1]
        subject.restore(before)
        copied.reset(FRAMES[3])  # which is independent
        assert subject.state() == before


def test_a_frame_0_of_another_size_than_the_training_frames_is_pickled_as_well() -> None:
    completer = dynmesh.Completer(MESH.faces, FRAMES[0], training=FRAMES[:5])
    completer.reset(1000 * FRAMES[0])  # which the constructor would refuse
    assert pickle.loads(pickle.dumps(completer)).state() == completer.state()


class Named(dynmesh.Completer):
    """A completer with an attribute."""

    name = "none"


def test_a_subclass_keeps_its_attributes() -> None:
    completer = Named(MESH.faces, FRAMES[0])
    completer.name = "front"
    assert [made(completer).name for made in COPIES] == ["front"] * 3
    assert type(COPIES[0](completer)) is Named


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"state": b""}, "state: truncated"),
        ({"state": dynmesh.Tracker(MESH.faces, FRAMES[0]).state()}, "not a completer state"),
        ({"_settings": {"method": "motion"}}, "state: .* method is detail, not motion"),
        ({"_settings": {"speed": 2}}, "settings: one of them is not known"),
        ({"_faces": MESH.faces[1:].astype(np.int32)}, "state: of a mesh with other faces"),
    ],
)
def test_pickles_of_something_else_are_refused(changes: dict[str, Any], message: str) -> None:
    kept, state = dynmesh.Completer(MESH.faces, FRAMES[0]).__getstate__()
    state = changes.pop("state", state)
    made = dynmesh.Completer.__new__(dynmesh.Completer)
    with pytest.raises(ValueError, match=message):
        made.__setstate__((kept | changes, state))


@pytest.mark.parametrize("kind", [dynmesh.Completer, dynmesh.Tracker])
def test_reports_are_pickled_and_copied(kind: Any) -> None:
    subject = kind(MESH.faces, FRAMES[0], uncertainty=True)
    all_pushed(subject, range(1, 4))
    report: Any = subject.report
    names = [name for name in dir(report) if not name.startswith("_")]
    assert len(names) >= 14
    for copied in [made(report) for made in COPIES]:
        assert type(copied) is type(report)
        for name in names:
            np.testing.assert_equal(getattr(copied, name), getattr(report, name), err_msg=name)
