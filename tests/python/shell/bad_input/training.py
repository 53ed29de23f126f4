"""Cases of training: frames that a completer learns from, and the files that hold them."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import to_file

import dynmesh

from .case import World
from .commands import refused
from .functions import of


def prepare(world: World) -> None:
    """Creates further training files, in addition to the files of other modules."""
    folder, sequence = world.folder, world.sequence
    dynmesh.write(folder / "training.npz", sequence)
    dynmesh.write(folder / "big.npz", replace(sequence, vertices=1000 * sequence.vertices))
    dynmesh.write(folder / "y_up.npz", replace(sequence, up_axis="y"))
    dynmesh.write(folder / "z_up.npz", replace(sequence, up_axis="z"))


def _make(training: Any, **settings: Any) -> Callable[[World], Any]:
    def run(world: World) -> Any:
        frames = training(world) if callable(training) else training
        return world.make(**{"method": "detail", "training": frames, **settings})

    return run


def _file(training: Any, path: str = "body.npz", output: str = "new.npz", **options: Any) -> Any:
    return to_file.complete(path, output, training=training, **options)


def _restored(world: World, other: Any, **settings: Any) -> None:
    """Restores the state of a completer that learned from other frames, or from none."""
    training = [world.vertices, world.points, world.vertices]
    made = world.make(training=training)
    made.restore(world.make(training=other, **settings).state())


def _tracker(world: World, training: Any, *, uncertainty: bool = True) -> dynmesh.Tracker:
    first = (world.faces, world.vertices)
    return dynmesh.Tracker(*first, training=training, uncertainty=uncertainty)


_restore = of("restore")
_track = of("Tracker.restore")
_completer = of("Completer")
_completed = of("complete_file")
_convert = of("convert_file")
_three = "training: frame 1: vertex 4"

cases = [
    _completer("`training`: a number", _make(3), TypeError, "training:", "int"),
    _completer("`training`: one frame, not several", _make(lambda w: w.vertices), ValueError, "training:", "(3,)"),
    _completer("`training`: integers", _make(lambda w: [w.vertices.astype(int)] * 3), TypeError, "training:", "int64"),
    _completer("`training`: two frames", _make(lambda w: [w.vertices] * 2), ValueError, "training: has 2 frames", "3"),
    _completer("`training`: a row too few in frame 1", _make(lambda w: [w.vertices, w.vertices[:48]]), ValueError, "training: frame 1:", "48 rows"),
    _completer("`training`: NaN in frame 1", _make(lambda w: [w.vertices, w.with_value(np.nan)]), ValueError, _three, "nan"),
    _completer("`training`: in another unit", _make(lambda w: 1000 * w.sequence.vertices), ValueError, "training: its size", "unit"),
    _completer("`training` with method motion", _make(lambda w: w.sequence.vertices, method="motion"), ValueError, "training:", "method detail"),
    _completer("`training` and `learn=True`", _make(lambda w: w.sequence.vertices, learn=True), ValueError, "learn:", "training"),
    _restore("`state`: of another training sequence", lambda w: _restored(w, w.sequence.vertices), ValueError, "state:", "another training sequence"),
    _restore("`state`: of a completer that learns", lambda w: w.make().restore(w.make(learn=True).state()), ValueError, "learn is True, not False"),
    _track("`state`: of another training sequence", lambda w: _tracker(w, w.sequence.vertices).restore(_tracker(w, w.sequence.vertices[::-1]).state()), ValueError, "another training sequence"),
    _track("`state`: of one without `uncertainty`", lambda w: _tracker(w, None).restore(_tracker(w, None, uncertainty=False).state()), ValueError, "uncertainty is False, not True"),
    _completed("`training`: positions of another mesh", lambda w: _file(w.sequence.vertices[:, :48]), ValueError, "training"),
    _completed("`training`: a number", lambda _: _file(3), TypeError, "training:", "3"),
    _completed("`training`: an empty list", lambda _: _file([]), ValueError, "training:", "no file"),
    _completed("a training file with fewer vertices", lambda _: _file("fewer.npz"), ValueError, "fewer.npz:", "7", "body.npz has 49"),
    _completed("a training file with fewer triangles", lambda _: _file("fewer_faces.npz"), ValueError, "fewer_faces.npz:", "other faces than ", "body.npz"),
    _completed("a training file with positions alone, of fewer vertices", lambda _: _file("other.pc2"), ValueError, "other.pc2:", "7"),
    _completed("a training file with a hole in frame 1", lambda _: _file("late_holes.npz"), ValueError, "late_holes.npz: frame 1:", "vertex 4", "whole"),
    _completed("a training file that states another unit", lambda _: _file("in_metres.npz", "in_millimetres.npz"), ValueError, "in_metres.npz:", "unit", "0.001"),
    _completed("a training file that states another up axis", lambda _: _file("y_up.npz", "z_up.npz"), ValueError, "y_up.npz:", "up axis", "z"),
    _completed("a training file in another unit by its size", lambda _: _file("big.npz"), ValueError, "big.npz: training: its size", "unit"),
    _completed("a training file as output", lambda _: _file("training.npz", output="training.npz", overwrite=True), ValueError, "training.npz:", "input"),
    _completed("a template as output", lambda _: to_file.complete("body.npz", "single.npz", template="single.npz", overwrite=True), ValueError, "single.npz:", "input"),
    _completed("a training file without the mesh of that path", lambda _: _file("two.usda", "scene.usda"), ValueError, "two.usda:", "'/mesh'", "/one, /two"),
    _convert("a file with another up axis", lambda _: to_file.convert("z_up.npz", "new.npz", up="y"), ValueError, "z_up.npz: up:", "z, not y"),
    refused("complete body.npz new.npz --training training.npz fewer.npz", "fewer.npz:", "body.npz has 49"),
]  # fmt: skip
