"""Cases of sequences in memory and in files."""

from dataclasses import replace
from typing import Any

import numpy as np
import to_file

import dynmesh
from dynmesh._errors import SettingError
from dynmesh.formats import FORMATS
from dynmesh.polygons import Polygons

from .case import Case, World, without_rights
from .functions import of

_LISTS = {
    "2 3\n2 x\n": "line 2: must be a frame",
    "3.5.1 2\n": "line 1: must be a frame",
    "* 49\n": "line 1: there is no vertex 49, only 0 to 48",
    "PK\xe5\x04": "line 1: must be a frame",
    "9 1\n": "line 1: there is no frame 9",
}
"""What is in a file of damaged vertices, and what is said of it."""


def prepare(world: World) -> None:
    """Creates the files that the cases read."""
    folder, sequence = world.folder, world.sequence
    dynmesh.write(folder / "body.npz", sequence)
    dynmesh.write(folder / "other.npz", sequence)
    dynmesh.write(folder / "locked.npz", sequence)
    (folder / "locked.npz").chmod(0)
    (folder / "body").touch()
    (folder / "folder.npz").mkdir()
    (folder / "frames").mkdir()
    dynmesh.write(folder / "single.npz", replace(sequence, vertices=sequence.vertices[:1]))
    late = sequence.vertices.copy()
    late[1, 4, 1] = np.nan
    dynmesh.write(folder / "late_holes.npz", replace(sequence, vertices=late))
    every = np.ones((3, 49), bool)
    dynmesh.write(folder / "late_known.npz", replace(sequence, vertices=late, known=every))
    points = sequence.vertices.copy()
    points[0, 4, 1] = np.nan
    dynmesh.write(folder / "holes.npz", replace(sequence, vertices=points))
    dynmesh.write(folder / "late_start.npz", replace(sequence, vertices=points, start=1001))
    sparse = np.full_like(points, np.nan)
    sparse[2, 1:] = 1
    dynmesh.write(folder / "no_whole.npz", replace(sequence, vertices=sparse))
    dynmesh.write(folder / "nothing.npz", replace(sequence, vertices=np.nan * points))
    turned_face = sequence.faces.copy()
    turned_face[3] = turned_face[3, ::-1]
    dynmesh.write(folder / "turned_face.npz", replace(sequence, faces=turned_face))
    dynmesh.write(folder / "fewer_faces.npz", replace(sequence, faces=sequence.faces[:-1]))
    dynmesh.write(folder / "in_metres.npz", replace(sequence, metres_per_unit=1.0))
    dynmesh.write(folder / "in_millimetres.npz", replace(sequence, metres_per_unit=0.001))
    for up, rate in (("y", 24.0), ("z", 30.0)):
        dynmesh.write(folder / f"{up}_up.npz", replace(sequence, up_axis=up))
        dynmesh.write(folder / f"at_{rate:g}.npz", replace(sequence, fps=rate))
    big = np.random.default_rng(0).normal(size=(40, 49, 3))
    dynmesh.write(folder / "long.npz", replace(sequence, vertices=big))
    np.save(folder / "mask.npy", np.ones((3, 48), bool))
    (folder / "text.npy").write_text("hello")
    np.save(folder / "numbers.npy", np.ones((3, 49)))
    np.save(folder / "known.npy", every)
    for number, text in enumerate(_LISTS):
        (folder / f"damaged_{number}.txt").write_text(text, "latin-1")
    np.save(folder / "bare.npy", sequence.vertices)
    dynmesh.write(folder / "walk" / "frame_%04d.ply", sequence)
    dynmesh.write(folder / "scene.usda", sequence)
    dynmesh.write(folder / "scene.abc", sequence)
    twice = "".join(f'def "{name}" (references = @scene.usda@) {{}}\n' for name in ("one", "two"))
    (folder / "two.usda").write_text(f"#usda 1.0\n{twice}")


def _sequence(given: str, error: type[Exception], *names: str, **changed: Any) -> Case:
    return Case("Sequence", given, lambda w: replace(w.sequence, **changed), error, names)


