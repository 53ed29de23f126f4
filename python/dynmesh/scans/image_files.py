"""Which camera and which frame a depth image is of, by its name, and which of its pixels count."""

import os
import re
from bisect import bisect
from collections.abc import Iterable, Mapping
from itertools import chain
from pathlib import Path
from typing import Any, TypeAlias

from .._checks import check_number, path_of
from .._errors import InputError, within
from ..formats.format import Gaps
from ..formats.names import (
    FrameNames,
    Number,
    by_number,
    files_in,
    matching,
    numbers_in,
    usual_distance,
)
from ..formats.text import lines_in, words_in
from .cameras import Rig, ScanCamera
from .depth_files import COLOUR_SUFFIXES, MASK_SUFFIXES, SUFFIXES

_LIST = "depth.txt"


def images_in(path: Path, rig: Rig, suffixes: tuple[str, ...] = SUFFIXES) -> list[Path]:
    """Returns the images in a folder and those of the cameras in it, or that a glob names.

    Of a folder with several kinds of images, such as depth and colour, they are those whose folder
    or name says "depth". A list of TUM, `depth.txt`, names them.
    """
    if path.is_dir():
        if (path / _LIST).is_file():
            lines = (words_in(line) for line in lines_in(path / _LIST))
            return [path / words[1] for words in lines if len(words) == 2]
        cameras = {camera.name for camera in rig.cameras}
        below = (Path(folder) for folder, _, _ in os.walk(path))
        folders = [f for f in below if f == path or cameras & {*f.relative_to(path).parts}]
        found = [f for folder in sorted(folders) for one in suffixes for f in files_in(folder, one)]
        said = [file for file in found if "depth" in str(file.relative_to(path)).lower()]
        return said or found
    if (names := FrameNames.of(path)).numbered:
        among = files_in(path.parent, path.suffix.lower())
        return [file for file in among if _number_by(names, file, rig) is not None]
    return sorted(matching(path))


def images_by_camera(
    path: Path, rig: Rig, suffixes: tuple[str, ...] = SUFFIXES
) -> dict[str, dict[Number, Path]]:
    """Returns the images of each camera by their numbers.

    The camera is named at the end of a file's name, or else by a folder in its path, or, if there
    is only one, need not be named at all.
    """
    own: dict[str, dict[Path, str]] = {camera.name: {} for camera in rig.cameras}
    images = images_in(path, rig, suffixes)
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


def _owner(file: Path, path: Path, names: Iterable[str]) -> tuple[str | None, str]:
    """Returns the name of the camera that an image is of, or None, and the stem without it."""
    ends = [name for name in names if file.stem.endswith(f"_{name}") and file.stem != f"_{name}"]
    end = max(ends, key=len, default=None)
    folder = next((one for one in file.parent.parts[::-1] if one in names), None)
    is_inside = file.parent not in (path, path.parent)
    if folder is not None and (end is None or (is_inside and folder == file.parent.name)):
        before = file.stem.removesuffix(f"_{folder}")
        return folder, before if before[-1:].isdigit() else file.stem
    return (None, file.stem) if end is None else (end, file.stem.removesuffix(f"_{end}"))


def image_names(cameras: Iterable[ScanCamera]) -> str:
    """Says how images of these cameras would be named."""
    one = SUFFIXES[0]
    return " or ".join(f"*_{camera.name}{one}, {camera.name}/*{one}" for camera in cameras)


def beside(images: Iterable[Path], folder: Path, root: Path) -> dict[Path, Path]:
    """Returns the files in a folder with the names that images have below their root."""
    found = {
        file.relative_to(folder).with_suffix(""): file
        for file in sorted(folder.rglob("*"))
        if file.suffix.lower() in MASK_SUFFIXES
    }
    names = {image: image.relative_to(root).with_suffix("") for image in images}
    return {image: found[name] for image, name in names.items() if name in found}


