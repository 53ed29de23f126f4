"""The scans of files, frame by frame: point clouds, or depth images of several cameras."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._checks import selected
from .._errors import DynmeshError, InputError, naming
from ..formats.format import Gaps
from ..formats.names import (
    Number,
    numbers_in,
    usual_distance,
    with_missing,
)
from ..formats.times import indices_of
from ..header import largest_start
from ..scan import DepthScan, PointScan, Scan
from .cameras import CAMERAS, LostPoseError, Rig, ScanCamera
from .depth_files import (
    along_axis,
    first_of,
    read_colours,
    read_depth,
    read_mask,
    require_pillow,
    undistortion,
    without_mirrors,
)
from .image_files import (
    colours_of,
    image_names,
    images_by_camera,
    masks_of,
)
from .point_files import POINTS, PointFile, read_points


class ScanReader(ABC):
    """The scans of a sequence: what :func:`open_scans` returns.

    Attributes:
        path: of the scans.
        rig: the cameras, or None if they are not stated.
        numbers: those of the frames, as their file names have them.
        n_frames: number of frames.
        files: all files that are read.
        lost: a sentence for each depth image that is missing or, of those read so far, damaged.
        remarks: what else the user should know, in a sentence each.
        metres_per_unit: as the files state it, or None.
    """

    def __init__(
        self, path: Path, rig: Rig | None, numbers: list[Number], files: list[Path]
    ) -> None:
        self.path, self.rig = path, rig
        self.numbers, self.n_frames = numbers, len(numbers)
        self.files = files if rig is None or rig.file is None else [*files, rig.file]
        self.metres_per_unit = None if rig is None else rig.metres_per_unit
        self._damaged: dict[Path, str] = {}
        self._missing: tuple[str, ...] = ()
        self.remarks: tuple[str, ...] = ()
        self._chosen: Sequence[int] = range(self.n_frames)

    def __iter__(self) -> Iterator[Scan | None]:
        return self.frames()

    def frames(
        self, start: int = 0, stop: int | None = None, step: int = 1
    ) -> Iterator[Scan | None]:
        """Yields the scans of the frames ``[start:stop:step]``, counted from 0."""
        return self.frames_at(selected(self.n_frames, start, stop, step))

    def frames_at(self, numbers: Sequence[int]) -> Iterator[Scan | None]:
        """Yields the scans of the frames with these indices."""
        return map(self._load, (self._chosen[at] for at in numbers))

    def choose(self, frames: slice | range | None) -> None:
        """Keeps the frames with these numbers; the last one is excluded."""
        if frames is not None:
            chosen = indices_of(np.array(self.numbers, np.float64), frames)
            self._chosen = [self._chosen[at] for at in chosen]
            self.numbers = [self.numbers[at] for at in chosen]
            self.n_frames = len(self.numbers)

    def number(self, frame: int) -> Number:
        """The number of a frame that is counted from 0."""
        return self.numbers[frame]

    def cameras_of(self, frame: int) -> list[str]:  # noqa: ARG002
        """Returns the names of the cameras of a frame, in the order of its scan."""
        return [] if self.rig is None else [camera.name for camera in self.rig.cameras]

    @abstractmethod
    def _load(self, number: int) -> Scan | None:
        """Reads a frame; None if its file is missing."""

    @property
    def lost(self) -> tuple[str, ...]:
        """See above."""
        return *(f"{file.name} {why}" for file, why in self._damaged.items()), *self._missing


class PointReader(ScanReader):
    """Point clouds, one file per frame; of a missing one, the file is None."""

    def __init__(
        self,
        path: Path,
        rig: Rig | None,
        files: Sequence[Path | None],
        numbers: list[Number],
        gaps: Gaps = "refuse",
        read: Callable[[Path], PointFile] = read_points,
        *,
        coloured: bool = False,
    ) -> None:
        present = [file for file in files if file is not None]
        super().__init__(path, rig, numbers, present)
        self._files, self._read, self._coloured = files, read, coloured
        if rig is not None and rig.moves and len(files) == 1:
            numbers, _ = numbers_in(present)  # which by itself is frame 0
        self._viewpoints = list[NDArray[np.float64] | None]()
        with naming(path if rig is None or rig.file is None else rig.file):
            for file, number in zip(files, numbers, strict=True):
                places = None
                try:
                    places = None if rig is None or file is None else rig.viewpoints(number)
                except LostPoseError:
                    if gaps == "refuse":
                        raise
                self._viewpoints.append(places)
        stated = read(present[0]).metadata.metres_per_unit
        if None not in (stated, self.metres_per_unit) and stated != self.metres_per_unit:
            message = f"states {stated} metres per unit, but the cameras {self.metres_per_unit}"
            raise InputError(message, file=present[0])
        self.metres_per_unit = stated if self.metres_per_unit is None else self.metres_per_unit

    def _load(self, number: int) -> PointScan | None:
        file, viewpoints = self._files[number], self._viewpoints[number]
        if file is None:
            return None
        scan = self._read(file).scan
        if not self._coloured:
            scan = scan._replace(colours=None)
        elif scan.colours is None:
            message = f"has no colours, which `colours` {POINTS!r} requires: red, green and blue"
            raise InputError(message, file=file)
        if viewpoints is None:
            return scan
        return scan._replace(viewpoints=viewpoints.astype(scan.points.dtype))


class DepthReader(ScanReader):
    """Depth images, one file per frame and camera.

    A damaged image, or one of another size than its camera has, is lost, as if its camera had seen
    nothing in this frame. Where every image is, or a camera is described for another kind or size
    of images, that is an error.
    """

    def __init__(
        self,
        path: Path,
        rig: Rig,
        gaps: Gaps,
        subject: Path | None,
        least: float | None,
        colours: Path | None = None,
    ) -> None:
        self._undistort = dict[str, Any]()
        for camera in rig.cameras:
            if camera.intrinsics is None:
                stated = f'; state them in {CAMERAS}, with "poses": "{rig.file and rig.file.name}"'
                raise InputError(
                    f"camera {camera.name!r} has no intrinsics, as depth images need"
                    f"{stated if camera.frames else ''}"
                )
        require_pillow()
        by_camera = images_by_camera(path, rig)
        numbers = sorted(set().union(*by_camera.values()))
        if not numbers:
            raise InputError(
                f"holds no depth image of a camera; their names would be {image_names(rig.cameras)}"
            )
        every = [*with_missing(numbers)]
        missing = [(n, c) for n in every for c in rig.cameras if n not in by_camera[c.name]]
        if missing and gaps == "refuse":
            number, camera = missing[0]
            raise InputError(
                f"there is no image of camera {camera.name!r} for frame {number}, which would be "
                f"named {image_names([camera])}; with `gaps` lost, it is not needed"
            )
        lost = [f"no image of camera {c.name!r} for frame {n}" for n, c in missing]
        with naming(rig.file or path):
            cameras = [
                self._undistorted(camera, by_camera[camera.name].values(), rig)
                for camera in rig.cameras
            ]
            self._images = list[list[tuple[ScanCamera, Path]]]()
            for n in every:
                seen = list[tuple[ScanCamera, Path]]()
                for camera in cameras:
                    try:
                        if n in by_camera[camera.name]:
                            seen.append((camera.at(n), by_camera[camera.name][n]))
                    except LostPoseError:
                        if gaps == "refuse":
                            raise
                        lost.append(f"no pose of camera {camera.name!r} for frame {n}")
                self._images.append(seen)
        files = [file for images in self._images for _, file in images]
        self._colours = None if colours is None else colours_of(colours, rig, by_camera, gaps)
        self._masks, unmasked = masks_of(path, rig, by_camera, subject, least, gaps)
        if unmasked:
            lost += [f"{file.name} has no mask" for file in files if file in unmasked]
            self._images = [
                [(camera, file) for camera, file in images if file not in unmasked]
                for images in self._images
            ]
        self._n_images = sum(map(len, self._images))
        is_count = max(map(abs, every)) <= largest_start  # not nanoseconds, for instance
        numbered = every if is_count else [*range(len(every))]
        super().__init__(path, replace(rig, cameras=tuple(cameras)), numbered, files)
        self._missing = tuple(lost)
        usual = usual_distance(every)
        away = {c.name: max(c.distance(n) for n in every) for c in rig.cameras}
        self.remarks = tuple(
            f"the nearest pose of camera {name!r} is up to {farthest:.3g} from a frame, and frames "
            f"are {usual:.3g} apart; poses were interpolated"
            for name, farthest in away.items()
            if farthest > usual and not lost
        )

    def _undistorted(self, camera: ScanCamera, files: Iterable[Path], rig: Rig) -> ScanCamera:
        """Returns the camera as its images are read: without a lens, and not mirrored."""
        first, intrinsics = first_of(files, camera), camera.intrinsics
        size = camera.size if first is None else first.size
        scale = camera.depth_scale
        if scale is None:  # of images in metres
            scale = 1 / (rig.metres_per_unit or 1.0)
        camera = replace(camera, size=size, depth_scale=scale)
        if camera.distortion:
            matrix, self._undistort[camera.name] = undistortion(camera)
            intrinsics = np.broadcast_to(matrix, np.shape(np.asarray(intrinsics)))
        return without_mirrors(replace(camera, intrinsics=intrinsics, distortion=()))

    def cameras_of(self, frame: int) -> list[str]:
        """Returns those of the images, except the damaged ones once the frame was read."""
        images = self._images[self._chosen[frame]]
        return [c.name for c, file in images if file not in self._damaged]

    def _load(self, number: int) -> DepthScan | None:
        read = ((camera, self._read(camera, file)) for camera, file in self._images[number])
        images = [(camera, depth) for camera, depth in read if depth is not None]
        if not images:
            return None
        intrinsics = [np.asarray(camera.intrinsics) for camera, _ in images]
        poses = [camera.camera_to_world for camera, _ in images]
        scan = DepthScan([depth for _, depth in images], intrinsics, poses)
        if self._colours is None:
            return scan
        # Those of a damaged depth image have no place.
        files = [file for _, file in self._images[number] if file not in self._damaged]
        if not all(file in self._colours for file in files):
            return scan
        pairs = zip(images, files, strict=True)
        return scan._replace(
            colours=[self._colours_of(camera, self._colours[file]) for (camera, _), file in pairs]
        )

    def _colours_of(self, camera: ScanCamera, file: Path) -> NDArray[np.uint8]:
        """Reads colours, of which a damaged image is an error."""
        colours = read_colours(file, camera)
        undistort = self._undistort.get(camera.name)
        return colours if undistort is None else np.asarray(undistort(colours), np.uint8)

    def _read(self, camera: ScanCamera, file: Path) -> NDArray[np.float32] | None:
        """Reads an image; None if it is damaged."""
        kept = None
        if file in self._masks and (size := camera.size) is not None:
            each = [read_mask(mask, size, least) for mask, least in self._masks[file]]
            kept = np.logical_and.reduce(each)
        try:
            depth = read_depth(file, camera, kept)
        except (DynmeshError, OSError) as error:
            why = error.reason if isinstance(error, DynmeshError) else f"cannot be read: {error}"
            self._damaged.setdefault(file, why)
            if len(self._damaged) == self._n_images:
                raise InputError(f"{why}; there is no undamaged image", file=file) from error
            return None
        undistort = self._undistort.get(camera.name)
        depth = depth if undistort is None else undistort(depth)
        return along_axis(depth, np.asarray(camera.intrinsics)) if camera.along_ray else depth
