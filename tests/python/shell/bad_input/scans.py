"""Cases of scans: those that are simulated, their files, and tracking from files."""

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
from dynmesh import losses
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

_POSE = np.diag([1.0, -1, -1, 1])
_CAMERA = ScanCamera("left", _POSE, np.array([[500.0, 0, 320], [0, 500, 240], [0, 0, 1]]), 0.001)


def _entry(field: str, row: int, column: int, value: Any) -> Callable[[Any], Any]:
    return lambda told: told["cameras"][0][field][row].__setitem__(column, value)


def _field(**changed: Any) -> Callable[[Any], Any]:
    return lambda told: told["cameras"][0].update(changed)


_SIZE = {"width": 640, "height": 480}
_SKEWED = [[500, 2, 320], [0, 500, 240], [0, 0, 1]]
_CAMERAS: dict[str, tuple[Callable[[Any], Any], tuple[str, ...]]] = {
    "a pose that is no rotation": (_entry("camera_to_world", 0, 0, 1.1), ("camera 0: camera_to_world:", "0.21")),
    "a pose that mirrors": (_entry("camera_to_world", 0, 0, -1.0), ("camera 0: camera_to_world:", "mirrors")),
    "a pose whose last row is another": (_entry("camera_to_world", 3, 0, 1), ("camera_to_world:", "1 0 0 1")),
    "a number that is too large": (_entry("camera_to_world", 0, 3, 10**400), ("camera_to_world: row 0:", "finite, not 1000")),
    "NaN": (_entry("intrinsics", 0, 2, np.nan), ("intrinsics: row 0:", "nan")),
    "a focal length of 0": (_entry("intrinsics", 1, 1, 0), ("intrinsics:", "0 0 ")),
    "intrinsics whose last row is another": (_entry("intrinsics", 2, 0, 0.1), ("intrinsics:", "0.1 0 1")),
    "an unknown field": (_field(lens="wide"), ("'lens'", "intrinsics")),
    "a distortion of three numbers": (_field(distortion=[0.1, 0, 0], **_SIZE), ("camera 0: distortion:", "[0.1, 0, 0]")),
    "a distortion and a skew": (_field(distortion=[0.1, 0, 0, 0], intrinsics=_SKEWED, **_SIZE), ("intrinsics:", "skew")),
    "a depth of null": (_field(depth_scale=None), ("camera 0: depth_scale:", "None")),
    "a distortion without the size of the images": (_field(distortion=[0.1, 0, 0, 0]), ("width:", "distortion")),
    "a name with a slash": (_field(name="left/1"), ("name:", "'left/1'")),
    "an unknown unit": (lambda told: told.update(unit="furlong"), ("unit:", "'furlong'")),
    "two cameras of one name": (lambda told: told["cameras"].append(told["cameras"][0]), ("camera 1: name:", "'left'")),
    "an unknown field beside the cameras": (lambda told: told.update(scale=1), ("'scale'",)),
}  # fmt: skip
"""What is changed in a file of cameras, and what is said of it."""
_CLOUDS: dict[str, tuple[str, tuple[str, ...]]] = {
    "a word": ("1 2 3\n4 five 6\n", ("line 2:", "'five'")),
    "two coordinates": ("1 2 3\n4 5\n", ("line 2:", "2 words")),
    "normals in some lines": ("1 2 3\n1 2 3 0 0 1\n", ("line 2:", "6 numbers", "line 1 has 3")),
    "digits in groups": ("1_0 2 3\n", ("line 1:", "'1_0'")),
    "an infinite coordinate": ("1 2 3\n\n1 inf 3\n", ("line 3:", "(1, inf, 3)")),
    "one coordinate is NaN": ("nan 2 3\n", ("line 1:", "(nan, 2, 3)")),
    "colours": ("# with colours\n1 2 3 255 128 0\n", ("line 2:", "(255, 128, 0)", "colour")),
}
"""What is in a file of points, and what is said of it."""
_LANDMARKS = {
    "{": "is not JSON",
    "[]": "at least one",
    '[{"vertex": 3}]': "landmark 0: must have",
    '[{"vertex": 0.5, "position": [1, 2, 3]}]': "landmark 0: vertex:",
    '[{"vertex": 5, "position": [1, 2]}]': "landmark 0: position:",
    '[{"vertex": 577, "position": [1, 2, 3]}]': "vertex 577",
}
"""What is in a file of landmarks, and what is said of it."""


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
    write_ply(folder / "partly.ply", PointScan(np.array([[np.nan, 2, 3]]), None, None))
    for number, (text, _) in enumerate(_CLOUDS.values()):
        (folder / f"cloud_{number}.xyz").write_text(text)
    for number, text in enumerate(_LANDMARKS):
        (folder / f"marks_{number}.json").write_text(text)
    write_cameras(folder / "rig.json", Rig((_CAMERA,)))
    for number, (spoil, _) in enumerate(_CAMERAS.values()):
        told = json.loads((folder / "rig.json").read_text())
        spoil(told)
        (folder / f"rig_{number}.json").write_text(json.dumps(told))
    write_cameras(folder / "rig_two.json", Rig((_CAMERA, replace(_CAMERA, name="right"))))
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
    holed.vertices[0, 4, 1] = np.nan
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
        return list(losses.scan_points(**given))

    return run


