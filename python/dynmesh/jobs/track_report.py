"""What tracking in files of scans has done."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from .._core import Alignment
from ..registration import Registration
from .fits import Quality


@dataclass(frozen=True)
class TrackFileReport:
    """What :func:`track_file` has done.

    Attributes:
        frames: number of frames in the output.
        seconds_per_frame: median time of the tracker, without reading and writing; None if no frame
            was tracked.
        observed: share of the vertices that had a correspondence in the scan, on average over the
            frames in which there was a scan; None if there are none.
        far: share of the points of those frames that are farther than one mean edge from the mesh,
            without planes of the surroundings. It tells best how well they were tracked; None if
            there are none.
        quality: "good"; "doubtful" if that share is above 0.02, a camera is suspected, or the
            registration is doubtful; "ruined", which is probable, above 0.05.
        reason: what is wrong with the result, in a sentence; empty if nothing is.
        worst: the frames with a share above 0.05, at most five, the worst one first, each with its
            number, that of its file, and its share.
        cameras: that share for each camera that saw points.
        suspects: the cameras whose share is above 0.05 and more than twice the median of the
            others, or whose points that are not far are more than three times as far from the mesh
            as the median of those of the others.
        empty: number of frames without a scan, or whose scan had no points.
        recovered: number of frames in which the mesh was lost and found again by a registration.
        lost: a sentence for each depth image that was missing or damaged; the frame was tracked
            with those of the other cameras.
        alignment: the rigid motion of the template that put it into the first scan; None if it lay
            there already.
        distance: of the template from the first scan, in mean edges, before an alignment.
        registration: of the template with the first scan, if it had another pose there.
        prior_weight: how far the shapes of the training frames were used, from 0 to 1, on average
            over the same frames; 0 without them.
        remarks: remarks about the output for the user, one line each.
    """

    frames: int
    seconds_per_frame: float | None = None
    observed: float | None = None
    far: float | None = None
    quality: Quality = "good"
    reason: str = ""
    worst: tuple[tuple[int, float], ...] = ()
    cameras: Mapping[str, float] = field(default_factory=dict)
    suspects: tuple[str, ...] = ()
    empty: int = 0
    recovered: int = 0
    lost: tuple[str, ...] = ()
    alignment: Alignment | None = None
    distance: float | None = None
    registration: Registration | None = None
    prior_weight: float | None = None
    remarks: tuple[str, ...] = ()
