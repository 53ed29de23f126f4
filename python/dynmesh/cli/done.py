"""What a completion did, in lines for the terminal."""

from pathlib import Path

from ..jobs.report import LONG, FileReport
from .terminal import say

_MANY = 0.01  # of the vertices


def say_what_was_done(output: Path | str, report: FileReport, reject_outliers: bool) -> None:
    """Prints how many frames were completed, how fast, and the shares of the vertices."""
    seconds = report.seconds_per_frame
    if seconds is None:
        say(f"{output}: there is only frame 0, so there was nothing to complete")
        return
    say(
        f"{output}: {report.completed} frames completed in {1e3 * seconds:.3g} ms each (median), "
        f"{1 / seconds:.0f} frames per second without reading and writing"
    )
    whole = report.known + report.filled + report.unseen
    if reject_outliers:
        share = 100 * report.rejected / whole
        say(f"{output}: {report.rejected} outliers rejected, {share:.3g} % of the vertices")
    if report.filled + report.unseen == 0:
        say(f"{output}: nothing was missing")
        return
    counts = {"known": report.known, "filled in": report.filled, "unseen": report.unseen}
    shares = ", ".join(f"{what} {100 * n / whole:.3g} %" for what, n in counts.items())
    where = {-1: "", 0: " after frame 0"}.get(report.start, f" beside frame {report.start}")
    say(f"{output}: {shares} of the vertices{where}")
    if report.trust is not None:
        say(f"{output}: {of_rehearsal(report)}")
    if report.empty:
        say(f"{output}: nothing was observed in {report.empty} of the frames")
    long = report.hidden_long / (whole // report.completed)
    if long >= _MANY:
        say(
            f"{output}: {100 * long:.0f} % of the vertices were hidden for {LONG} frames or more; "
            "--method detail keeps their shape"
        )


def of_rehearsal(report: FileReport) -> str:
    """Says whether the rehearsal was used."""
    if not report.trust:
        return "the rehearsal did not help and was not used"
    return (
        f"rehearsal: trusted {100 * report.trust:.3g} % on average; its poses explain "
        f"{100 * (report.explained or 0):.3g} % of the residual"
    )
