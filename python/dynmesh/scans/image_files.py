"""Which camera and which frame a depth image is of, by its name and its folder."""

import re
from collections.abc import Collection, Container, Iterable, Mapping
from itertools import chain
from pathlib import Path

from .._errors import InputError
from ..formats.folders import files_in, matching
from ..formats.names import FrameNames, Number, by_number, numbers_in
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
    images, cameras = images_in(path, rig), {camera.name for camera in rig.cameras}
    owners = [_owner(file, path, cameras) for file in images]
    if len(cameras) == 1 and not any(name for name, _ in owners):
        owners = [(next(iter(cameras)), file.stem) for file in images]
    others = [f for f, (name, _) in zip(images, owners, strict=True) if name is None]
    parts = [(file, *file.stem.rpartition("_")[::2]) for file in others]
    not_described = {name: file for file, before, name in parts if before[-1:].isdigit()}
    if not_described:
        message = " and of ".join(
            f"{name!r} ({f.name})" for name, f in sorted(not_described.items())
        )
        raise InputError(
            f"holds images of camera {message}, which the cameras file does not describe; describe "
            "it there, or move its images elsewhere"
        )
    own: dict[str, dict[Path, str]] = {name: {} for name in cameras}
    for file, (name, stem) in zip(images, owners, strict=True):
        if name is not None:
            own[name][file] = stem
    names, result = FrameNames.of(path), dict[str, dict[Number, Path]]()
    if names.numbered and not path.is_dir():
        numbers = {file: _number_by(names, file, rig) or 0 for file in images}
    else:
        numbers = _numbers(own.values())
    for camera, files in own.items():
        try:
            result[camera] = by_number((numbers[file], file) for file in files)
        except InputError as error:
            raise InputError(f"images of camera {camera!r}: {error}") from error
    return result


def _numbers(of_cameras: Collection[Mapping[Path, str]]) -> dict[Path, Number]:
    """Returns the numbers of images, given the parts of their names that are compared.

    If frames are counted, it is in the names of all cameras.
    """
    every = {file: stem for stems in of_cameras for file, stem in stems.items()}
    if bare := [file.name for file, stem in every.items() if not re.search("[0-9]", stem)]:
        raise InputError(f"{bare[0]}: has no number of a frame")
    each = [numbers_in([*stems], [*stems.values()]) for stems in of_cameras if stems]
    if any(pattern is None for _, pattern in each):
        each = [numbers_in([*every], [*every.values()])]
    return dict(zip(every, chain(*(numbers for numbers, _ in each)), strict=True))


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
