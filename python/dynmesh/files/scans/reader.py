"""Reading scans, frame by frame: a folder or a pattern of files."""

import glob
from abc import ABC, abstractmethod
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..._errors import InputError
from ...frames.naming import naming
from ...frames.scan import DepthScan, PointScan, Scan
from ...frames.unchanged import Unchanged
from ..choice import PathLike
from ..format import Gaps
from ..numbered import Found, files_in, find_files
from .cameras import Rig, ScanCamera, read_cameras
from .depth_files import SUFFIX, read_depth, require_png
from .point_files import point_formats, read_points

CAMERAS = "cameras.json"
"""The name under which the cameras are found in a folder of scans."""


class ScanReader(ABC):
    """The scans of a sequence: what :func:`open_scans` returns.

    Attributes:
        path: of the scans.
        rig: the cameras, or None if they are not stated.
        start: the number of the first frame.
        step: the difference between the numbers of two frames.
        n_frames: number of frames.
        files: all files that are read.
        camera_files: those of them that describe cameras.
        metres_per_unit: as the files state it, or None.
    """

    def __init__(
        self, path: Path, rig: Rig | None, found: Found, files: list[Path], also: list[Path]
    ) -> None:
        """Called by subclasses when the files are found."""
        self.path = path
        self.rig = rig
        self.start, self.step = found.start, found.step
        self.n_frames = len(found.files)
        self.files = [*files, *also]
        self.camera_files = also
        self.metres_per_unit = None if rig is None else rig.metres_per_unit
        self._unchanged = Unchanged(self.files)

    def __iter__(self) -> Iterator[Scan | None]:
        """Yields the scan of each frame; None where its file is missing."""
        return self.frames()

    def frames(
        self, start: int = 0, stop: int | None = None, step: int = 1
    ) -> Iterator[Scan | None]:
        """Yields the scans of the frames ``range(start, stop, step)``, counted from 0."""
        for number in range(self.n_frames)[start:stop:step]:
            yield self._load(number)

    def doubt(self) -> str:
        """Returns what may be wrong if a mesh does not lie in the scans, or an empty text."""
        return ""

    @abstractmethod
    def _load(self, number: int) -> Scan | None:
        """Reads a frame; None if its file is missing."""


class PointReader(ScanReader):
    """Point clouds, one file per frame."""

    def __init__(
        self, path: Path, suffix: str, rig: Rig | None, gaps: Gaps, also: list[Path]
    ) -> None:
        """Finds the files and reads the first."""
        found = find_files(path, suffix, gaps)
        self._files = found.files
        present = [file for file in found.files if file is not None]
        super().__init__(path, rig, found, present, also)
        said = read_points(present[0]).metadata.metres_per_unit
        if None not in (said, self.metres_per_unit) and said != self.metres_per_unit:
            raise ValueError(
                f"{present[0].name} states {said} metres per unit, but the cameras "
                f"{self.metres_per_unit}"
            )
        self.metres_per_unit = said if self.metres_per_unit is None else self.metres_per_unit

    def _load(self, number: int) -> PointScan | None:
        file = self._files[number]
        if file is None:
            return None
        scan = read_points(file).scan
        self._unchanged.check([file])
        if scan.viewpoints is None and self.rig is not None:
            return scan._replace(viewpoints=self.rig.viewpoints.astype(scan.points.dtype))
        return scan


class DepthReader(ScanReader):
    """Depth images, one file per frame and camera, whose names end in the name of the camera."""

    def __init__(self, path: Path, rig: Rig, gaps: Gaps, also: list[Path]) -> None:
        """Finds the files, and reads none."""
        for camera in rig.cameras:
            if camera.intrinsics is None:
                raise ValueError(f"camera {camera.name!r} has no intrinsics, as depth images need")
        require_png()
        by_camera = {c.name: _numbered(_of_camera(path, c)) for c in rig.cameras}
        numbers = sorted(set().union(*by_camera.values()))
        if not numbers:
            names = ", ".join(f"*_{camera.name}{SUFFIX}" for camera in rig.cameras)
            raise ValueError(f"holds no depth image of a camera; their names would be {names}")
        step = int(np.gcd.reduce(np.diff(numbers))) if len(numbers) > 1 else 1
        every = range(numbers[0], numbers[-1] + 1, step)
        if gaps == "refuse":
            _refuse_gaps(every, by_camera)
        self._images = [
            [(c, by_camera[c.name][n]) for c in rig.cameras if n in by_camera[c.name]]
            for n in every
        ]
        files = [file for images in self._images for _, file in images]
        found = Found([None] * len(every), numbers[0], step)
        self._sizes: dict[str, tuple[tuple[int, ...], str]] = {}
        super().__init__(path, rig, found, files, also)

    def doubt(self) -> str:
        """Says which camera has intrinsics that do not fit the size of its images."""
        for images in self._images:
            for camera, file in images:
                height, width = read_depth(file, camera).shape
                x, y = np.asarray(camera.intrinsics)[:2, 2]
                if not (0.25 * width < x < 0.75 * width and 0.25 * height < y < 0.75 * height):
                    return (
                        f"the intrinsics of camera {camera.name!r} have their centre at "
                        f"({x:g}, {y:g}), far from the middle of its images of {width} x {height} "
                        "pixels; they may be those of another size"
                    )
            if images:
                break
        return ""

    def _load(self, number: int) -> DepthScan | None:
        images = self._images[number]
        if not images:
            return None
        intrinsics = [np.asarray(camera.intrinsics) for camera, _ in images]
        poses = [camera.camera_to_world for camera, _ in images]
        return DepthScan([self._read(camera, file) for camera, file in images], intrinsics, poses)

    def _read(self, camera: ScanCamera, file: Path) -> NDArray[np.float32]:
        """Reads an image, which must be as large as the others, since the intrinsics are equal."""
        depth = read_depth(file, camera)
        self._unchanged.check([file])
        size, first = self._sizes.setdefault(camera.name, (depth.shape, file.name))
        if depth.shape != size:
            raise InputError(
                f"has {depth.shape[1]} x {depth.shape[0]} pixels, but {first}, of the same camera, "
                f"{size[1]} x {size[0]}",
                file=file,
            )
        return depth


