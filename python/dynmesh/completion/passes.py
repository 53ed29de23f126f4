"""The frames of a sequence, completed backwards and forwards from a whole one.

On each pass, a completer uses only frames that it has already met.
"""

import contextlib
from collections.abc import Generator, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._arrays import Mask
from .._checks import check_positive
from .._errors import SettingError, locating
from .._report import Quality, few_frames, tracked
from ..completer import Completer, FrameReport, Settings
from ..frame import Frame, Frames
from ..header import Header
from ..run import Records
from .start import StartFrame
from .watched import Watched

_BLOCK = 1 << 25  # bytes of frames that are read forwards, to be completed backwards

_MOST_UNSEEN = 0.05
"""The share of vertices that no frame shows from which on a frame put together is a guess."""

_SHARED = 0.4
"""The share of the variances of the two estimates that their mean keeps. It would be a half, if
their errors were independent and equal: they are neither, and how far they disagree is added."""


def with_implied(
    given: Settings, *, bidirectional: bool, drop_above: float | None, trained: bool
) -> Settings:
    """Returns the settings of the completer, with those that others of a sequence imply."""
    if drop_above is not None:
        check_positive("drop_above", drop_above)
    if given.get("method", "detail") != "detail":
        passes = {"bidirectional": bidirectional, "drop_above": drop_above, "training": trained}
        for name, value in passes.items():
            if value not in (None, False):
                raise SettingError("is for method detail alone", argument=name, value=value)
    implied: Settings = {**given}
    if bidirectional or drop_above is not None:
        implied["uncertainty"] = True
    if bidirectional:
        implied["learn"] = given.get("learn", False) or not trained
    return implied


@dataclass
class Tally:
    """What a completion has done so far.

    Attributes:
        reports: of the frames that were completed, by their numbers; from both sides, the last one.
        seconds: that each call of the completer took.
        wrong: those that are not good by the numbers of the frames, the worst one of each, without
            those in which nothing was observed: a few of them are no reason to doubt the others.
        are_empty: whether hardly anything was observed, by the numbers of the frames.
        dropped: number of vertices that were left missing.
        seen: (k,) which vertices were known in any of the frames that were completed.
        watched: what was noticed of the known positions.
    """

    seen: Mask
    watched: Watched
    reports: dict[int, FrameReport] = field(default_factory=dict)
    seconds: list[float] = field(default_factory=list)
    wrong: dict[int, FrameReport] = field(default_factory=dict)
    are_empty: dict[int, bool] = field(default_factory=dict)
    dropped: int = 0

    def add(self, number: int, report: FrameReport, known: Mask) -> None:
        """Notes what was done for a frame; from both sides, that is reported twice."""
        self.seen |= known
        self.reports[number] = report
        self.seconds.append(report.seconds)
        self.are_empty[number] = _core.is_hardly_known(report.known, len(known))
        is_worse = report.quality == "ruined" or number not in self.wrong
        if report.known > 0 and report.quality != "good" and is_worse:
            self.wrong[number] = report


def verdict(tally: Tally, start: StartFrame, header: Header) -> tuple[Quality, str]:
    """How good the completed frames are, and why they are not good; else, it is empty."""
    ruined, doubtful = list[str](), list[str]()
    for quality, messages in (("ruined", ruined), ("doubtful", doubtful)):
        wrong = {number: one for number, one in tally.wrong.items() if one.quality == quality}
        if wrong:
            frames = few_frames(sorted(wrong), header)
            messages.append(f"in {frames}, {wrong[min(wrong)].reason}")
    if start.made is not None and start.made.doubtful:
        doubtful.append(
            "the frame that was put together is probably wrong, as its edges are far from the "
            "lengths that other frames show; look at it, and start from a template if it is"
        )
    if guessed := share_guessed(start):
        doubtful.append(
            f"{guessed:.1%} of the vertices are seen in no frame, and are a guess: look at them, "
            "or start from a template"
        )
    if 2 * sum(tally.are_empty.values()) > len(tally.are_empty):
        doubtful.append("hardly anything is known in most frames")
    parts = [
        f"{how}: {'; '.join(messages)}"
        for how, messages in (("probably ruined", ruined), ("doubtful", doubtful))
        if messages
    ]
    return ("ruined" if ruined else "doubtful" if doubtful else "good"), "; ".join(parts)


def share_guessed(start: StartFrame) -> float:
    """The share of the vertices of a frame put together that are a guess; 0 if that is small."""
    unseen = 0.0 if start.made is None else float(np.mean(~start.made.seen))
    return unseen if unseen > _MOST_UNSEEN else 0.0


