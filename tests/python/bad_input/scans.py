"""Cases of scans: those that are simulated, their files, and tracking from files."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from scan_files import saved

import dynmesh
from dynmesh import degrade
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

from .case import Case, World
from .commands import misused, refused
from .functions import of

_NAN = float("nan")
_POSE = np.diag([1.0, -1, -1, 1])
_CAMERA = ScanCamera("left", _POSE, np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]]), 0.001)

_CAMERAS: dict[str, Callable[[dict[str, Any]], Any]] = {
    "skew": lambda c: c["camera_to_world"][0].__setitem__(0, 1.1),
    "mirrored": lambda c: c["camera_to_world"][0].__setitem__(0, -1.0),
    "last_row": lambda c: c["camera_to_world"][3].__setitem__(0, 1),
    "huge": lambda c: c["camera_to_world"][0].__setitem__(3, 10**400),
    "nan": lambda c: c["intrinsics"][0].__setitem__(2, _NAN),
    "no_focus": lambda c: c["intrinsics"][1].__setitem__(1, 0),
    "projective": lambda c: c["intrinsics"][2].__setitem__(0, 0.1),
    "unknown": lambda c: c.update(lens="wide"),
    "distorted": lambda c: c.update(distortion=[0.1, 0, 0], width=640, height=480),
    "skewed": lambda c: (
        c.update(distortion=[0.1, 0, 0, 0], width=640, height=480),
        c["intrinsics"][0].__setitem__(1, 2),
    ),
    "no_scale": lambda c: c.update(depth_scale=None),
    "unsized": lambda c: c.update(distortion=[0.1, 0, 0, 0]),
    "odd_name": lambda c: c.update(name="left/1"),
}
"""What is wrong with a file of cameras, by its name."""


def prepare(world: World) -> None:
    """Creates scans and cameras, in addition to the files of other modules."""
    folder = world.folder
    points = world.vertices.astype(np.float32)
    for name, found, unit in (
        ("cloud", points, None),
        ("far", points * 1000, None),
        ("line", points * [9.0, 0, 0] + [90, 0, 0], None),
        ("blank", points[:0], None),
        ("in_mm", points, 0.001),
    ):
        (folder / name).mkdir()
        write_ply(folder / name / "s_0000.ply", PointScan(found, None, None), unit)
    write_ply(folder / "partly.ply", PointScan(np.array([[_NAN, 2, 3]]), None, None))
    for name, text in {
        "words": "1 2 3\n4 five 6\n",
        "short": "1 2 3\n4 5\n",
        "mixed": "1 2 3\n1 2 3 0 0 1\n",
        "grouped": "1_0 2 3\n",
        "infinite": "1 2 3\n\n1 inf 3\n",
        "partly": "nan 2 3\n",
        "colours": "# with colours\n1 2 3 255 128 0\n",
    }.items():
        (folder / f"{name}.xyz").write_text(text)
    for name, text in {
        "text": "{",
        "none": "[]",
        "bare": '[{"vertex": 3}]',
        "half": '[{"vertex": 0.5, "position": [1, 2, 3]}]',
        "flat": '[{"vertex": 5, "position": [1, 2]}]',
        "far": '[{"vertex": 577, "position": [1, 2, 3]}]',
    }.items():
        (folder / f"marks_{name}.json").write_text(text)
    write_cameras(folder / "rig.json", Rig((_CAMERA,)))
    told = json.loads((folder / "rig.json").read_text())
    for name, spoil in _CAMERAS.items():
        spoilt = json.loads(json.dumps(told))
        spoil(spoilt["cameras"][0])
        (folder / f"rig_{name}.json").write_text(json.dumps(spoilt))
    for name, changed in {
        "unit": told | {"unit": "furlong"},
        "twice": told | {"cameras": told["cameras"] * 2},
        "two": told | {"cameras": [told["cameras"][0], told["cameras"][0] | {"name": "right"}]},
        "other_field": told | {"scale": 1},
    }.items():
        (folder / f"rig_{name}.json").write_text(json.dumps(changed))
    (folder / "rig_cut.json").write_text('{"unit": "m",\n "cameras": [')
    (folder / "rig_deep.json").write_text("[" * 100_000)
    (folder / "rig_bytes.json").write_bytes(b'{"unit": "\xff"}')
    (folder / "image").mkdir()
    (folder / "image" / "depth_00000_left.png").write_bytes(b"no image")
    _write_images(folder)
    (folder / "unnumbered").mkdir()
    (folder / "unnumbered" / "depth_left.png").write_bytes(b"no image")
    (folder / "nothing").mkdir()
    single = world.sequence[:1]
    dynmesh.write(folder / "template.npz", single)
    dynmesh.write(folder / "template_m.npz", replace(single, metres_per_unit=1.0))
    holed = replace(single, vertices=single.vertices.copy())
    holed.vertices[0, 4, 1] = _NAN
    dynmesh.write(folder / "template_holed.npz", holed)


def _write_images(folder: Path) -> None:
    """Writes folders of depth images with one fault each."""
    grey = saved(Image.fromarray(np.full((3, 4), 900, np.uint16)))
    for name, images in {
        "empty_image": {"00000_left": b""},
        "both_damaged": {"00000_left": grey[:50], "00001_left": grey[:70]},
        "two_numbers": {"00000_left": grey, "0_left": grey},
        "dropped": dict.fromkeys(["00000_left", "00000_right", "00001_left"], grey),
    }.items():
        (folder / name).mkdir()
        for image, content in images.items():
            (folder / name / f"depth_{image}.png").write_bytes(content)
    (folder / "kinds").mkdir()
    (folder / "kinds" / "a_0.xyz").write_text("1 2 3\n")
    write_ply(folder / "kinds" / "a_1.ply", PointScan(np.zeros((1, 3)), None, None))


def _scan(**options: Any) -> Callable[[World], Any]:
    def run(world: World) -> Any:
        given = {"frames": [world.vertices], "faces": world.faces, **options}
        return list(degrade.scan_points(**given))

    return run


def _image(**options: Any) -> Callable[[World], Any]:
    return lambda w: list(degrade.depth_images([w.vertices], w.faces, **options))


def _track(scans: str, template: str = "template.npz", **options: Any) -> Callable[[World], Any]:
    options = {"output": "new.npz", **options}
    return lambda _: dynmesh.track_file(scans, template=template, **options)


_points = of("degrade.scan_points")
_depth = of("degrade.depth_images")
_read = of("scans.read_points")
_rig = of("scans.read_cameras")
_open = of("scans.open_scans")
_file = of("track_file")


def _cloud(name: str, given: str, *names: str) -> Case:
    return _read(given, lambda _: read_points(Path(name)), ValueError, f"{name}:", *names)


def _cameras(name: str, given: str, *names: str) -> Case:
    file = f"rig_{name}.json"
    return _rig(given, lambda _: read_cameras(Path(file)), ValueError, f"{file}:", *names)


_REGISTER = "register template.npz cloud/s_0000.ply new.obj"
_MARKS = f"{_REGISTER} --landmarks"

cases = [
    refused("register template.npz cloud/s_0000.ply template.npz --overwrite", "template.npz: is the input"),
    refused("register cloud/s_0000.ply template.npz new.obj", "s_0000.ply: holds points without faces", "before the scan"),
    refused("register template.npz body.obj body.obj --overwrite", "body.obj: is the input"),
    refused("register template.npz body.obj other.npz", "other.npz: exists already"),
    refused(f"{_REGISTER} --page done.html", "done.html: exists"),
    refused(f"{_REGISTER} --page new.htm", "must end in .html"),
    refused("register template.npz cloud/s_0000.ply new.txt --landmarks marks_text.json", "new.txt: cannot write format '.txt'"),
    misused(f"{_REGISTER} --crop 0.5", "crop:", "two corners of a box", "0.5"),
    refused(f"{_REGISTER} --crop 70,70,70,80,80,80", "cloud/s_0000.ply:", "nothing is left"),
    misused(f"{_REGISTER} --scale --remove-planes", "--remove-planes:", "scale"),
    refused("register template.npz rig.json new.obj", "rig.json: unknown format '.json'", ".xyz", ".obj"),
    refused("register template.npz cloud new.obj", "cloud: is a folder"),
    refused("register template.npz cloud/s_0000.ply new", "new: has no suffix", "name the format"),
    refused(f"{_MARKS} marks_text.json", "marks_text.json:", "is not JSON"),
    refused(f"{_MARKS} marks_none.json", "marks_none.json:", "at least one"),
    refused(f"{_MARKS} marks_bare.json", "marks_bare.json:", "landmark 0: must have"),
    refused(f"{_MARKS} marks_half.json", "marks_half.json:", "landmark 0: vertex:"),
    refused(f"{_MARKS} marks_flat.json", "marks_flat.json:", "landmark 0: position:"),
    refused(f"{_MARKS} marks_far.json", "vertex 577"),
    _points("`points`: 0", _scan(points=0), ValueError, "points:", "not 0"),
    _points("`points`: 1.5", _scan(points=1.5), TypeError, "points:", "1.5"),
    _points("`cameras`: 0", _scan(cameras=0), ValueError, "cameras:", "not 0"),
    _points("`cameras`: none", _scan(cameras=[]), ValueError, "cameras:", "at least one"),
    _points("`cameras`: a name", _scan(cameras=["left"]), TypeError, "cameras:", "'left'"),
    _points("`noise`: NaN", _scan(noise=_NAN), ValueError, "noise:", "nan"),
    _points("`missing`: 1", _scan(missing=1), ValueError, "missing:", "not 1"),
    _points("a frame is not finite", lambda w: _scan(frames=[w.with_value(_NAN)])(w), ValueError, "frame 0:", "vertex 4"),
    _points("a frame has another shape", lambda w: _scan(frames=[w.vertices, w.points[:9]])(w), ValueError, "frame 1:", "(9, 3)"),
    _depth("`width`: 0", _image(width=0), ValueError, "width:", "not 0"),
    _cloud("words.xyz", "a word", "line 2:", "'five'"),
    _cloud("short.xyz", "two coordinates", "line 2:", "2 words"),
    _cloud("mixed.xyz", "normals in some lines", "line 2:", "6 numbers", "line 1 has 3"),
    _cloud("grouped.xyz", "digits in groups", "line 1:", "'1_0'"),
    _cloud("infinite.xyz", "an infinite coordinate", "line 3:", "(1, inf, 3)"),
    _cloud("partly.xyz", "one coordinate is NaN", "line 1:", "(nan, 2, 3)"),
    _cloud("partly.ply", "one coordinate is NaN", "point 0:", "(nan, 2, 3)"),
    _cloud("colours.xyz", "colours instead of normals", "line 2:", "(255, 128, 0)", "length 1"),
    _cloud("body.obj", "another format", "'.obj'", ".xyz"),
    _cameras("skew", "a pose that is no rotation", "camera 0: camera_to_world:", "0.21"),
    _cameras("mirrored", "a pose that mirrors", "camera 0: camera_to_world:", "mirrors"),
    _cameras("last_row", "a pose whose last row is another", "camera_to_world:", "1 0 0 1"),
    _cameras("huge", "a number that is too large", "camera_to_world: row 0:", "finite, not 1000"),
    _cameras("nan", "NaN", "intrinsics: row 0:", "nan"),
    _cameras("no_focus", "a focal length of 0", "intrinsics:", "0 0 "),
    _cameras("projective", "intrinsics whose last row is another", "intrinsics:", "0.1 0 1"),
    _cameras("unknown", "an unknown field", "'lens'", "intrinsics"),
    _cameras("distorted", "a distortion of three numbers", "camera 0: distortion:", "[0.1, 0, 0]"),
    _cameras("skewed", "a distortion and a skew", "intrinsics:", "skew"),
    _cameras("no_scale", "a depth of null", "camera 0: depth_scale:", "None"),
    _cameras("unsized", "a distortion without the size of the images", "width:", "distortion"),
    _cameras("odd_name", "a name with a slash", "name:", "'left/1'"),
    _cameras("unit", "an unknown unit", "unit:", "'furlong'"),
    _cameras("twice", "two cameras of one name", "camera 1: name:", "'left'"),
    _cameras("other_field", "an unknown field beside the cameras", "'scale'"),
    _cameras("cut", "it is cut", "line 2 column 14"),
    _cameras("deep", "a hundred thousand brackets", "recursion"),
    _cameras("bytes", "no text", "position 10", "utf-8"),
    _open("an empty folder", lambda _: open_scans("nothing"), ValueError, "nothing:", ".xyz"),
    _open("nothing there", lambda _: open_scans("none_%04d.ply"), FileNotFoundError, "none_%04d.ply"),
    _open("another format", lambda _: open_scans("body.obj"), ValueError, "body.obj:", "'.obj'"),
    _open("depth images without cameras", lambda _: open_scans("image"), ValueError, "image:", "cameras"),
    _open("no number in a name", lambda _: open_scans("unnumbered", cameras="rig.json"), ValueError, "depth_left.png:", "number"),
    _open("an empty image", lambda _: list(open_scans("empty_image", cameras="rig.json")), ValueError, "depth_00000_left.png:", "empty"),
    _open("every image is damaged", lambda _: list(open_scans("both_damaged", cameras="rig.json")), ValueError, "depth_00001_left.png:", "cut or damaged", "no undamaged image"),
    _open("two images of one frame and camera", lambda _: open_scans("two_numbers", cameras="rig.json"), ValueError, "same number", "camera"),
    _open("no image of a camera", lambda _: open_scans("image", cameras="rig_two.json"), ValueError, "image:", "'right'"),
    _open("an image is missing", lambda _: open_scans("dropped", cameras="rig_two.json"), ValueError, "dropped:", "'right'", "frame 1"),
    _open("scans of two kinds", lambda _: open_scans("kinds"), ValueError, "kinds:", ".ply and .xyz"),
    _file("scans that are not there", _track("nowhere"), ValueError, "nowhere:", "does not exist"),
    _file("no scan has points", _track("blank"), ValueError, "blank:", "no frame has points"),
    _file("the template is elsewhere", _track("far"), ValueError, "template.npz:", "mean edges", "1e+03 times as large", "the template were in m and the scan in mm"),
    _file("the template has another shape", _track("line"), ValueError, "template.npz:", "rigid motion"),
    _file("a unit of the scans alone", _track("cloud", scan_unit="mm"), ValueError, "template.npz:", "states no unit"),
    _file("a file states a unit, the template none", _track("in_mm"), ValueError, "template.npz:", "0.001 m"),
    _file("`scan_unit`: furlong", _track("cloud", scan_unit="furlong"), ValueError, "scan_unit:", "'furlong'"),
    _file("scans in millimetres, said to be metres", _track("cloud", "template_m.npz", scan_unit="mm"), ValueError, "template_m.npz:", "0.001 times as large"),
    _file("`crop`: -1", _track("cloud", crop=-1), ValueError, "crop:", "-1"),
    _file("`crop`: two numbers", _track("cloud", crop=(1, 2)), ValueError, "crop:", "two corners", "(1, 2)"),
    _file("`crop`: the corners of the box are exchanged", _track("cloud", crop=(0, 0, 1, 1, 1, 0)), ValueError, "crop:", "smaller"),
    _file("`crop`: nothing is left of the first scan", _track("cloud", crop=(90, 90, 90, 91, 91, 91)), ValueError, "cloud:", "nothing is left"),
    _file("`remove_planes`: a word", _track("cloud", remove_planes="yes"), TypeError, "remove_planes:", "yes"),
    misused("track cloud new.npz --template template.npz --crop wide", "--crop", "wide"),
    refused("rig cloud --template template.npz", "cloud:", "point clouds"),
    misused("rig dropped", "--template"),
    misused("rig dropped --page new.html -o new.json", "--template"),
    refused("view template_m.npz --scans in_mm --scan-unit cm -o new.html", "in_mm:", "--scan-unit:", "0.001", "0.01"),
    _file("`recover`: a number", _track("cloud", recover=2), TypeError, "recover:", "2"),
    _file("a training file as output", _track("cloud", training="training.npz", output="training.npz", overwrite=True), ValueError, "training.npz:", "input"),
    _file("the template has a missing vertex", _track("cloud", "template_holed.npz"), ValueError, "template_holed.npz:", "vertex 4"),
    _file("no template", _track("cloud", "none.npz"), FileNotFoundError, "none.npz"),
    _file("the output is the template", _track("cloud", output="template.npz", overwrite=True), ValueError, "template.npz:", "input"),
    misused("track cloud new.npz", "--template"),
    misused("track cloud new.npz --template template.npz --scan-unit furlong", "--scan-unit", "'furlong'"),
    misused("degrade body.npz new --scan --depth 64x48", "--scan:", "depth images"),
    misused("degrade body.npz new --depth 64", "--depth", "64"),
    misused("degrade body.npz new --scan --camera 1", "--camera:", "scans"),
    misused("degrade body.npz new --scan --noise -1", "--noise", "-1"),
    refused("degrade body.npz cloud --scan --up z", "s_0000.ply", "exists already"),
]  # fmt: skip