def open_scans(
    path: PathLike, *, cameras: PathLike | None = None, gaps: Gaps = "refuse"
) -> ScanReader:
    """Opens scans, to read them frame by frame.

    Args:
        path: a folder, a pattern such as ``scan_%04d.ply`` or a glob such as ``*.xyz``, of point
            clouds (PLY, XYZ, NPY, NPZ) or depth images (PNG with 16 bits). The names of depth
            images end in the number of the frame and the name of the camera, as
            ``depth_00012_left.png``.
        cameras: a file as :func:`read_cameras` reads it. None: `cameras.json` in the folder of the
            scans, if there is one. Depth images need it.
        gaps: "lost" if nothing was observed in frames, or by cameras, whose file is missing;
            "refuse" refuses such scans.

    Raises:
        OSError: a file cannot be read.
        ImportError: Pillow, which reads PNG, is not installed.
        ValueError: there are no scans, or the first one is damaged; the message names the file.
    """
    path = Path(path)
    if cameras is None:
        beside = (path if path.is_dir() else path.parent) / CAMERAS
        cameras = beside if beside.is_file() else None
    rig = None if cameras is None else read_cameras(Path(cameras))
    also = [] if cameras is None else [Path(cameras)]
    with naming(path):
        suffix = _suffix_in(path)
        if suffix != SUFFIX:
            return PointReader(path, suffix, rig, gaps, also)
        if rig is None:
            raise ValueError(
                f"depth images need cameras: {CAMERAS} beside them, or --cameras FILE (in Python, "
                "cameras=)"
            )
        return DepthReader(path, rig, gaps, also)


def _suffix_in(path: Path) -> str:
    """Returns the suffix of the scans."""
    suffixes = (*point_formats, SUFFIX)
    if path.is_dir():
        found = [suffix for suffix in suffixes if files_in(path, suffix)]
        if len(found) != 1:
            if not found:
                raise ValueError(f"is a folder without scans; they are {', '.join(suffixes)} files")
            kinds = " and ".join(found)
            raise ValueError(f"is a folder with {kinds} files; name one kind by a pattern")
        return found[0]
    if not path.suffix and not path.exists():
        raise ValueError("does not exist")
    if path.suffix.lower() not in suffixes:
        raise ValueError(f"unknown format {path.suffix!r}; scans are {', '.join(suffixes)}")
    return path.suffix.lower()


def _of_camera(path: Path, camera: ScanCamera) -> list[Path]:
    """Returns the images of a camera in a folder, or of those that a pattern or glob names."""
    if path.is_dir():
        among = files_in(path, SUFFIX)
    elif "%" in path.name:
        number, _, rest = path.name.partition("%")
        end = rest.partition("d")[2]
        ends = end, f"_{camera.name}{end}"  # a pattern may leave out the camera
        among = files_in(path.parent, SUFFIX)
        among = [f for f in among if f.name.startswith(number) and f.name.endswith(ends)]
    else:
        among = [Path(file) for file in sorted(glob.glob(str(path)))]  # noqa: PTH207
    return [file for file in among if file.stem.endswith(f"_{camera.name}")]


def _numbered(files: list[Path]) -> dict[int, Path]:
    """Returns the files of one camera by the number before its name."""
    numbered: dict[int, Path] = {}
    for file in files:
        before = file.stem.rpartition("_")[0]
        digits = before[len(before.rstrip("0123456789")) :]
        if not digits:
            raise ValueError(f"{file.name}: has no number of a frame before the camera's name")
        if int(digits) in numbered:
            raise ValueError(f"{file.name}: {numbered[int(digits)].name} has the same number")
        numbered[int(digits)] = file
    return numbered


def _refuse_gaps(numbers: range, by_camera: dict[str, dict[int, Path]]) -> None:
    advice = "; --gaps lost (in Python, gaps='lost') tracks without it"
    for name, images in by_camera.items():
        if not images:  # the names of its files may be wrong
            raise ValueError(
                f"there is no image of camera {name!r}; their names would be *_{name}{SUFFIX}"
                + advice
            )
    for number in numbers:
        for name, images in by_camera.items():
            if number not in images:
                raise ValueError(
                    f"there is no image of camera {name!r} for frame {number}" + advice
                )
