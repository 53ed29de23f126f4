"""Which camera and which frame a depth image is of, by its name and its folder."""

import re
from collections.abc import Container, Iterable
from itertools import chain
from pathlib import Path

from .._errors import InputError, within
from ..formats.names import FrameNames, Number, by_number, files_in, matching, numbers_in
from .cameras import Rig, ScanCamera
from .depth_files import SUFFIX


def images_in(path: Path, rig: Rig) -> list[Path]:
    """Returns the images in a folder and those of the cameras in it, or that a glob names."""
    if path.is_dir():  # also the folders of cameras in it
        folders = [path, *(path / camera.name for camera in rig.cameras)]
        return [file for folder in folders for file in files_in(folder, SUFFIX)]
    if (names := FrameNames.of(path)).numbered:
        among = files_in(path.parent, SUFFIX)
        return [file for file in among if _number_by(names, file, rig) is not None]
    return sorted(matching(path))


def images_by_camera(path: Path, rig: Rig) -> dict[str, dict[Number, Path]]:
    """Returns the images of each camera by their numbers.

    The camera is named at the end of a file's name, or else is the folder's name, or, if there is
    only one, need not be named at all.
    """
    own: dict[str, dict[Path, str]] = {camera.name: {} for camera in rig.cameras}
    images = images_in(path, rig)
    owners = {file: _owner(file, path, own) for file in images}
    if len(own) == 1 and not any(name for name, _ in owners.values()):
        owners = {file: (rig.cameras[0].name, file.stem) for file in images}
    for file, (name, stem) in owners.items():
        before, _, end = stem.rpartition("_")
        if name is not None:
            own[name][file] = stem
        elif before[-1:].isdigit():
            raise InputError(
                f"holds images of camera {end!r} ({file.name}), which the cameras file does not "
                "describe; describe it there, or move its images elsewhere"
            )
        if name is not None and not re.search("[0-9]", stem):
            raise InputError(f"{file.name}: has no number of a frame")
    names = FrameNames.of(path)
    if names.numbered and not path.is_dir():
        numbers = {file: _number_by(names, file, rig) or 0 for file in images}
    else:
        each = [numbers_in([*stems], [*stems.values()]) for stems in own.values() if stems]
        every = {file: stem for stems in own.values() for file, stem in stems.items()}
        if any(pattern is None for _, pattern in each):  # then frames are counted in all names
            each = [numbers_in([*every], [*every.values()])]
        numbers = dict(zip(every, chain(*(numbers for numbers, _ in each)), strict=True))
    result = dict[str, dict[Number, Path]]()
    for camera, files in own.items():
        with within(f"images of camera {camera!r}"):
            result[camera] = by_number((numbers[file], file) for file in files)
    return result


def _number_by(names: FrameNames, file: Path, rig: Rig) -> Number | None:
    """Returns the number of an image by a pattern, which may leave out the camera."""
    ends = "", *(f"_{camera.name}" for camera in rig.cameras)
    numbers = (names.number(file.stem.removesuffix(end) + file.suffix) for end in ends)
    return next((number for number in numbers if number is not None), None)


def _owner(file: Path, path: Path, names: Container[str]) -> tuple[str | None, str]:
    """Returns the name of the camera that an image is of, or None, and the stem without it."""
    folder = file.parent.name
    before, _, end = file.stem.rpartition("_")
    is_named = bool(before) and end in names
    if folder in names and (not is_named or file.parent not in (path, path.parent)):
        return folder, before if end == folder and before[-1:].isdigit() else file.stem
    return (end, before) if is_named else (None, file.stem)


def image_names(cameras: Iterable[ScanCamera]) -> str:
    """Says how images of these cameras would be named."""
    return " or ".join(f"*_{camera.name}{SUFFIX}, {camera.name}/*{SUFFIX}" for camera in cameras)
