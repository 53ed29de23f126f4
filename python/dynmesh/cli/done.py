"""What a completion did, in lines for the terminal."""

from pathlib import Path

from ..jobs.report import LONG, FileReport
from .terminal import say

_MANY = 0.01  # of the vertices


def say_what_was_done(output: Path | str, report: FileReport, reject_outliers: bool) -> None:
    """Prints how many frames were completed, how fast, and the shares of the vertices."""
    seconds = report.seconds_per_frame
    if seconds is None:
        say(f"{output}: there is only one frame, so no other was completed")
        return
    frames = min(report.completed, report.frames)
    sides = report.completed > report.frames
    how, each = (" from both sides", "for each side") if sides else ("", "each")
    rate = frames / (report.completed * seconds)
    say(
        f"{output}: {frames} frames completed{how} in {1e3 * seconds:.3g} ms {each} (median), "
        f"{rate:.0f} frames per second without reading and writing"
    )
    whole = report.known + report.filled + report.disconnected
    if reject_outliers:
        share = 100 * report.rejected / whole
        say(f"{output}: {report.rejected} outliers rejected, {share:.3g} % of the vertices")
    if report.filled + report.disconnected == 0:
        say(f"{output}: nothing was missing")
        return
    where = "" if report.start is None else f", frame {report.start} not counted"
    say(f"{output}: {shares_of(report)} of the vertices{where}")
    if report.prior_weight is not None:
        say(f"{output}: {of_training(report)}")
    if report.empty:
        say(f"{output}: nothing was observed in {report.empty} of the frames")
    long = report.hidden_long / (whole // report.completed)
    if long >= _MANY:
        say(
            f"{output}: {100 * long:.0f} % of the vertices were hidden for {LONG} frames or more; "
            "method detail, the default, preserves their shape"
        )


def shares_of(report: FileReport, **more: int) -> str:
    """Says which shares of the vertices were known and filled in; `more` are further counts."""
    whole = report.known + report.filled + report.disconnected
    counts = {
        "known": report.known,
        "filled in": report.filled,
        "disconnected": report.disconnected,
        **more,
    }
    return ", ".join(f"{what} {100 * n / whole:.3g} %" for what, n in counts.items())


def of_training(report: FileReport) -> str:
    """Says whether the training sequence was used."""
    if not report.prior_weight:
        return "the training sequence did not help and was not used"
    return (
        f"training: prior weight {report.prior_weight:.2g} on average; its shapes explain "
        f"{100 * (report.prior_share or 0):.3g} % of the residual"
    )
