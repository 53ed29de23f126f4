"""Completion of a sequence, in constant memory."""

import contextlib
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal

import numpy as np

from .._arrays import Mask
from .._checks import check_flags
from .._errors import InputError, naming
from .._options import Input, Method
from .._report import Quality, Report, counted, listed, percent, some_of
from ..completer import Completer
from ..completion.passes import (
    Tally,
    completed_frames,
    share_guessed,
    verdict,
    with_implied,
)
from ..completion.start import (
    Start,
    StartFrame,
    Training,
    TrainingFrames,
    check_start,
    open_with_template,
    start_in,
)
from ..formats import OneSequence
from ..formats.times import index_of
from ..formats.usd_stage import UsdMeshes
from ..frame import Frame, Frames
from ..polygons import Faces
from ..run import Run
from ..sequence import result_of
from ..topology import edges_of


@dataclass(frozen=True, kw_only=True)
class MeshesReport(Report):
    """What was done to complete several meshes.

    Attributes:
        frames: number of frames.
        meshes: the report of each, by its path.
    """

    frames: int
    meshes: Mapping[str, Any]

    def lines(self) -> list[str]:
        """Says what was done for each mesh."""
        done = {name: replace(one, reason="", remarks=()) for name, one in self.meshes.items()}
        every = [f"{name}: {line}" for name, one in done.items() for line in one.lines()]
        return [*every, *super().lines()]


class CompletedMeshes(Run[MeshesReport]):
    """The meshes together as they are completed, one frame after another.

    A format that writes a layer makes each of them on its own, by :attr:`Frames.each`.
    """

    def __init__(
        self,
        source: UsdMeshes,
        complete: Callable[[Frames], Run[Any]],
        close: Callable[[], object],
    ) -> None:
        moving = {name: one for name, one in source.each.items() if one.n_frames > 1}
        with_holes = [name for name, one in moving.items() if _has_holes(one)]
        runs = {name: complete(moving[name]) for name in with_holes or moving}
        if not runs:
            message = f"none of its meshes has more than one frame: {some_of([*source.each])}"
            raise InputError(message, file=source.path)
        self._whole = [name for name in source.each if name not in runs]
        names = {name for run in runs.values() for name in run.header.attributes}
        header = replace(source.header, attributes=names, standard_error_of="position")

        def make() -> Iterator[Frame]:
            if any(run.n_frames != source.n_frames for run in runs.values()):
                message = "its meshes have other frames than one another; write a layer of USD"
                raise InputError(message, file=source.path)
            for number, frames in enumerate(zip(*runs.values(), strict=True)):
                yield source.placed(number, dict(zip(runs, frames, strict=True)), names)

        super().__init__(header, make, source, close=close)
        self.each = runs

    @property
    def report(self) -> MeshesReport:
        """What was done, as soon as all meshes are completed."""
        reports: dict[str, Any] = {name: run.report for name, run in self.each.items()}
        order: tuple[Quality, ...] = ("good", "doubtful", "ruined", "failed")
        told = [f"{name}: {one.reason}" for name, one in reports.items() if one.reason]
        remarks = [f"{name}: {line}" for name, one in reports.items() for line in one.remarks]
        if self._whole:
            remarks.append(f"nothing is missing of {listed(self._whole)}, left as it is")
        return MeshesReport(
            quality=max((one.quality for one in reports.values()), key=order.index),
            reason="; ".join(told),
            remarks=tuple(remarks),
            frames=self.n_frames,
            meshes=reports,
        )


def _has_holes(frames: Frames) -> bool:
    with closing(frames.frames()) as every:
        return any(not frame.observed.all() for frame in every)