def _image(**options: Any) -> Callable[[World], Any]:
    return lambda w: list(losses.depth_images([w.vertices], w.faces, **options))


def _track(scans: str, template: str = "template.npz", **options: Any) -> Callable[[World], Any]:
    options = {"output": "new.npz", **options}
    return lambda _: to_file.track(scans, template=template, **options)


_points = of("losses.scan_points")
_depth = of("losses.depth_images")
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
    misused(f"{_REGISTER} --page new.htm", "must end in .html"),
    refused("register template.npz cloud/s_0000.ply new.txt --landmarks marks_0.json", "new.txt: cannot write format '.txt'"),
    misused(f"{_REGISTER} --crop 0.5", "crop:", "two corners of a box", "0.5"),
    refused(f"{_REGISTER} --crop 70,70,70,80,80,80", "cloud/s_0000.ply:", "nothing is left"),
    misused(f"{_REGISTER} --scale --remove-planes", "--remove-planes:", "scale"),
    refused("register template.npz rig.json new.obj", "rig.json: unknown format '.json'", ".xyz", ".obj"),
    refused("register template.npz cloud new.obj", "cloud: is a folder"),
    refused("register template.npz cloud/s_0000.ply new", "new: has no suffix", "name the format"),
    *(refused(f"{_MARKS} marks_{n}.json", f"marks_{n}.json:", said) for n, said in enumerate(_LANDMARKS.values())),
    _points("`points`: 0", _scan(points=0), ValueError, "points:", "not 0"),
    _points("`points`: 1.5", _scan(points=1.5), TypeError, "points:", "1.5"),
    _points("`cameras`: 0", _scan(cameras=0), ValueError, "cameras:", "not 0"),
    _points("`cameras`: none", _scan(cameras=[]), ValueError, "cameras:", "at least one"),
    _points("`cameras`: a name", _scan(cameras=["left"]), TypeError, "cameras:", "'left'"),
    _points("`noise`: NaN", _scan(noise=np.nan), ValueError, "noise:", "nan"),
    _points("`missing`: 1", _scan(missing=1), ValueError, "missing:", "not 1"),
    _points("a frame is not finite", lambda w: _scan(frames=[w.with_value(np.nan)])(w), ValueError, "frame 0:", "vertex 4"),
    _points("a frame has another shape", lambda w: _scan(frames=[w.vertices, w.points[:9]])(w), ValueError, "frame 1:", "(9, 3)"),
    _depth("`width`: 0", _image(width=0), ValueError, "width:", "not 0"),
    *(_cloud(f"cloud_{n}.xyz", given, *names) for n, (given, (_, names)) in enumerate(_CLOUDS.items())),
    _cloud("partly.ply", "one coordinate is NaN", "point 0:", "(nan, 2, 3)"),
    _cloud("body.obj", "another format", "'.obj'", ".xyz"),
    *(_cameras(str(n), given, *names) for n, (given, (_, names)) in enumerate(_CAMERAS.items())),
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
    _file("scans that are not there", _track("nowhere"), OSError, "No such file", "nowhere"),
    _file("no scan has points", _track("blank"), ValueError, "blank:", "no frame has points"),
    _file("the template is elsewhere", _track("far"), ValueError, "template.npz:", "mean edges", "e+03 times as large"),
    _file("the template has another shape", _track("line"), ValueError, "template.npz:", "rigid motion"),
    _file("a unit of the scans alone", _track("cloud", scan_unit="mm"), ValueError, "template.npz:", "states no unit"),
    _file("a file states a unit, the template none", _track("in_mm"), ValueError, "template.npz:", "0.001 m"),
    _file("`scan_unit`: furlong", _track("cloud", scan_unit="furlong"), ValueError, "scan_unit:", "'furlong'"),
    _file("scans in millimetres, said to be metres", _track("cloud", "template_m.npz", scan_unit="mm"), ValueError, "template_m.npz:", "times as large", "its diagonal is"),
    _file("`crop`: -1", _track("cloud", crop=-1), ValueError, "crop:", "-1"),
    _file("`crop`: two numbers", _track("cloud", crop=(1, 2)), ValueError, "crop:", "two corners", "(1, 2)"),
    _file("`crop`: the corners of the box are exchanged", _track("cloud", crop=(0, 0, 1, 1, 1, 0)), ValueError, "crop:", "smaller"),
    _file("`crop`: nothing is left of the first scan", _track("cloud", crop=(90, 90, 90, 91, 91, 91)), ValueError, "cloud:", "nothing is left"),
    _file("`remove_planes`: a word", _track("cloud", remove_planes="yes"), TypeError, "remove_planes:", "yes"),
    misused("track cloud new.npz --template template.npz --crop wide", "--crop", "wide"),
    refused("rig cloud --template template.npz", "cloud:", "point clouds"),
    misused("rig dropped --page new.html --crop 0.5", "--crop: needs a --template"),
    misused("rig dropped --page new.html --remove-planes", "--remove-planes: needs a --template"),
    misused("view template_m.npz --scans in_mm --scan-unit cm -o new.html", "in_mm:", "--scan-unit:", "0.001", "0.01"),
    _file("`recover`: a number", _track("cloud", recover=2), TypeError, "recover:", "2"),
    _file("a training file as output", _track("cloud", training="training.npz", output="training.npz", overwrite=True), ValueError, "training.npz:", "input"),
    _file("the template has a missing vertex", _track("cloud", "template_holed.npz"), ValueError, "template_holed.npz:", "vertex 4"),
    _file("no template", _track("cloud", "none.npz"), FileNotFoundError, "none.npz"),
    _file("the output is the template", _track("cloud", output="template.npz", overwrite=True), ValueError, "template.npz:", "input"),
    misused("track cloud new.npz", "--template"),
    misused("degrade body.npz new --scan --depth 64x48", "--scan:", "depth images"),
    misused("degrade body.npz new --depth 64", "--depth", "64"),
    misused("degrade body.npz new --scan --camera 1", "--camera:", "scans"),
    refused("degrade body.npz new.npz --scan", "new.npz: scans are written to a folder", ".npz"),
    refused("degrade body.npz f_%04d.ply --scan", "f_%04d.ply: scans are written to a folder"),
    refused("degrade body.npz cloud --scan --up z", "s_0000.ply", "exists already"),
]  # fmt: skip
