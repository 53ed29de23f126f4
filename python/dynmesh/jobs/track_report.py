"""What tracking in files of scans has done."""

from dataclasses import dataclass

from .._core import Alignment


@dataclass(frozen=True)
class TrackFileReport:
    """What :func:`track_file` has done.

    Attributes:
        frames: number of frames in the output.
        resumed_at: number of frames that an interrupted run had tracked.
        seconds_per_frame: median time of the tracker, without reading and writing; None if no frame
            was tracked.
        observed: share of the vertices that had a correspondence in the scan, on average over the
            frames of this call in which there was a scan; None if there are none.
        empty: number of frames of this call without a scan, or whose scan had no points.
        alignment: the rigid motion of the template that put it into the first scan; None if it lay
            there already.
        distance: of the template from the first scan, in mean edges, before an alignment.
        prior_weight: how far the shapes of the training frames were used, from 0 to 1, on average
            over the same frames; 0 without them.
        remarks: remarks about the output for the user, one line each.
        existed: whether `resume` found a complete output, so that nothing was done.
    """

    frames: int
    resumed_at: int
    seconds_per_frame: float | None = None
    observed: float | None = None
    empty: int = 0
    alignment: Alignment | None = None
    distance: float | None = None
    prior_weight: float | None = None
    remarks: tuple[str, ...] = ()
    existed: bool = False