@dataclass(frozen=True, kw_only=True)
class CompletionReport(Report):
    """What :func:`complete` has done.

    Attributes:
        frames: number of frames.
        start: the number, in its file, of the whole frame from which completion started; None for a
            template.
        completed: number of frames that were completed.
        calls: number of calls of :meth:`dynmesh.Completer.push` for them; from both sides, about
            twice as many.
        seconds_per_frame: median time of such a call, without reading and writing; None if there
            was nothing to complete.
        known: number of known vertices, summed over these frames. A whole frame from which
            completion starts is not among them.
        filled: number of vertices that were filled in.
        disconnected: number of vertices that no edges connected to a known one.
        rejected: number of vertices that were observed but treated as missing: see
            `reject_outliers`; held ones are not among them.
        held: number of known positions that are held, as `reject_outliers` explains.
        empty: number of frames of which hardly anything was observed.
        prior_weight: with training, how far its poses were used, from 0 to 1, on average over the
            frames in which some vertices were known and others missing; None if there are none.
        prior_share: the share of the residual that its poses explain, over the same frames.
        dropped: the number of vertices that were left missing, since their standard error exceeds
            `drop_above`.
    """

    frames: int
    start: float | None
    completed: int
    calls: int
    seconds_per_frame: float | None
    known: int
    filled: int
    disconnected: int
    rejected: int
    held: int = 0
    empty: int = 0
    prior_weight: float | None = None
    prior_share: float | None = None
    dropped: int = 0

    def lines(self) -> list[str]:
        """Says how many frames were completed, how fast, and the shares of the vertices."""
        return [*self._done(), *super().lines()]

    def _done(self) -> Iterator[str]:
        if self.seconds_per_frame is None:
            yield "there is only one frame, so no other was completed"
            return
        is_of_both = self.calls > self.completed
        how, each = (" from both sides", "for each side") if is_of_both else ("", "each")
        rate = self.completed / (self.calls * self.seconds_per_frame)
        good = "good; " if self.quality == "good" else ""
        yield (
            f"{good}{counted(self.completed, 'frame')} completed{how} in "
            f"{1e3 * self.seconds_per_frame:.3g} ms {each} (median), "
            f"{rate:.0f} frames per second without reading and writing"
        )
        whole = self.known + self.filled + self.disconnected
        if self.rejected:
            yield f"{100 * self.rejected / whole:.3g} % of the vertices were rejected as outliers"
        if self.filled + self.disconnected == 0:
            yield "nothing was missing"
            return
        known, filled, disconnected = (
            f"{100 * count / whole:.3g} %" for count in (self.known, self.filled, self.disconnected)
        )
        where = "" if self.start is None else f", frame {self.start} not counted"
        shares = f"known {known}, filled in {filled}, disconnected {disconnected}"
        yield f"{shares} of the vertices{where}"
        if self.prior_weight == 0:
            yield "the training frames did not help and were not used"
        elif self.prior_weight is not None:
            yield (
                f"training: prior weight {self.prior_weight:.2g} on average; its shapes explain "
                f"{100 * (self.prior_share or 0):.3g} % of the residual"
            )
        if self.empty:
            yield f"hardly anything was observed in {self.empty} of the frames"
        if self.dropped:
            yield (
                f"{counted(self.dropped, 'vertex')} left missing, all frames together, since "
                "their standard error is too large"
            )


