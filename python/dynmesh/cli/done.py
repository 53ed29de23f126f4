"""What a completion did, in lines for the terminal."""

from pathlib import Path

from ..jobs.file_completion import FileReport
from .terminal import say


def say_what_was_done(output: Path | str, report: FileReport, reject_outliers: bool) -> None:
    """Prints how many frames were completed, how fast, and the shares of the vertices."""
    seconds = report.seconds_per_frame
    if seconds is None:
        say(f"{output}: there is only frame 0, so there was nothing to complete")
        return
    done = report.frames - max(1, report.resumed_at)
    say(
        f"{output}: {done} frames completed in {1e3 * seconds:.3g} ms each (median), "
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
    say(f"{output}: {shares} of the vertices after frame 0")
