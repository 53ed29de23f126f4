"""What can be said about scans, cameras and template, for tracking and for `dynmesh rig`."""

import re
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Self, get_args

import numpy as np

from .._checks import check_path, check_positive
from .._errors import InputError, KindError
from ..diagnosis.rig_reading import Reading, Turns, Units
from ..files import PathLike
from ..files.format import Gaps
from ..files.scans import Corrections, ScanReader, given_unit, open_scans, unit_of_scans
from ..files.scans.cameras import Matrices
from ..files.scans.corrections import Axes, Poses
from .option import FILES, SOURCE, UNIT_NAMES, given, offered, unit_of
from .room import Crop, Room, crop_of

CAMERAS, TEMPLATE, ROOM = "Cameras", "Template", "Rooms"


def swap_of(value: Any) -> tuple[str, str]:
    """Returns the names of two cameras of text such as "left,right", or of a pair.

    Raises:
        TypeError, ValueError: these are not two names.
    """
    pair = value.split(",") if isinstance(value, str) else value
    if not isinstance(pair, tuple | list) or not all(isinstance(name, str) for name in pair):
        raise KindError(f"must be two names, not {value!r}", argument="swap_cameras")
    if len(pair) != 2 or pair[0] == pair[1]:
        raise InputError(f"must be two names, A,B, not {value!r}", argument="swap_cameras")
    return pair[0], pair[1]


def size_of(value: Any) -> tuple[int, int]:
    """Returns the size of an image of text such as "640x480", or of a pair.

    Raises:
        TypeError, ValueError: this is no size.
    """
    if isinstance(value, str):
        found = re.fullmatch("([1-9][0-9]{0,4})x([1-9][0-9]{0,4})", value)
        value = value if found is None else (int(found[1]), int(found[2]))
    is_pair = isinstance(value, tuple | list) and len(value) == 2
    if not is_pair or not all(isinstance(n, int) and n > 0 for n in value):
        raise InputError(
            f"must be width x height, such as 640x480, not {value!r}", argument="intrinsics_size"
        )
    return value[0], value[1]


def turns_of(value: Any) -> Turns:
    """Returns the turns of text such as "x:-90,y:180", or of pairs of axis and degrees.

    Raises:
        TypeError, ValueError: these are no turns.
    """
    pairs = (
        [part.partition(":")[::2] for part in value.split(",")] if isinstance(value, str) else value
    )
    made = []
    try:
        for axis, degrees in pairs:
            made.append((axis, float(degrees)))
    except (TypeError, ValueError):
        made = []
    if not made or not all(axis in ("x", "y", "z") and np.isfinite(d) for axis, d in made):
        raise InputError(
            f"must be an axis and degrees, such as y:180 or x:-90,y:180, not {value!r}",
            argument="turn_template",
        )
    return tuple(made)