sequences = [
    _sequence("`vertices`: ragged lists", ValueError, "vertices:", "converted to an array", vertices=[[[0.0, 0, 0], [0]]]),
    _sequence("`vertices`: a dict", TypeError, "vertices:", "dict", vertices={}),
    _sequence("`vertices`: one frame", ValueError, "vertices:", "(49, 3)", vertices=np.ones((49, 3))),
    _sequence("`faces`: an index of 99", ValueError, "faces: face 0", "vertex 99", faces=np.array([[0, 1, 99]])),
    _sequence("`faces`: counted from 1", ValueError, "faces: face 0", "vertex 49", "from 1: subtract 1", faces=np.array([[1, 2, 49]])),
    Case("Sequence", "`polygons` of other faces", lambda w: replace(replace(w.sequence, faces=np.array([[0, 1, 2, 3]])), faces=w.faces), ValueError, ("polygons:", "other triangles than faces")),
    _sequence("`polygons` with a corner of 999", ValueError, "polygons:", "other triangles", polygons=Polygons(np.array([4]), np.array([0, 1, 2, 999]))),
    _sequence("`name`: a number", TypeError, "name:", "3", name=3),
    _sequence("`standard_error_of`: volume", ValueError, "standard_error_of:", "'volume'", "surface", standard_error_of="volume"),
]  # fmt: skip

_frame = of("Sequence[...]")

frames = [
    _frame("a frame after the last", lambda w: w.sequence[3], IndexError, "frame:", "-3 to 2", "not 3"),
    _frame("a frame of none", lambda w: w.sequence[:0][0], IndexError, "frame:", "none", "0"),
    _frame("1.0", lambda w: w.sequence[1.0], TypeError, "frame:", "integer", "float"),
    _frame("a mask of frames", lambda w: w.sequence[np.ones(3, bool)], TypeError, "frame:", "ndarray"),
    _frame("`::-1`", lambda w: w.sequence[::-1], ValueError, "step:", "at least 1", "-1"),
    _frame("`::0`", lambda w: w.sequence[::0], ValueError, "step:", "at least 1", "0"),
]  # fmt: skip

_read = of("read")
_open = of("open")
_write = of("write")

reading = [
    _read("a file that one may not read", lambda _: without_rights()(dynmesh.read)("locked.npz"), PermissionError, "locked.npz", "denied"),
    _read("a folder with a file's name", lambda _: dynmesh.read("folder.npz"), ValueError, "folder.npz:", "folder"),
    _read("no suffix", lambda _: dynmesh.read("body"), ValueError, "body:", "no suffix", "name the format"),
    _read("another file's format", lambda _: dynmesh.read("body.npz", format="pc2"), ValueError, "body.npz:"),
    _read("a name with a zero byte", lambda _: dynmesh.read("bo\0dy.npz"), ValueError, "null byte"),
    _read("`faces` for a file with faces", lambda w: dynmesh.read("body.npz", faces=w.faces), ValueError, "body.npz:", "holds its faces"),
    _read("`prim` for a file with one mesh", lambda _: dynmesh.read("body.npz", prim="/a"), ValueError, "body.npz:", "prim"),
    _read("`known`: a file with too few", lambda _: dynmesh.read("body.npz", known="mask.npy"), ValueError, "mask.npy: known:", "(3, 48)"),
    _read("`known`: a file of text", lambda _: dynmesh.read("body.npz", known="text.npy"), ValueError, "text.npy:", "mask"),
    _read("`known`: a file of numbers", lambda _: dynmesh.read("body.npz", known="numbers.npy"), ValueError, "numbers.npy: frame 0: known:", "float64"),
    *(_read(f"`known`: {text!r}", lambda _, n=n: dynmesh.read("body.npz", known=f"damaged_{n}.txt"), ValueError, f"damaged_{n}.txt: {told}") for n, (text, told) in enumerate(_LISTS.items())),
    _read("`missing='nan'`", lambda _: dynmesh.read("body.npz", missing="nan"), ValueError, "missing:", "'nan'"),
    *(_open(f"{name}, which is not there", lambda _, name=name: dynmesh.open(name), FileNotFoundError, name)
      for name in (f"none{'_%d' * one.is_per_frame}{one.suffixes[0]}" for one in FORMATS.values())),
    _open("a mesh that is not there", lambda _: dynmesh.open("scene.abc", prim="/no"), ValueError, "scene.abc:", "'/no'", "/mesh"),
]  # fmt: skip