def completed_frames(
    source: Frames,
    header: Header,
    start: StartFrame,
    completer: Completer,
    *,
    bidirectional: bool,
    drop_above: float | None,
    progress: bool | None = None,
) -> Generator[Frame, None, Tally]:
    """Yields the completed frames of a sequence in their order; returns what was done.

    Frames that have to wait for others are in a temporary file.

    Args:
        source: the frames.
        header: of the completed frames.
        start: the whole frame.
        completer: begins at the whole frame.
        bidirectional: whether to complete each frame from both sides.
        drop_above: the standard error above which vertices are left missing.
        progress: whether to show a bar; from both sides, a frame counts as often as it is
            completed.
    """
    watched = Watched(source, start.points, rejects=completer.settings["reject_outliers"])
    tally = Tally(np.zeros(source.n_vertices, np.bool_), watched)
    whole = start.frame(completer.dtype, completer.settings["uncertainty"])
    out, *further = passes = _passes(start.number, source.n_frames, bidirectional)
    kept = replace(header, attributes=whole.attributes())
    waiting = Records(kept, source.n_frames if bidirectional else start.number + 1)
    if start.number >= 0:
        waiting.store(start.number, whole)

    def go(way: range, origin: Frame) -> Iterator[tuple[int, Frame]]:
        """Yields the numbers and the completed frames of one pass.

        The standard errors and ages of `origin`, the whole frame that it leaves, are those of its
        estimates; they go on until a vertex is observed.
        """
        if way and completer.n_frames:
            completer.reset(origin.points)
        for number in way:
            frame = next(frames)
            with locating(frame=source.header.number(number)):
                points = completer.push(frame.points, frame.claimed)
            if number == start.number:
                continue
            tally.add(number, completer.report, completer.age == 0)
            since = completer.age >= completer.n_frames  # not observed since
            assert origin.age is not None
            age = completer.age + np.where(since, origin.age, 0)
            errors = None
            if (of_origin := origin.standard_error) is not None:
                errors = np.hypot(completer.standard_error, np.where(since, of_origin, 0))
            estimate = Frame(
                points, generation=completer.generation, age=age, standard_error=errors
            )
            yield number, estimate

    def finished(number: int, frame: Frame) -> Frame:
        """A frame with all that its errors say, and without what is left missing."""
        frame = start.add_errors(frame, number)
        if drop_above is not None:
            assert frame.standard_error is not None  # as :func:`with_implied` has set
            known = np.asarray(frame.standard_error <= drop_above)
            tally.dropped += int(np.count_nonzero(~known))
            points = np.where(known[:, None], frame.points, frame.points.dtype.type(np.nan))
            frame = replace(frame, points=points, known=known)
        return frame if header.has_standard_error else replace(frame, standard_error=None)

    with contextlib.closing(_frames(watched, source, passes)) as read:
        frames = tracked(read, sum(map(len, passes)), "completing", progress)
        for number, frame in go(out, whole):
            waiting.store(number, frame)
        if bidirectional:
            there, back = further
            for number, frame in go(there, waiting.frame(out[-1]) if out else whole):
                waiting.store(number, frame)
            for number, frame in go(back, waiting.frame(there[-1]) if there else whole):
                waiting.store(number, combined(waiting.frame(number), frame))
        for number in range(len(waiting)):
            yield finished(number, waiting.frame(number))
        if not bidirectional:
            for number, frame in go(further[0], whole):
                yield finished(number, frame)
    return tally


def _passes(number: int, n_frames: int, bidirectional: bool) -> list[range]:
    """The passes from the whole frame: backwards and forwards, or out, there and back.

    With `bidirectional`, they lead from it to the nearer end of the sequence, from there to the
    other end, and back. A template has the number -1.
    """
    before, after = range(number - 1, -1, -1), range(number + 1, n_frames)
    if not bidirectional:
        return [before, after]
    is_near_first = 2 * number < n_frames
    across = range(n_frames) if is_near_first else range(n_frames - 1, -1, -1)
    out = before if is_near_first else after
    return [out, across if number < 0 else across[1:], across[-2::-1]]


def _frames(watched: Watched, source: Frames, passes: list[range]) -> Generator[Frame, None, None]:
    """Yields the frames in the order of their completion, in constant memory."""
    block = max(1, _BLOCK // (source.n_vertices * 3 * source.dtype.itemsize))
    for way in passes:
        if way and way.step < 0:
            for end in range(way[0] + 1, way[-1], -block):
                yield from reversed(list(watched.frames(max(way[-1], end - block), end)))
        elif way:
            yield from watched.frames(way[0], way[-1] + 1)


def combined(one: Frame, other: Frame) -> Frame:
    """Returns the mean of two estimates, weighed for each vertex by how far it may be off.

    The weights are s^(-3/2) for the standard error s of a vertex, rather than s^(-2), since s is
    known roughly. A vertex that both observed exactly stays where it was observed. One that the one
    accepted and the other rejected as an outlier is where the latter estimates it.

    Args:
        one: an estimate of a frame, with generation, age and standard errors.
        other: another one of the same frame.
    """
    ages, errors, generations = (
        np.stack([getattr(frame, name) for frame in (one, other)])
        for name in ("age", "standard_error", "generation")
    )
    weights = _weights(ages, errors.astype(np.float64))
    points = np.stack([one.points, other.points]).astype(np.float64)
    mean = np.einsum("wk,wkc->kc", weights, points)
    spread = np.einsum("wk,wkc->k", weights, (points - mean) ** 2) / 3
    variance = np.einsum("wk,wk->k", weights, np.where(weights > 0, errors, 0.0) ** 2)
    observed = ages == 0
    rejected = observed.any(axis=0) & ~observed.all(axis=0)
    exact = ((errors == 0) & observed).all(axis=0)
    heavier = weights.argmax(axis=0)[None]
    return Frame(
        np.where(exact[:, None], one.points, mean).astype(one.points.dtype),
        generation=np.take_along_axis(generations, heavier, 0)[0],
        age=np.where(rejected, ages.max(axis=0), ages.min(axis=0)),
        standard_error=np.sqrt(_SHARED * variance + spread).astype(np.float32),
    )


def _weights(ages: NDArray[np.integer], errors: NDArray[np.float64]) -> NDArray[np.float64]:
    """(2, k), of which the two add up to 1."""
    rejected = (ages[::-1] > 0) & (ages == 0)  # by the other, though observed
    certain, unknown = (errors == 0) & ~rejected, np.isinf(errors)
    with np.errstate(divide="ignore"):
        weights = errors**-1.5
    weights = np.where(certain.any(axis=0), certain, np.where(rejected | unknown, 0.0, weights))
    weights[:, weights.sum(axis=0) == 0] = 1
    return np.asarray(weights / weights.sum(axis=0))
