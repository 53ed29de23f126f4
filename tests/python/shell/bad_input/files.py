"""Cases of files: of sequences, masks, training, scans and cameras."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import to_file
from PIL import Image
from scan_files import saved

import dynmesh
from dynmesh._errors import SettingError
from dynmesh.formats import FORMATS
from dynmesh.polygons import Polygons
from dynmesh.scans import (
    PointScan,
    Rig,
    ScanCamera,
    open_scans,
    read_cameras,
    read_points,
    write_cameras,
    write_ply,
)

from .case import Case, World, of, without_rights

_POSE = np.diag([1.0, -1, -1, 1])
_CAMERA = ScanCamera("left", _POSE, np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]]), 0.001)


def _entry(field: str, row: int, column: int, value: Any) -> Callable[[Any], Any]:
    return lambda told: told["cameras"][0][field][row].__setitem__(column, value)


def _field(**changed: Any) -> Callable[[Any], Any]:
    return lambda told: told["cameras"][0].update(changed)


_CAMERAS: dict[str, tuple[Callable[[Any], Any], tuple[str, ...]]] = {
    "a pose that is no rotation": (_entry("camera_to_world", 0, 0, 1.1), ("camera 0: camera_to_world:", "0.21")),
    "a pose that mirrors": (_entry("camera_to_world", 0, 0, -1.0), ("camera 0: camera_to_world:", "mirrors")),
    "a number that is too large": (_entry("camera_to_world", 0, 3, 10**400), ("camera_to_world: row 0:", "finite, not 1000")),
    "a focal length of 0": (_entry("intrinsics", 1, 1, 0), ("intrinsics:", "0 0 ")),
    "intrinsics whose last row is another": (_entry("intrinsics", 2, 0, 0.1), ("intrinsics:", "0.1 0 1")),
    "an unknown field": (_field(lens="wide"), ("'lens'", "intrinsics")),
    "a distortion of three numbers": (_field(distortion=[0.1, 0, 0], width=640, height=480), ("camera 0: distortion:", "[0.1, 0, 0]")),
    "a distortion without the size of the images": (_field(distortion=[0.1, 0, 0, 0]), ("width:", "distortion")),
    "a depth of null": (_field(depth_scale=None), ("camera 0: depth_scale:", "None")),
    "a name with a slash": (_field(name="left/1"), ("name:", "'left/1'")),
    "an unknown unit": (lambda told: told.update(unit="furlong"), ("unit:", "'furlong'")),
    "two cameras of one name": (lambda told: told["cameras"].append(told["cameras"][0]), ("camera 1: name:", "'left'")),
}  # fmt: skip
"""What is changed in a file of cameras, and what is said of it."""
_RIGS: dict[str, tuple[bytes, str]] = {
    "cut": (b'{"unit": "m",\n "cameras": [', "line 2 column 14"),
    "deep": (b"[" * 100_000, "recursion"),
    "bytes": (b'{"unit": "\xff"}', "utf-8"),
}
"""What is in a file of cameras that is no JSON."""
_CLOUDS: dict[str, tuple[str, tuple[str, ...]]] = {
    "two coordinates": ("1 2 3\n4 5\n", ("line 2:", "2 words")),
    "normals in some lines": ("1 2 3\n1 2 3 0 0 1\n", ("line 2:", "6 numbers", "line 1 has 3")),
    "an infinite coordinate": ("1 2 3\n\n1 inf 3\n", ("line 3:", "(1, inf, 3)")),
    "one coordinate is NaN": ("nan 2 3\n", ("line 1:", "(nan, 2, 3)")),
    "colours": ("# with colours\n1 2 3 255 128 0\n", ("line 2:", "(255, 128, 0)", "colour")),
}
"""What is in a file of points, and what is said of it."""


def prepare(world: World) -> None:
    """Creates the files that the cases read."""
    folder, sequence = world.folder, world.sequence
    late, points = sequence.vertices.copy(), sequence.vertices.copy()
    late[1, 4, 1] = points[0, 4, 1] = np.nan
    sparse = np.full_like(points, np.nan)
    sparse[2, 1:] = 1
    turned_face = sequence.faces.copy()
    turned_face[3] = turned_face[3, ::-1]
    every = np.ones((3, 49), bool)
    fewer = sequence.vertices[:, :7], np.array([[0, 1, 2]])
    for name, one in {
        "body": sequence,
        "other": sequence,
        "locked": sequence,
        "training": sequence,
        "single": sequence[:1],
        "late_holes": replace(sequence, vertices=late),
        "late_known": replace(sequence, vertices=late, known=every),
        "holes": replace(sequence, vertices=points),
        "late_start": replace(sequence, vertices=points, start=1001),
        "no_whole": replace(sequence, vertices=sparse),
        "nothing": replace(sequence, vertices=np.nan * points),
        "void": replace(sequence, known=~every),
        "turned_face": replace(sequence, faces=turned_face),
        "fewer": dynmesh.Sequence(*fewer),
        "big": replace(sequence, vertices=1000 * sequence.vertices),
        "in_metres": replace(sequence, metres_per_unit=1.0),
        "in_millimetres": replace(sequence, metres_per_unit=0.001),
        "y_up": replace(sequence, up_axis="y"),
        "z_up": replace(sequence, up_axis="z"),
        "at_24": replace(sequence, fps=24.0),
        "long": replace(sequence, vertices=np.repeat(sequence.vertices[:1], 40, axis=0)),
        "template": sequence[:1],
        "template_m": replace(sequence[:1], metres_per_unit=1.0),
    }.items():
        dynmesh.write(folder / f"{name}.npz", one)
    (folder / "locked.npz").chmod(0)
    (folder / "body").touch()
    (folder / "folder.npz").mkdir()
    (folder / "frames").mkdir()
    np.save(folder / "mask.npy", np.ones((3, 48), bool))
    (folder / "text.npy").write_text("hello")
    np.save(folder / "known.npy", every)
    np.save(folder / "bare.npy", sequence.vertices)
    dynmesh.write(folder / "walk" / "frame_%04d.ply", sequence)
    for suffix in ("usda", "abc"):
        dynmesh.write(folder / f"scene.{suffix}", sequence)
    twice = "".join(f'def "{name}" (references = @scene.usda@) {{}}\n' for name in ("one", "two"))
    (folder / "two.usda").write_text(f"#usda 1.0\n{twice}")
    _write_scans(folder, world.vertices.astype(np.float32))


def _write_scans(folder: Path, points: Any) -> None:
    """Creates scans and cameras, with one fault each."""
    for name, found, unit in (
        ("cloud", points, None),
        ("far", points * 1000, None),
        ("line", points * [9.0, 0, 0] + [90, 0, 0], None),
        ("blank", points[:0], None),
        ("in_mm", points, 0.001),
    ):
        (folder / name).mkdir()
        write_ply(folder / name / "s_0000.ply", PointScan(found, None, None), unit)
    write_ply(folder / "partly.ply", PointScan(np.array([[np.nan, 2, 3]]), None, None))
    for number, (text, _) in enumerate(_CLOUDS.values()):
        (folder / f"cloud_{number}.xyz").write_text(text)
    write_cameras(folder / "rig.json", Rig((_CAMERA,)))
    for number, (spoil, _) in enumerate(_CAMERAS.values()):
        told = json.loads((folder / "rig.json").read_text())
        spoil(told)
        (folder / f"rig_{number}.json").write_text(json.dumps(told))
    write_cameras(folder / "rig_two.json", Rig((_CAMERA, replace(_CAMERA, name="right"))))
    for name, (content, _) in _RIGS.items():
        (folder / f"rig_{name}.json").write_bytes(content)
    grey = saved(Image.fromarray(np.full((3, 4), 900, np.uint16)))
    for name, images in {
        "nothing": {},
        "image": {"_00000_left": b"no image"},
        "unnumbered": {"_left": b"no image"},
        "empty_image": {"_00000_left": b""},
        "both_damaged": {"_00000_left": grey[:50], "_00001_left": grey[:70]},
        "two_numbers": {"_00000_left": grey, "_0_left": grey},
        "dropped": dict.fromkeys(["_00000_left", "_00000_right", "_00001_left"], grey),
    }.items():
        (folder / name).mkdir()
        for image, content in images.items():
            (folder / name / f"depth{image}.png").write_bytes(content)
    (folder / "kinds").mkdir()
    (folder / "kinds" / "a_0.xyz").write_text("1 2 3\n")
    write_ply(folder / "kinds" / "a_1.ply", PointScan(np.zeros((1, 3)), None, None))


def _sequence(given: str, error: type[Exception], *names: str, **changed: Any) -> Case:
    return Case("Sequence", given, lambda w: replace(w.sequence, **changed), error, names)


_of_frames = of("Sequence[...]")

_sequences = [
    _sequence("`vertices`: ragged lists", ValueError, "vertices:", "converted to an array", vertices=[[[0.0, 0, 0], [0]]]),
    _sequence("`faces`: counted from 1", ValueError, "faces: face 0", "vertex 49", "counted from 0", faces=np.array([[1, 2, 49]])),
    _sequence("`polygons` with a corner of 999", ValueError, "polygons:", "other triangles", polygons=Polygons(np.array([4]), np.array([0, 1, 2, 999]))),
    _of_frames("a frame after the last", lambda w: w.sequence[3], IndexError, "frame:", "-3 to 2", "not 3"),
    _of_frames("`::-1`", lambda w: w.sequence[::-1], ValueError, "step:", "at least 1", "-1"),
]  # fmt: skip

_read = of("read")
_open = of("open")
_write = of("write")


def _written(world: World, *frames: Any, **changed: Any) -> Any:
    given = {"faces": world.faces, "n_frames": 3, "n_vertices": 49, "dtype": np.float64}
    header = dynmesh.Header(**(given | changed))
    return dynmesh.write("new.npz", to_file.frames_of(header, frames))


_reading_and_writing = [
    _read("a file that one may not read", lambda _: without_rights()(dynmesh.read)("locked.npz"), PermissionError, "locked.npz", "denied"),
    _read("a folder with a file's name", lambda _: dynmesh.read("folder.npz"), ValueError, "folder.npz:", "folder"),
    _read("no suffix", lambda _: dynmesh.read("body"), ValueError, "body:", "no suffix", "name the format"),
    _read("another file's format", lambda _: dynmesh.read("body.npz", format="pc2"), ValueError, "body.npz:"),
    _read("a name with a zero byte", lambda _: dynmesh.read("bo\0dy.npz"), ValueError, "null byte"),
    _read("`faces` for a file with faces", lambda w: dynmesh.read("body.npz", faces=w.faces), ValueError, "body.npz:", "holds its faces"),
    _read("`prim` for a file with one mesh", lambda _: dynmesh.read("body.npz", prim="/a"), ValueError, "body.npz:", "prim"),
    _read("`known`: a file with too few", lambda _: dynmesh.read("body.npz", known="mask.npy"), ValueError, "mask.npy: known:", "(3, 48)"),
    _read("`known`: a file of text", lambda _: dynmesh.read("body.npz", known="text.npy"), ValueError, "text.npy:", "mask"),
    *(_open(f"`{name}={bad}`", lambda _, name=name, bad=bad: dynmesh.open("body.npz", **{name: bad}), (ValueError, TypeError), f"{name}: must be") for name in ("missing", "least_confidence") for bad in (np.nan, "nought", True)),
    *(_open(f"{name}, which is not there", lambda _, name=name: dynmesh.open(name), FileNotFoundError, name)
      for name in (f"none{'_%d' * one.is_per_frame}{one.suffixes[0]}" for one in FORMATS.values())),
    _open("a mesh that is not there", lambda _: dynmesh.open("scene.abc", prim="/no"), ValueError, "scene.abc:", "'/no'", "/mesh"),
    _write("no sequence", lambda _: dynmesh.write("new.npz", 5), TypeError, "frames:", "int"),  # type: ignore[arg-type]
    *(of("Frame")(name, lambda w, given=given: dynmesh.Frame(**given(w)), (ValueError, TypeError), *told) for name, given, *told in (
        ("positions of a plane", lambda w: {"points": w.points[:, :2]}, "points: must have shape", "(49, 2)"),
        ("no positions", lambda _: {"points": "body.npz"}, "points:", "str"),
        ("a mask that is too short", lambda w: {"points": w.points, "known": w.known[1:]}, "known: must have shape", "(48,)"),
    )),
    _write("into a file", lambda w: dynmesh.write("body.npz/new.npz", w.sequence), NotADirectoryError, "body.npz is not a folder", "body.npz/new.npz"),
    _write("over a folder", lambda w: dynmesh.write("folder.npz", w.sequence), ValueError, "folder.npz:", "folder"),
    _write("a mask that was not announced", lambda w: _written(w, dynmesh.Frame(w.points, w.known)), ValueError, "frames: frame 0:", "mask"),
    _write("provenance that is not there", lambda w: dynmesh.write("new.npz", w.sequence, provenance=True), ValueError, "provenance:", "none"),
]  # fmt: skip

_complete = of("complete")
_convert = of("convert")


def _to_new(path: Any = "body.npz", output: str = "new.npz", **options: Any) -> Any:
    return lambda _: to_file.complete(path, output, **options)


def _over(path: str, output: str, **options: Any) -> Any:
    return _to_new(path, output, overwrite=True, **options)


def _converted(**options: Any) -> Any:
    return lambda w: dynmesh.read(dynmesh.convert(w.sequence, **options))


_verbs = [
    _complete("an output that exists", _to_new(output="other.npz"), FileExistsError, "other.npz:", "overwrite"),
    _complete("the input as output", _over("body.npz", "body.npz"), ValueError, "body.npz:", "input"),
    _complete("a layer over itself", _over("scene.usda", "scene.usda"), ValueError, "scene.usda:", "input"),
    _complete("the masks of the input as output", _over("body.npz", "known.npy", source={"known": "known.npy"}), ValueError, "known.npy:", "is the input"),
    _complete("the faces of the input as output", _over("bare.npy", "single.npz", source={"faces": "single.npz"}), ValueError, "single.npz:", "is the input"),
    _complete("the frames of a folder as output", _over("walk", "walk/frame_%04d.ply"), ValueError, "frame_0000.ply:", "is the input"),
    _complete("frames among those of a glob", _over("walk/*.ply", "walk/out_%04d.ply"), ValueError, "out_%04d.ply:", "is in the folder of the input"),
    _complete("frames among those of the input", _over("walk", "walk/out_%04d.ply"), ValueError, "out_%04d.ply:", "is in the folder of the input"),
    _complete("the template as output", _over("body.npz", "single.npz", template="single.npz"), ValueError, "single.npz:", "input"),
    _complete("a training file as output", _over("body.npz", "training.npz", training="training.npz"), ValueError, "training.npz:", "input"),
    _complete("a sequence in which nothing was observed", _to_new("nothing.npz"), ValueError, "nothing.npz: frames: no vertex is known in any of them"),
    _complete("`start='whole'`", _to_new("no_whole.npz", start="whole"), ValueError, "start:", "'whole'"),
    _complete("`template` with holes", _to_new(template="holes.npz"), ValueError, "holes.npz: 1 of 49 vertices is missing"),
    _complete("`template` with other faces", _to_new(template="turned_face.npz"), ValueError, "turned_face.npz: has other faces than ", "body.npz"),
    _complete("`template` in another unit", _to_new("in_metres.npz", template="in_millimetres.npz"), ValueError, "in_millimetres.npz: its unit in metres is 0.001, but 1"),
    *(_complete(f"`{name}` with method motion, before any file", lambda _, option=option: dynmesh.complete("none.npz", method="motion", **option), SettingError, f"{name}: is for method detail")
      for option in ({"bidirectional": True}, {"drop_above": 1.0}, {"training": "t.npz"}) for name in option),
    _complete("`gaps` of a single file", _to_new(source={"gaps": "lost"}), ValueError, "body.npz: gaps"),
    _complete("`training`: an empty list", _to_new(training=[]), ValueError, "training:", "no file"),
    _complete("training with fewer vertices", _to_new(training="fewer.npz"), ValueError, "fewer.npz:", "7", "body.npz has 49"),
    _complete("training with a hole in frame 1", _to_new(training="late_holes.npz"), ValueError, "late_holes.npz: frame 1:", "vertex 4", "whole"),
    _complete("training that states another up axis", _to_new("z_up.npz", training="y_up.npz"), ValueError, "y_up.npz:", "up axis", "z"),
    _complete("training in another unit by its size", _to_new(training="big.npz"), ValueError, "big.npz: training: its size", "unit"),
    _complete("training without the mesh of that path", _to_new("scene.usda", training="two.usda"), ValueError, "two.usda:", "'/mesh'", "/one, /two"),
    _convert("`frames`: none of them", _converted(frames=range(1, 1)), ValueError, "frames:", "not 1:1"),
    _convert("`up='w'`", _converted(up="w"), ValueError, "up:", "'w'"),
    _convert("`to_up` of an unknown axis", _converted(to_up="y"), ValueError, "to_up:", "states no up axis"),
    _convert("`fps`: NaN", _converted(fps=float("nan")), ValueError, "fps:", "not nan"),
    _convert("a file in another unit", lambda _: to_file.convert("in_metres.npz", "new.npz", unit="mm"), ValueError, "in_metres.npz: unit: the file states units of 1 m, not 0.001 m"),
    _convert("a file with another up axis", lambda _: to_file.convert("z_up.npz", "new.npz", up="y"), ValueError, "z_up.npz: up:", "z, not y"),
]  # fmt: skip


def _track(scans: str, template: str = "template.npz", **options: Any) -> Callable[[World], Any]:
    options = {"output": "new.npz", **options}
    return lambda _: to_file.track(scans, template=template, **options)


def _cloud(name: str, given: str, *names: str) -> Case:
    case = of("scans.read_points")
    return case(given, lambda _: read_points(Path(name)), ValueError, f"{name}:", *names)


def _cameras(name: str, given: str, *names: str) -> Case:
    file = f"rig_{name}.json"
    case = of("scans.read_cameras")
    return case(given, lambda _: read_cameras(Path(file)), ValueError, f"{file}:", *names)


def _scans(name: str, given: str, *names: str, rig: str | None = None) -> Case:
    run = lambda _: list(open_scans(name, cameras=rig))  # noqa: E731
    return Case("scans.open_scans", given, run, (ValueError, FileNotFoundError), names)


_tracked = of("track")

_of_scans = [
    *(_cloud(f"cloud_{n}.xyz", given, *names) for n, (given, (_, names)) in enumerate(_CLOUDS.items())),
    _cloud("partly.ply", "one coordinate is NaN", "point 0:", "(nan, 2, 3)"),
    *(_cameras(str(n), given, *names) for n, (given, (_, names)) in enumerate(_CAMERAS.items())),
    *(_cameras(name, name, told) for name, (_, told) in _RIGS.items()),
    _scans("nothing", "an empty folder", "nothing:", ".xyz"),
    _scans("image", "depth images without cameras", "image:", "cameras"),
    _scans("unnumbered", "no number in a name", "depth_left.png:", "number", rig="rig.json"),
    _scans("empty_image", "an empty image", "depth_00000_left.png:", "empty", rig="rig.json"),
    _scans("both_damaged", "every image is damaged", "depth_00001_left.png:", "cut or damaged", "no undamaged image", rig="rig.json"),
    _scans("two_numbers", "two images of one frame and camera", "same number", "camera", rig="rig.json"),
    _scans("image", "no image of a camera", "image:", "'right'", rig="rig_two.json"),
    _scans("dropped", "an image is missing", "dropped:", "'right'", "frame 1", rig="rig_two.json"),
    _scans("kinds", "scans of two kinds", "kinds:", ".ply and .xyz"),
    _tracked("scans that are not there", _track("nowhere"), OSError, "No such file", "nowhere"),
    _tracked("no scan has points", _track("blank"), ValueError, "blank:", "no frame has several points"),
    _tracked("the template is elsewhere", _track("far"), ValueError, "template.npz:", "mean edges", "e+03 times as large"),
    _tracked("the template has another shape", _track("line"), ValueError, "template.npz:", "rigid motion"),
    _tracked("a unit of the scans alone", _track("cloud", scan_unit="mm"), ValueError, "template.npz:", "states no unit"),
    _tracked("a file states a unit, the template none", _track("in_mm"), ValueError, "template.npz:", "0.001 m"),
    _tracked("scans in millimetres, said to be metres", _track("cloud", "template_m.npz", scan_unit="mm"), ValueError, "template_m.npz:", "times as large", "its diagonal is"),
    _tracked("`crop`: the corners are exchanged", _track("cloud", crop=(0, 0, 1, 1, 1, 0)), ValueError, "crop:", "smaller"),
    _tracked("`crop`: nothing is left of the first scan", _track("cloud", crop=(90, 90, 90, 91, 91, 91)), ValueError, "cloud:", "nothing is left"),
    _tracked("the template has a missing vertex", _track("cloud", "holes.npz"), ValueError, "holes.npz:", "vertex 4"),
    _tracked("the output is the template", _track("cloud", output="template.npz", overwrite=True), ValueError, "template.npz:", "input"),
]  # fmt: skip

cases = [*_sequences, *_reading_and_writing, *_verbs, *_of_scans]