def complete(
    sequence: OneSequence,
    faces: Faces | None = None,
    *,
    start: Input[Start] = "auto",
    template: Input[OneSequence | None] = None,
    method: Method[Literal["motion", "detail"]] = "detail",
    noise: Method[float | None] = None,
    reject_outliers: Method[bool] = False,
    training: Method[TrainingFrames | None] = None,
    learn: Method[bool] = False,
    bidirectional: Method[bool] = False,
    threads: Method[int] = 1,
    uncertainty: Method[bool] = False,
    drop_above: Method[float | None] = None,
    progress: bool | None = None,
) -> Run[Any] | Any:
    """Completes a sequence, from a whole frame backwards and forwards.

    No frame need be whole: if none is, completion starts at the one with most vertices. Vertices
    that it lacks are put together from the other frames, and the result is doubtful if that is
    probably wrong. It is probably ruined if many edges become four times as long or as short. A USD
    file completed into another one becomes a layer over it, which keeps everything else; of several
    meshes, each has a completer of its own, and those of which nothing is missing stay as they are.
    The output appears under its name when it is complete.

    Args:
        sequence: the incomplete sequence: a file, frames, a sequence in memory, positions (n, k, 3)
            or meshes; what was estimated in those that were completed before is estimated again.
            Masks of arrays and meshes are those of a :class:`dynmesh.Sequence` of them.
        faces: of positions alone.
        start: the frame from which completion starts: "auto", the first without missing vertices,
            else the best; "best", which knows most vertices; or the number of a frame.
        template: a whole mesh, from which completion starts instead; it stands before frame 0, and
            provides the faces of a file that holds none.
        method: "detail" preserves the local shape, rotated with the motion; "motion" averages
            motion vectors as in the paper, and is fast.
        noise: standard deviation of the noise of known positions, in their unit, which are then
            smoothed; without it, they are exact.
        reject_outliers: whether known vertices count as missing that do not move like those around
            them, or are held: a sensor repeats their last position, bit for bit, while the surface
            beside them moves.
        training: complete frames of the same mesh, such as a range-of-motion recording, from which
            method detail learns how it varies; one file or several.
        learn: whether to learn from the completed frames; twice as slow.
        bidirectional: whether to complete each frame from both sides, which lowers errors by a
            quarter and takes two to four times as long; without `training`, implies `learn`.
        threads: the number of threads that may work on a frame; more than one helps from 23 553
            vertices on.
        uncertainty: whether to estimate the standard error of each vertex, which a file then has to
            hold; `bidirectional` estimates it, too.
        drop_above: leave vertices missing whose standard error exceeds this distance, in the unit
            of the positions.
        progress: whether to show on standard error how far it is; None for what takes long, in a
            terminal.

    Returns:
        The completed frames with the generation and age of their vertices, and what was done as
        their `report`: a :class:`dynmesh.Sequence` of frames in memory; of others, a
        :class:`dynmesh.frames.Run`, whose frames are made when they are gone through.
    """
    given: Any = {
        "method": method,
        "noise": noise,
        "reject_outliers": reject_outliers,
        "learn": learn,
        "threads": threads,
        "uncertainty": uncertainty,
    }
    ways: Any = {"bidirectional": bidirectional, "drop_above": drop_above}
    check_start(start, template)
    check_flags(bidirectional=bidirectional)
    settings = with_implied(given, trained=training is not None, **ways)
    Completer([[0, 1, 2]], np.eye(3), **settings)  # which refuses settings before any work is done
    with contextlib.ExitStack() as stack:
        source, first = stack.enter_context(open_with_template(sequence, template, faces))
        if isinstance(source, UsdMeshes):
            for name, value in (("template", template), ("training", training)):
                if value is not None:
                    message = "is of one mesh, but there are several; choose one by `prim`"
                    raise InputError(message, argument=name)
            one = partial(complete, start=start, progress=progress, **given, **ways)
            return CompletedMeshes(source, one, stack.pop_all().close)
        if isinstance(start, int | np.integer):
            with naming(source.path):
                index_of(source.header, start, "start")
        learnt = Training(training, source, progress)
        more = ["known"] * (drop_above is not None)
        more += ["standard_error"] * (uncertainty or bidirectional)
        states = source.header if first is None or first.header is None else first.header
        header = replace(
            source.header,
            up_axis=source.header.up_axis or states.up_axis,
            metres_per_unit=source.header.metres_per_unit or states.metres_per_unit,
            polygons=source.header.polygons if first is None else first.polygons,
            attributes=["generation", "age", *more],
            standard_error_of="position",
        )
        origin = source.origin if first is None else first.origin

        def make() -> Generator[Frame, None, CompletionReport]:
            with naming(source.path):
                whole = first or start_in(source, start, settings, progress=progress)
                with learnt.frames() as poses:
                    completer = Completer(source.faces, whole.points, training=poses, **settings)
                tally = yield from completed_frames(
                    source, header, whole, completer, progress=progress, **ways
                )
            return _report(source, whole, tally, is_trained=bool(learnt))

        run: Run[CompletionReport] = Run(
            header,
            make,
            source,
            origin=None if origin is None else origin.below(),
            files=[*(first.files if first else ()), *learnt.files],
            wanted=["standard_error"] if uncertainty else [],
            close=stack.pop_all().close,
        )
    return result_of(run, source)


def _report(
    source: Frames, whole: StartFrame, tally: Tally, *, is_trained: bool
) -> CompletionReport:
    reports = [*tally.reports.values()]
    estimated = [one for one in reports if one.known and one.filled] if is_trained else []
    counts = ("known", "filled", "disconnected", "rejected")
    quality, reason = verdict(tally, whole, source.header)
    return CompletionReport(
        quality=quality,
        reason=reason,
        remarks=(
            *whole.remarks(source.header),
            *tally.watched.remarks(),
            *(_of_unseen(source, tally.seen) if reports and not share_guessed(whole) else ()),
        ),
        frames=source.n_frames,
        start=whole.number_in(source.header),
        completed=len(reports),
        calls=len(tally.seconds),
        seconds_per_frame=float(np.median(tally.seconds)) if reports else None,
        **{name: sum(getattr(one, name) for one in reports) for name in counts},
        held=tally.watched.held.count,
        empty=sum(tally.are_empty.values()),
        prior_weight=float(np.mean([one.prior_weight for one in estimated])) if estimated else None,
        prior_share=float(np.mean([one.prior_share for one in estimated])) if estimated else None,
        dropped=tally.dropped,
    )


def _of_unseen(source: Frames, seen: Mask) -> Iterator[str]:
    """Yields which share of the vertices only estimates describe, if some are in patches."""
    edges = edges_of(source.faces, len(seen))
    is_near = seen.copy()
    is_near[edges[seen[edges].any(axis=1)]] = True
    if not is_near.all():
        n = int(np.count_nonzero(~seen))
        yield (
            f"{counted(n, 'vertex')}, {percent(n / len(seen))} of all, are known in no frame that "
            "was completed: nothing corrects their estimates, which may be far off; look at them, "
            "or use training frames"
        )
