"""Which pixels of depth images count: those of the subject, measured with confidence."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .._checks import check_number, path_of
from .._errors import InputError
from ..formats.format import Gaps
from ..formats.names import Number
from .cameras import Rig
from .depth_files import read_mask
from .image_files import beside, confidence_of, images_by_camera

Kept: TypeAlias = Callable[[tuple[int, int]], NDArray[np.bool_]]
"""Returns (h, w) which pixels count of an image of (w, h)."""


@dataclass(frozen=True)
class Wanted:
    """What is wanted of depth images.

    Attributes:
        subject: a folder of masks that are not 0 where the subject is; None for all.
        least_confidence: of a pixel; None for any.
    """

    subject: Path | None = None
    least_confidence: float | None = None

    def __post_init__(self) -> None:
        if self.least_confidence is not None:
            check_number("least_confidence", self.least_confidence)
        if self.subject is not None and not self.subject.is_dir():
            raise InputError("must be a folder of masks", argument="subject", file=self.subject)

    @classmethod
    def of_reading(cls, reading: Mapping[str, Any]) -> "Wanted":
        """Takes what is said of how scans are read."""
        subject = reading.get("subject")
        folder = None if subject is None else path_of("subject", subject)
        return cls(folder, reading.get("least_confidence"))

    def refuse_points(self) -> None:
        """Refuses to choose among the pixels of point clouds."""
        for name in ("subject", "least_confidence"):
            if getattr(self, name) is not None:
                raise InputError("chooses pixels of depth images; these are points", argument=name)

    def of(
        self, path: Path, rig: Rig, by_camera: Mapping[str, Mapping[Number, Path]], gaps: Gaps
    ) -> tuple[dict[Path, Kept], set[Path]]:
        """Finds the masks of images.

        Returns:
            What tells which pixels of each image count, if not all do, and the images without a
            mask or confidences, which `gaps` "lost" leaves out.
        """
        images = [file for files in by_camera.values() for file in files.values()]
        wanted = list[tuple[str, Mapping[Path, Path], float | None]]()
        if self.subject is not None:
            masks = beside(images, self.subject, path if path.is_dir() else path.parent)
            if len(masks) < len(images):
                masks |= _by_number(images_by_camera(self.subject, rig), by_camera)
            wanted.append((f"mask in {self.subject}", masks, None))
        if self.least_confidence is not None:
            beside_them = {file: found for file in images if (found := confidence_of(file))}
            wanted.append(("image of confidences beside it", beside_them, self.least_confidence))
        without = set[Path]()
        for what, files, _ in wanted:
            lacking = [file for file in images if file not in files]
            if lacking and (gaps == "refuse" or len(lacking) == len(images)):
                only = "; with `gaps` lost, the image is not needed" * (len(lacking) < len(images))
                raise InputError(f"there is no {what} for {lacking[0].name}{only}")
            without |= {*lacking}
        whole = [file for file in images if file not in without] if wanted else []
        kept = {
            file: _all_of([(files[file], least) for _, files, least in wanted]) for file in whole
        }
        return kept, without


def _by_number(
    masks: Mapping[str, Mapping[Number, Path]], images: Mapping[str, Mapping[Number, Path]]
) -> dict[Path, Path]:
    """Pairs masks with the images of the same camera and number."""
    return {
        file: masks[camera][number]
        for camera, files in images.items()
        for number, file in files.items()
        if number in masks.get(camera, {})
    }


def _all_of(files: list[tuple[Path, float | None]]) -> Kept:
    return lambda size: np.logical_and.reduce(
        [read_mask(file, size, least) for file, least in files]
    )
