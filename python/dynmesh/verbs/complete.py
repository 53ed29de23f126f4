"""Completion from file to file, in constant memory."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from .._checks import check_flags, check_path
from .._command import How, Output, What
from .._report import OutputReport, counted
from ..completer import Completer
from ..completion.start import Start, check_start, open_with_template, start_in
from ..completion.training import Training, TrainingFiles, paths_of
from ..completion.ways import SequenceSettings, complete_frames, verdict, with_implied
from ..files import PathLike, Source, named_like, naming, target_over
from ..files.header import MeshFile

_FEW = 0.2
"""A separate mask that knows a smaller share in most frames may be inverted."""


@dataclass(frozen=True, kw_only=True)
class FileReport(OutputReport):
    """What :func:`complete_file` has done: it wrote `frames` frames to the file `output`.

    Attributes:
        start: the number, in its file, of the whole frame from which completion started; None for a
            template.
        completed: number of frames that were completed; from both sides, each counts twice.
        seconds_per_frame: median time of :meth:`dynmesh.Completer.push`, without reading and
            writing; None if there was nothing to complete.
        known: number of known vertices, summed over these frames. A whole frame from which
            completion starts is not among them.
        filled: number of vertices that were filled in.
        disconnected: number of vertices that no edges connected to a known one.
        rejected: number of vertices that were observed but treated as missing: see
            `reject_outliers`.
        empty: number of frames in which nothing was observed.
        prior_weight: with training, how far its poses were used, from 0 to 1, on average over the
            frames in which some vertices were known and others missing; None if there are none.
        prior_share: the share of the residual that its poses explain, over the same frames.
        dropped: the number of vertices that were left missing, since their standard error exceeds
            `drop_above`.
    """

    start: float | None
    completed: int
    seconds_per_frame: float | None
    known: int
    filled: int
    disconnected: int
    rejected: int
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
        frames = min(self.completed, self.frames - (self.start is not None))
        sides = self.completed > frames
        how, each = (" from both sides", "for each side") if sides else ("", "each")
        rate = frames / (self.completed * self.seconds_per_frame)
        yield (
            f"{counted(frames, 'frame')} completed{how} in "
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
            yield f"nothing was observed in {self.empty} of the frames"
        if self.dropped:
            yield (
                f"{self.dropped} vertices were left missing, all frames together: their standard "
                "error is too large"
            )


def complete_file(
    path: PathLike,
    output: PathLike,
    *,
    start: What[Start] = "auto",
    template: What[PathLike | None] = None,
    source: Source | None = None,
    method: How[Literal["detail", "motion"]] = "detail",
    noise: How[float | None] = None,
    reject_outliers: How[bool] = False,
    training: How[TrainingFiles | None] = None,
    learn: How[bool] = False,
    bidirectional: How[bool] = False,
    threads: How[int] = 1,
    uncertainty: Output[bool] = False,
    provenance: Output[bool | None] = None,
    drop_above: Output[float | None] = None,
    overwrite: Output[bool] = False,
    progress: bool = False,
) -> FileReport:
    """Fills in the missing vertices of every frame of a file.

    Each frame is completed from itself and from those between it and a whole frame, from which
    completion starts; frames before that are completed backwards. No frame need be whole: what the
    first one lacks is put together from the others, and the result is doubtful if that is probably
    wrong. It is probably ruined if many edges become four times as long or as short. A USD file
    completed into another one becomes a layer over it, which keeps everything else. The output
    appears under its name when it is complete.

    Args:
        path: the incomplete sequence: a file, a folder, or a pattern such as 'scans/*.ply'.
        output: the completed sequence.
        start: the frame from which completion starts: "auto", the first without missing vertices,
            else the best; "best", which knows most vertices; or the number of a frame.
        template: a whole mesh, from which completion starts instead; it stands before frame 0, and
            provides the faces of a file that holds none.
        source: how to read `path`.
        method: "detail" preserves the local shape, rotated with the motion; "motion" averages
            motion vectors as in the paper, and is fast.
        noise: standard deviation of the noise of known positions, in their unit, which are then
            smoothed; without it, they are exact.
        reject_outliers: whether known vertices that do not move like those around them count as
            missing.
        training: complete frames of the same mesh, such as a range-of-motion recording, from which
            method detail learns how it varies; one file or several.
        learn: whether to learn from the completed frames; twice as slow.
        bidirectional: whether to complete each frame from both sides, which lowers errors by a
            quarter and takes two to four times as long; estimates standard errors and,
            without `training`, implies `learn`.
        threads: the number of threads that may work on a frame; more than one helps from 23 553
            vertices on.
        uncertainty: whether to write the standard error of each vertex; implies `provenance`.
        provenance: whether to write how many edges each vertex is from an observed one
            (generation), and for how many frames it was not observed (age); else, if the format can
            hold them. A file that has them can be completed again: what was estimated is then
            estimated again. The result of such a file has them, too.
        drop_above: leave vertices missing whose standard error exceeds this distance, in the unit
            of the positions.
        overwrite: whether to replace an existing output.
        progress: whether to show on standard error how far it is.

    Raises:
        FileExistsError: the output exists.
        BlockingIOError: another process is writing it.
        OSError, ImportError, TypeError, ValueError: a file cannot be read or written, an argument
            is refused, or the template or a training frame is not whole or has another mesh.
    """
    for name, file in {"path": path, "output": output, "template": template}.items():
        if file is not None or name != "template":
            check_path(name, file)
    check_start(start, template)
    check_flags(bidirectional=bidirectional, overwrite=overwrite)
    if provenance is not None:
        check_flags(provenance=provenance)
    training_files = paths_of(training)
    given: SequenceSettings = {
        "method": method,
        "noise": noise,
        "reject_outliers": reject_outliers,
        "learn": learn,
        "uncertainty": uncertainty,
        "threads": threads,
        "bidirectional": bidirectional,
        "drop_above": drop_above,
    }
    settings = with_implied(given, trained=bool(training_files))
    target = target_over(path, named_like(path, output))
    named = [Path(path), *training_files, *([] if template is None else [Path(template)])]
    target.check(overwrite=overwrite, others=filter(Path.is_file, named))
    asked = bool(provenance or uncertainty)
    target.check_holds(["generation"] if asked else [])
    if provenance is None:
        provenance = target.writer.keeps_provenance
    with open_with_template(path, template, source or {}) as (reader, first):
        learnt = Training(training_files, reader, progress)
        others = [*(first.files if first else ()), *learnt.files]
        target.check(overwrite=overwrite, reader=reader, others=others)
        header = replace(
            reader.header,
            has_known=drop_above is not None,
            has_provenance=asked or provenance or reader.has_provenance,
            has_standard_error=asked and settings["uncertainty"],
            standard_error_of="position",
            mesh_file=MeshFile(Path(path), ()) if target.is_overlay else reader.header.mesh_file,
        )
        header, lost = target.holding(header)
        with target.create(header, overwrite=overwrite) as writer, naming(Path(path)):
            whole = first or start_in(reader, start, settings, progress=progress)
            with learnt.frames() as frames:
                completer = Completer(reader.faces, whole.points, training=frames, **settings)
            tally = complete_frames(
                reader, whole, completer, writer, given, folder=writer.folder, progress=progress
            )
    reports = tally.reports
    estimated = [one for one in reports if one.known and one.filled] if training_files else []
    counted = ("known", "filled", "disconnected", "rejected")
    at = whole.number_in(reader.header)
    quality, reason = verdict(tally, whole, reader.header)
    return FileReport(
        quality=quality,
        reason=reason,
        remarks=(
            *writer.remarks,
            *lost,
            *whole.remarks(reader.header),
            *_of_mask(source or {}, [one.known / reader.n_vertices for one in reports]),
        ),
        output=Path(output),
        frames=reader.n_frames,
        start=at,
        completed=len(reports),
        seconds_per_frame=float(np.median([one.seconds for one in reports])) if reports else None,
        **{name: sum(getattr(one, name) for one in reports) for name in counted},
        empty=len(tally.empty),
        prior_weight=float(np.mean([one.prior_weight for one in estimated])) if estimated else None,
        prior_share=float(np.mean([one.prior_share for one in estimated])) if estimated else None,
        dropped=tally.dropped,
    )


def _of_mask(source: Source, shares: list[float]) -> Iterator[str]:
    """Yields what is probably wrong with a separate mask, of which frames know these shares."""
    share = float(np.median(shares or [1.0]))
    if source.get("known") is not None and share < _FEW:
        yield f"only {share:.0%} are known in most frames: is the mask inverted?"
