"""Several meshes of a scene, each completed by a completer of its own."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, replace
from typing import Any

from .._errors import InputError
from .._report import Quality, Report, listed, some_of
from ..formats.usd_stage import UsdMeshes
from ..frame import Frame, Frames
from ..run import Run


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
    """Whether a vertex is missing in a frame."""
    with closing(frames.frames()) as every:
        return any(not frame.observed.all() for frame in every)
