"""Completers and trackers that are pickled and copied; test_stateful continues with the copies."""

import copy
import pickle
from typing import Any

import numpy as np
import pytest
from meshes import Mesh, sheet, turned

import dynmesh

MESH: Mesh = sheet(7)
FRAMES = np.stack([turned(MESH.vertices, 0.05 * i) for i in range(5)])


def pickled(subject: Any) -> Any:
    return pickle.loads(pickle.dumps(subject))


COPIES = (pickled, copy.copy, copy.deepcopy)


def test_what_the_caller_does_with_its_arrays_later_has_no_effect() -> None:
    given = MESH.faces.astype(np.int32), FRAMES[0].copy(), FRAMES.copy()
    completer = dynmesh.Completer(*given[:2], training=given[2])
    for array in given:
        array[:] = 0
    assert pickled(completer).state() == completer.state()


def test_a_frame_0_of_another_size_than_the_training_frames_is_pickled_as_well() -> None:
    completer = dynmesh.Completer(MESH.faces, FRAMES[0], training=FRAMES[:5])
    completer.reset(1000 * FRAMES[0])  # which the constructor would refuse
    assert pickled(completer).state() == completer.state()


class Named(dynmesh.Completer):
    """A completer with an attribute."""

    name = "none"


def test_a_subclass_keeps_its_attributes() -> None:
    completer = Named(MESH.faces, FRAMES[0])
    completer.name = "front"
    assert [made(completer).name for made in COPIES] == ["front"] * 3
    assert type(pickled(completer)) is Named


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
    subject.push(FRAMES[1])
    report: Any = subject.report
    names = [name for name in dir(report) if not name.startswith("_")]
    assert len(names) >= 14
    for copied in [made(report) for made in COPIES]:
        assert type(copied) is type(report)
        for name in names:
            np.testing.assert_equal(getattr(copied, name), getattr(report, name), err_msg=name)