def confidence_of(image: Path) -> Path | None:
    """Returns the image of confidences beside a depth image, whose path says that, not depth."""
    for at in range(len(image.parts) - 1, -1, -1):
        part = image.parts[at]
        if "depth" not in part.lower():
            continue
        for word in ("confidence", "conf"):
            for name in (re.sub("depth", word, part, flags=re.IGNORECASE), word):
                other = Path(*image.parts[:at], name, *image.parts[at + 1 :])
                for suffix in MASK_SUFFIXES:
                    if (file := other.with_suffix(suffix)) != image and file.is_file():
                        return file
    return None


def folder_of_masks(subject: Any, least_confidence: Any, *, of_points: bool = False) -> Path | None:
    """Checks what chooses pixels of depth images, which points do not have."""
    if least_confidence is not None:
        check_number("least_confidence", least_confidence)
    folder = None if subject is None else path_of("subject", subject)
    if folder is not None and not folder.is_dir():
        raise InputError("must be a folder of masks", argument="subject", file=folder)
    for name, value in {"subject": subject, "least_confidence": least_confidence}.items():
        if of_points and value is not None:
            raise InputError("chooses pixels of depth images; these are points", argument=name)
    return folder


def colours_of(
    folder: Path, rig: Rig, images: Mapping[str, Mapping[Number, Path]], gaps: Gaps
) -> dict[Path, Path]:
    """Finds the colour image of each depth image: that with the nearest number, or time.

    It must be nearer than half of the usual distance between depth images.
    """
    if not folder.is_dir():
        raise InputError("must be a folder of colour images", argument="colours", file=folder)
    found = images_by_camera(folder, rig, COLOUR_SUFFIXES)
    result = dict[Path, Path]()
    for camera, files in images.items():
        numbers = sorted(found[camera])
        farthest = usual_distance(sorted(files)) / 2
        for number, file in files.items():
            at = bisect(numbers, number)
            nearest = min(
                numbers[max(at - 1, 0) : at + 1], key=lambda n: abs(n - number), default=None
            )
            if nearest is not None and abs(nearest - number) <= farthest:
                result[file] = found[camera][nearest]
            elif gaps == "refuse":
                message = f"there is no colour image in {folder} for {file.name}"
                raise InputError(f"{message}; with `gaps` lost, it is not needed")
    return result


Masks: TypeAlias = list[tuple[Path, float | None]]
"""Files, with the least value of the pixels that count; None: all that are not 0."""


def masks_of(
    path: Path,
    rig: Rig,
    images: Mapping[str, Mapping[Number, Path]],
    subject: Path | None,
    least_confidence: float | None,
    gaps: Gaps,
) -> tuple[dict[Path, Masks], set[Path]]:
    """Finds the masks of each image, in the folder `subject` and beside it.

    Also returns the images without a mask or confidences, which `gaps` "lost" leaves out.
    """
    every = [file for files in images.values() for file in files.values()]
    wanted = list[tuple[str, Mapping[Path, Path], float | None]]()
    if subject is not None:
        masks = beside(every, subject, path if path.is_dir() else path.parent)
        if len(masks) < len(every):
            numbered = images_by_camera(subject, rig, MASK_SUFFIXES)
            masks |= {
                file: numbered[camera][number]
                for camera, files in images.items()
                for number, file in files.items()
                if number in numbered.get(camera, {})
            }
        wanted.append((f"mask in {subject}", masks, None))
    if least_confidence is not None:
        beside_them = {file: found for file in every if (found := confidence_of(file))}
        wanted.append(("image of confidences beside it", beside_them, least_confidence))
    without = set[Path]()
    for what, masked, _ in wanted:
        lacking = [file for file in every if file not in masked]
        if lacking and (gaps == "refuse" or len(lacking) == len(every)):
            only = "; with `gaps` lost, the image is not needed" * (len(lacking) < len(every))
            raise InputError(f"there is no {what} for {lacking[0].name}{only}")
        without |= {*lacking}
    whole = [file for file in every if file not in without] if wanted else []
    return {file: [(files[file], least) for _, files, least in wanted] for file in whole}, without