@dataclass(frozen=True, kw_only=True)
class RigOptions:
    """What can be said about a rig; :func:`dynmesh.track_file` explains the options."""

    cameras: PathLike | None = given(
        None,
        "Poses and intrinsics of the cameras, required for depth images. [cameras.json beside "
        "SCANS]",
        FILES,
        Path,
        metavar="FILE",
    )
    scan_unit: str | float | None = given(
        None,
        f"Unit of length of SCANS: {UNIT_NAMES}. [as their files state, else as the mesh]",
        FILES,
        metavar="UNIT",
        parse=unit_of,
    )
    template_unit: str | float | None = given(
        None,
        f"Unit of length of the template: {UNIT_NAMES}. [as its file states]",
        FILES,
        metavar="UNIT",
        parse=unit_of,
    )
    gaps: Gaps = offered(SOURCE["gaps"])
    poses: Poses = given(
        "camera-to-world",
        "What the matrices of the poses do.",
        CAMERAS,
        metavar="|".join(get_args(Poses)),
        choices=get_args(Poses),
    )
    axes: Axes = given(
        "opencv",
        "Axes of the cameras: x right, y down, z ahead; or x right, y up, z back.",
        CAMERAS,
        metavar="|".join(get_args(Axes)),
        choices=get_args(Axes),
    )
    matrices: Matrices = given(
        "rows",
        "How matrices are listed; of poses, their rotation alone may be transposed.",
        CAMERAS,
        metavar="|".join(get_args(Matrices)),
        choices=get_args(Matrices),
    )
    swap_cameras: tuple[str, str] | None = given(
        None,
        "Each of these cameras has the images of the other.",
        CAMERAS,
        metavar="A,B",
        parse=swap_of,
    )
    depth_scale: float | None = given(
        None,
        "The depth of one count, in the unit of SCANS. [as in the file of the cameras]",
        CAMERAS,
        float,
        metavar="LENGTH",
    )
    intrinsics_size: tuple[int, int] | None = given(
        None,
        "Size of the images that the intrinsics are for. [that of the images]",
        CAMERAS,
        metavar="WxH",
        parse=size_of,
    )
    turn_template: Turns | None = given(
        None,
        "Turn the template by these degrees, about axes through its middle, such as y:180.",
        TEMPLATE,
        metavar="AXIS:DEGREES,...",
        parse=turns_of,
    )
    crop: Crop | None = given(
        None,
        "Leave out points farther than this from the box of the mesh in the last frame, or outside "
        "the box X,Y,Z,X,Y,Z, in the unit of the template.",
        ROOM,
        metavar="DISTANCE|BOX",
        parse=crop_of,
    )
    remove_planes: bool = given(
        False,
        "Leave out floor and walls: planes in the first scan that are larger than the template.",
        ROOM,
        bool,
    )

    def checked(self) -> Self:
        """Returns the options with their values as they are stored.

        Raises:
            TypeError, ValueError: an option is refused.
        """
        if self.cameras is not None:
            check_path("cameras", self.cameras)
        for name, allowed in (("poses", Poses), ("axes", Axes), ("matrices", Matrices)):
            value = getattr(self, name)
            if value not in get_args(allowed):
                raise InputError(
                    f"must be one of {', '.join(get_args(allowed))}, not {value!r}", argument=name
                )
        if self.depth_scale is not None:
            check_positive("depth_scale", self.depth_scale)
        parsed: dict[str, Any] = {}
        for name, parse in _PARSED.items():
            value = getattr(self, name)
            parsed[name] = None if value is None else parse(value)
        if not isinstance(self.remove_planes, bool):
            told = f"must be True or False, not {self.remove_planes!r}"
            raise KindError(told, argument="remove_planes")
        return replace(self, **parsed)

    @property
    def corrections(self) -> Corrections:
        """What is said about the cameras."""
        return Corrections(**{one.name: getattr(self, one.name) for one in fields(Corrections)})

    @property
    def room(self) -> Room:
        """What is taken away from the scans."""
        return Room(self.crop, self.remove_planes)

    def open(self, scans: PathLike) -> ScanReader:
        """Opens the scans; see :func:`open_scans`."""
        return open_scans(scans, cameras=self.cameras, gaps=self.gaps, corrections=self.corrections)

    def units(self, scans: ScanReader, stated: float | None) -> Units:
        """Returns the units, that of the template as its file states it.

        Raises:
            ValueError: an option contradicts the file of the cameras.
        """
        template = (
            stated
            if self.template_unit is None
            else given_unit("template_unit", self.template_unit)
        )
        return Units(
            unit_of_scans(scans, self.scan_unit), template, scans.metres_per_unit is not None
        )

    def reading(self, units: Units, template: Path) -> Reading:
        """Returns how scans and template are read.

        Raises:
            ValueError: the unit of the scans is known, that of the template is not.
        """
        return Reading(self.corrections, self.turn_template or (), _factor(units, template))


_PARSED = {
    "crop": crop_of,
    "swap_cameras": swap_of,
    "intrinsics_size": size_of,
    "turn_template": turns_of,
}


def _factor(units: Units, template: Path) -> float:
    """Returns the length of the unit of the scans in that of the template."""
    if units.scans is None:
        return 1.0
    if units.template is None:
        raise InputError(
            f"states no unit, but the scans are in units of {units.scans:g} m: --template-unit m, "
            "cm or mm (in Python, template_unit=) says what it is",
            file=template,
        )
    return units.scans / units.template