def _written(world: World, *frames: Any, **changed: Any) -> Any:
    given = {"faces": world.faces, "n_frames": 3, "n_vertices": 49, "dtype": np.float64}
    header = dynmesh.Header(**(given | changed))
    return dynmesh.write("new.npz", to_file.frames_of(header, frames))


writing = [
    _write("no sequence", lambda _: dynmesh.write("new.npz", 5), TypeError, "frames:", "int"),  # type: ignore[arg-type]
    _write("into a file", lambda w: dynmesh.write("body.npz/new.npz", w.sequence), NotADirectoryError, "body.npz is not a folder", "body.npz/new.npz"),
    _write("over a folder", lambda w: dynmesh.write("folder.npz", w.sequence), ValueError, "folder.npz:", "folder"),
    _write("`faces`: a number", lambda w: _written(w, faces=3), ValueError, "faces:", "(m, 3)", "()"),
    _write("`dtype`: int", lambda w: _written(w, dtype=int), TypeError, "int64"),
    _write("`origin`: a path", lambda w: dynmesh.Sequence(w.sequence.vertices, w.faces, origin="body.obj"), TypeError, "origin:", "another sequence"),  # type: ignore[arg-type]
    _write("`times`: a list", lambda w: _written(w, times=[0.0, 1, 2]), TypeError, "times:", "numpy array", "list"),
    _write("a mask one too small", lambda w: _written(w, dynmesh.Frame(w.points, w.known[:48]), attributes=["known"]), ValueError, "frames: frame 0:", "known:", "(49,)", "(48,)"),
    _write("frames of float32, announced as float64", lambda w: _written(w, w.points.astype(np.float32)), ValueError, "frames: frame 0:", "float64", "float32"),
    _write("a mask that was not announced", lambda w: _written(w, dynmesh.Frame(w.points, w.known)), ValueError, "frames: frame 0:", "mask"),
    _write("provenance that is not there", lambda w: dynmesh.write("new.npz", w.sequence, provenance=True), ValueError, "provenance:", "none"),
]  # fmt: skip

_complete = of("complete")
_convert = of("convert")


def _to_new(world: World, path: Any = "body.npz", **options: Any) -> Any:  # noqa: ARG001
    return to_file.complete(path, "new.npz", **options)


def _converted(world: World, **options: Any) -> Any:
    return dynmesh.read(dynmesh.convert(world.sequence, **options))


