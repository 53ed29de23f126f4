"""The command that tracks a mesh through scans."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray

from ..jobs.option import HOW
from ..jobs.track_report import TrackFileReport
from ..jobs.tracking import track_into
from ..jobs.tracking_options import TrackingOptions
from .options import OutputPath, Overwrite, with_options
from .terminal import DOUBTFUL, say, say_remarks
from .terminal import track as show_progress

_FAR = 1.5
"""Mean edges between a moved template and a scan beyond which their poses probably differ."""
_SIZES = 1.5
"""A scan so many times larger or smaller than a moved template is probably in another unit."""
_FEW = 0.05
"""Below this share of vertices with a correspondence, a scan is probably not of the mesh."""

_NAMED = 3
"""Lost images that are named."""


@with_options(TrackingOptions, TrackingOptions)
def track(
    scans: Annotated[
        Path,
        typer.Argument(
            metavar="SCANS",
            help="Point clouds (PLY, XYZ, NPY, NPZ) or depth images (16-bit PNG), one file per "
            "frame: a folder, or a pattern in quotes.",
        ),
    ],
    output: OutputPath,
    *,
    options: TrackingOptions,
    align: Annotated[
        bool,
        typer.Option(
            "--align/--no-align",
            help="Move the template rigidly to the first scan if it does not lie in it.",
            rich_help_panel=HOW,
        ),
    ] = True,
    overwrite: Overwrite = False,
) -> None:
    """Track a mesh through scans whose points belong to no vertex.

    The exit code is 3 if the result is doubtful or probably ruined. dynmesh convert states the
    frames per second of the result, chooses frames and changes axes, units and rates.

    Examples:
    ```text
    dynmesh track scans tracked.npz --template body.obj
    dynmesh track 'depth/*.png' tracked.usd --template body.obj --cameras rig.json
    dynmesh track scans tracked.npz --template body.obj --training range_of_motion.npz
    ```
    """
    asked = replace(options, align="auto" if align else "never")
    report = track_into(
        scans, output, asked, overwrite, watch=lambda one, n: show_progress(one, n, "tracking")
    )
    _say_what_was_done(output, report)
    if options.uncertainty and not options.provenance:
        say(f"{output}: standard errors are not in the file; --provenance writes them")
    if options.training and report.prior_weight is not None:
        say(f"{output}: the prior weight of the training frames was {report.prior_weight:.2g}")
    if report.quality != "good":
        raise typer.Exit(DOUBTFUL)


def _say_what_was_done(output: Path, report: TrackFileReport) -> None:
    if report.registration is not None:
        say(
            f"{output}: the template was not in the pose of the first scan and was registered "
            f"with it: {report.registration.quality}"
        )
    if report.alignment is not None:
        found = report.alignment
        say(
            f"{output}: the template was {found.before:.3g} mean edges from the first scan; a "
            f"rotation by {_degrees(found.rotation):.3g} degrees and a shift put it "
            f"{found.after:.3g} from it"
        )
        if found.after > _FAR:
            say(
                f"{output}: that is far; the template is probably not in the pose of the first "
                "scan, so look at the first frames"
            )
        if not 1 / _SIZES < found.ratio < _SIZES:
            say(
                f"{output}: the scan is {found.ratio:.3g} times as large as the template; if that "
                "is wrong, --scan-unit and --template-unit say the units"
            )
    if report.seconds_per_frame is not None and report.observed is not None:
        _say_how_well(output, report)
        say(
            f"{output}: {report.frames} frames tracked in {1e3 * report.seconds_per_frame:.3g} ms "
            f"each (median); {100 * report.observed:.3g} % of the vertices were seen"
        )
        if report.observed < _FEW:
            say(
                f"{output}: so few, that the scans are probably not of this mesh or of another unit"
            )
    if report.recovered:
        say(
            f"{output}: in {report.recovered} of the frames, the mesh was lost and found again by "
            "a registration"
        )
    if report.empty:
        say(f"{output}: {report.empty} of the frames had no points")
    if report.lost:
        n = len(report.lost)
        named = "; ".join(report.lost[:_NAMED]) + ("; ..." if n > _NAMED else "")
        say(f"{output}: {n} depth image{'s were' if n > 1 else ' was'} lost: {named}")
    say_remarks(output, report.remarks)


def _say_how_well(output: Path, report: TrackFileReport) -> None:
    if report.quality == "good" and report.far is not None:
        say(f"{output}: good; {report.far:.2%} of the points are far from the mesh")
    if report.reason:
        say(f"{output}: {report.reason}")


def _degrees(rotation: NDArray[np.float64]) -> float:
    """Returns the angle of a rotation."""
    cosine = (np.trace(rotation) - 1) / 2
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
