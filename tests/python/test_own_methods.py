"""Methods of a user in the study."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from meshes import sheet, turned

import dynmesh
from dynmesh import study
from dynmesh.study.losses import random_masks
from dynmesh.study.measure import run
from dynmesh.study.own_methods import own_methods
from dynmesh.study.subjects import Subject

MESH = sheet(7)
FRAMES = np.stack([turned(MESH.vertices, 0.05 * i) for i in range(5)])


class Hold:
    """Missing vertices stay where they were."""

    def __init__(self, faces: Any, first_frame: Any) -> None:
        self.frame = first_frame
        faces[:] = 0  # must not matter to others

    def push(self, points: Any, known: Any) -> Any:
        assert np.isnan(points[~known]).all()
        self.frame = np.where(known[:, None], points, self.frame)
        completed = self.frame.copy()
        points[:], known[:] = 0, False
        return completed


def measured(begin: Any) -> Any:
    subject = Subject.of("sheet", dynmesh.Sequence(FRAMES, MESH.faces), "z", 60.0, None)
    masks = list(random_masks(subject, 0.5, 0))
    (method,) = own_methods({"mine": begin})
    return subject, masks, run(subject, method, masks, keep=[1, 4])


def test_a_method_gets_known_positions_alone_and_cannot_change_the_study() -> None:
    subject, masks, found = measured(Hold)
    np.testing.assert_array_equal(subject.vertices, FRAMES)
    np.testing.assert_array_equal(subject.faces, MESH.faces)
    assert [np.count_nonzero(~mask) for mask in masks[1:]] == found.unknown.tolist()
    first = np.where(masks[1][:, None], FRAMES[1], FRAMES[0])
    np.testing.assert_array_equal(found.frames[1], first)
    assert (found.nmsve > 0).all()
    assert (found.seconds > 0).all()


class Without:
    """Has no push."""

    def __init__(self, *_: Any) -> None: ...


def returning(value: Callable[[Any], Any]) -> Any:
    """A method whose third frame is wrong."""

    class Wrong(Hold):
        number = 0

        def push(self, points: Any, known: Any) -> Any:
            self.number += 1
            completed = super().push(points, known)
            return value(completed) if self.number == 3 else completed

    return Wrong


@pytest.mark.parametrize(
    ("begin", "message"),
    [
        (Without, "mine: must return an object with a method push.*, not <.*Without"),
        (lambda faces: faces, "mine: raised TypeError: .*takes 1 positional argument but 2"),
        (returning(lambda _: None), "frame 3: mine: must be a numpy array, not NoneType"),
        (returning(lambda frame: frame[1:]), r"frame 3: mine: must .* \(49, 3\), not \(48, 3\)"),
        (returning(lambda frame: frame.astype(int)), "frame 3: mine: must be float32 or float64"),
        (returning(lambda frame: frame * np.nan), "frame 3: mine: must be finite, but vertex 0"),
        (returning(lambda _: 1 / 0), "frame 3: mine: raised ZeroDivisionError: division"),
    ],
)
def test_a_method_of_the_wrong_shape_is_named(begin: Any, message: str) -> None:
    with pytest.raises((ValueError, TypeError), match=message):
        measured(begin)


def test_methods_are_imported_from_the_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))  # which removes it again
    (tmp_path / "a_method.py").write_text("class A:\n    class B: pass\n\n\nnothing = None\n")
    (tmp_path / "broken_method.py").write_text("class A:\n    1 / 0\n")
    found = study.imported(["a_method:A", "a_method:A.B"])
    assert [begin.__qualname__ for begin in found.values()] == ["A", "A.B"]
    for names, message in (
        (["a_method"], "method: must be MODULE:NAME, such as mine:Method, not 'a_method'"),
        (["a_method:A", "a_method:A"], "method: two are called 'A'"),
        (["broken_method:A"], "cannot import broken_method:A: ZeroDivisionError"),
        (["a_method:C"], "cannot import a_method:C: AttributeError: .* 'C'"),
        (
            ["no_such_method:C"],
            r"cannot import no_such_method:C: ModuleNotFoundError.*; modules are looked for in /",
        ),
    ):
        with pytest.raises(ValueError, match=message):
            study.imported(names)


@pytest.mark.parametrize(
    ("methods", "message"),
    [
        ({"motion": Hold}, "methods: there is a method 'motion' already"),
        ({"LIA on motion": Hold}, "there is a method 'LIA on motion' already"),
        ({"mine": None}, "mine: must be callable, not None"),
        ({"mine": 3}, "mine: must be callable, not 3"),
    ],
)
def test_names_and_kinds_are_checked_before_anything_is_measured(
    tmp_path: Path, methods: dict[str, Any], message: str
) -> None:
    pytest.importorskip("pyvista")
    with pytest.raises((ValueError, TypeError), match=message):
        study.reproduce(tmp_path / "results", methods=methods)
    assert not (tmp_path / "results").exists()
