"""What a completion did, in lines for the terminal."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from ..jobs.report import LONG, FileReport
from ..jobs.track_report import TrackFileReport
from ..jobs.unfinished import frames_kept
from .terminal import say, track

T = TypeVar("T")

_MANY = 0.01  # of the vertices


def watching(output: Path, what: str) -> Callable[[Iterator[T], int, int], Any]:
    """Returns what shows the progress of a job, which says if it begins an interrupted one anew."""
    was_unfinished = frames_kept(output) > 0

    def watch(items: Iterator[T], whole: int, done: int) -> Iterator[T]:
        if was_unfinished and not done:
            say(f"{output}: starting again")
        return track(items, whole, what, done)

    return watch


@contextmanager
def saying_what_is_kept(output: Path, made: str) -> Iterator[None]:
    """Prints what an interruption or a full disk leaves; frames are `made`, such as "completed"."""
    try:
        yield
    except BlockingIOError:  # another process is writing the output
        raise
    except (OSError, KeyboardInterrupt) as error:
        if frames_kept(output):
            say(f"{output}: {made} frames are kept; --resume continues from there")
        elif isinstance(error, KeyboardInterrupt):
            say(f"{output}: interrupted; nothing was kept")
        raise


def say_how_far(output: Path, made: str, report: FileReport | TrackFileReport) -> bool:
    """Prints what an earlier run had done; returns whether there was anything left to do."""
    if report.existed:
        say(f"{output}: already complete; --overwrite makes it anew")
        return False
    if report.resumed_at and report.seconds_per_frame is None:
        say(f"{output}: the interrupted run had already {made} every frame")
        return False
    if report.resumed_at:
        say(f"{output}: continued after {report.resumed_at} frames")
    return True


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
