"""What an evaluation has measured."""

from dataclasses import dataclass, field

from .._checks import path_of
from .._report import Report, counted, write_csv
from ..formats import PathLike
from .calibration import Calibration
from .true_errors import FrameErrors


@dataclass(frozen=True, kw_only=True)
class Evaluation(Report):
    """Errors in bounding-box diagonals of frame 0 of the reference.

    Attributes:
        nmsve: the normalised mean square visual error (eq. 5), mean over the frames.
        mean: the mean distance between vertices and their true positions.
        rms: the root mean square of the distances in a frame, mean over the frames.
        p99: the 99th percentile of the distances in a frame, mean over the frames.
        maximum: the largest distance.
        frames: the number of frames in which vertices were measured.
        bounding_box_diagonal: the diagonal, in the unit of the positions.
        calibration: how well the standard errors of the completed sequence describe its errors;
            None if it has none of positions.
        each: the errors of each frame.
    """

    nmsve: float
    mean: float
    rms: float
    p99: float
    maximum: float
    frames: int
    bounding_box_diagonal: float
    calibration: Calibration | None
    each: tuple[FrameErrors, ...] = field(default=(), repr=False)

    def lines(self) -> list[str]:
        """Says how large the errors are."""
        rows = {
            "NMSVE x 1e4": f"{1e4 * self.nmsve:.4g}",
            "mean error": f"{self.mean:.4g}, root mean square {self.rms:.4g}",
            "99th percentile": f"{self.p99:.4g}",
            "maximum": f"{self.maximum:.4g}",
            "measured": f"{counted(self.frames, 'frame')}, in bounding-box diagonals of the first, "
            f"{self.bounding_box_diagonal:g}",
        }
        if (result := self.calibration) is not None:
            rows["standard errors"] = (
                f"the 90 % interval holds {100 * result.coverage_90:.3g} % of the errors, the 50 % "
                f"interval {100 * result.coverage_50:.3g} %"
            )
        return [f"{name:18}{value}" for name, value in rows.items()] + super().lines()

    def write_csv(self, path: PathLike) -> None:
        """Writes a table with a row for each frame."""
        write_csv(path_of("path", path), FrameErrors, self.each)