completing = [
    _complete("arrays instead of a path", lambda w: _to_new(w, path=w.sequence.vertices), TypeError, "faces:", "missing"),
    _complete("`template`: an array", lambda w: _to_new(w, template=w.sequence.vertices[0]), TypeError, "faces:", "missing"),
    _complete("an output that exists", lambda _: to_file.complete("body.npz", "other.npz"), FileExistsError, "other.npz:", "overwrite"),
    _complete("the input as output", lambda _: to_file.complete("body.npz", "body.npz", overwrite=True), ValueError, "body.npz:", "input"),
    _complete("a layer over itself", lambda _: to_file.complete("scene.usda", "scene.usda", overwrite=True), ValueError, "scene.usda:", "input"),
    _complete("the masks of the input as output", lambda _: to_file.complete("body.npz", "known.npy", source={"known": "known.npy"}, overwrite=True), ValueError, "known.npy:", "is the input"),
    _complete("the faces of the input as output", lambda _: to_file.complete("bare.npy", "single.npz", source={"faces": "single.npz"}, overwrite=True), ValueError, "single.npz:", "is the input"),
    _complete("the frames of a folder as output", lambda _: to_file.complete("walk", "walk/frame_%04d.ply", overwrite=True), ValueError, "frame_0000.ply:", "is the input"),
    _complete("frames among those of the input", lambda _: to_file.complete("walk", "walk/out_%04d.ply", overwrite=True), ValueError, "out_%04d.ply:", "is in the folder of the input"),
    _complete("a sequence in which nothing was observed", lambda w: _to_new(w, "nothing.npz"), ValueError, "nothing.npz: frames: no vertex is known in any of them"),
    _complete("`start='first'`", lambda w: _to_new(w, start="first"), ValueError, "start:", "'first'"),
    _complete("`start='whole'`", lambda w: _to_new(w, "no_whole.npz", start="whole"), ValueError, "start:", "'whole'"),
    _complete("`template` and `start`", lambda w: _to_new(w, template="body.npz", start=1), ValueError, "template:", "start"),
    _complete("`template`: a file that is not there", lambda w: _to_new(w, template="none.obj"), FileNotFoundError, "none.obj"),
    _complete("`template` with holes", lambda w: _to_new(w, template="holes.npz"), ValueError, "holes.npz: 1 of 49 vertices is missing"),
    _complete("`template` with other faces", lambda w: _to_new(w, template="turned_face.npz"), ValueError, "turned_face.npz: has other faces than ", "body.npz"),
    _complete("`template` in another unit", lambda w: _to_new(w, "in_metres.npz", template="in_millimetres.npz"), ValueError, "in_millimetres.npz: its unit in metres is 0.001, but 1"),
    *(_complete(f"`{name}` with method motion, before any file", lambda _, option=option: dynmesh.complete("none.npz", method="motion", **option), SettingError, f"{name}: is for method detail")
      for option in ({"bidirectional": True}, {"drop_above": 1.0}, {"training": "t.npz"}) for name in option),
    _complete("`gaps` of a single file", lambda w: _to_new(w, source={"gaps": "lost"}), ValueError, "body.npz: gaps"),
    _complete("`gaps='some'`", lambda w: _to_new(w, source={"gaps": "some"}), ValueError, "gaps:", "'some'"),
    _convert("`frames`: none of them", lambda w: _converted(w, frames=range(1, 1)), ValueError, "frames:", "not 1:1"),
    _convert("`frames`: an integer", lambda w: _converted(w, frames=3), TypeError, "frames:", "must be a slice, not int"),
    _convert("`frames` with step -1", lambda w: _converted(w, frames=slice(None, None, -1)), ValueError, "frames:", "not -1"),
    _convert("`up='w'`", lambda w: _converted(w, up="w"), ValueError, "up:", "'w'"),
    _convert("`unit='furlong'`", lambda w: _converted(w, unit="furlong"), ValueError, "unit:", "'furlong'"),
    _convert("`to_up` of an unknown axis", lambda w: _converted(w, to_up="y"), ValueError, "to_up:", "states no up axis"),
    _convert("`to_unit` of an unknown unit", lambda w: _converted(w, to_unit="m"), ValueError, "to_unit:", "states no unit of length"),
    _convert("`scale`: 0", lambda w: _converted(w, scale=0), ValueError, "scale:", "not 0"),
    _convert("`fps`: NaN", lambda w: _converted(w, fps=float("nan")), ValueError, "fps:", "not nan"),
    _convert("an array", lambda w: dynmesh.read(dynmesh.convert(w.vertices)), TypeError, "faces:", "missing"),
    _convert("a file in another unit", lambda _: to_file.convert("in_metres.npz", "new.npz", unit="mm"), ValueError, "in_metres.npz: unit: the file states units of 1 m, not 0.001 m"),
    _complete("`drop_above`: NaN", lambda w: _to_new(w, drop_above=float("nan")), ValueError, "drop_above:", "not nan"),
    _convert("`output_format='fbx'`", lambda _: to_file.convert("body.npz", "new.npz", output_format="fbx"), ValueError, "new.npz:", "'fbx'"),
]  # fmt: skip

cases = [*sequences, *frames, *reading, *writing, *completing]
