"""Completion of all meshes of a scene into one file, in constant memory."""

import contextlib
import os
import shutil
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Unpack

from .. import files
from .._checks import check_callable, check_path
from .._errors import DynmeshError, InputError, SettingError
from ..files import Frame, Header, PathLike, Target, Writer
from ..files.lock import lock_folder, unfinished_folder
from ..files.masks import check_missing
from ..files.scene_files import open_mesh, open_scene
from ..files.scene_writer import SceneWriter
from ..files.scenes import Origin, Scene, every_mesh, listed
from ..settings import Settings, all_settings, takes_settings
from .checkpoint import Source
from .directions import Directions
from .file_completion import Watch, output_header, with_uncertainty
from .report import FileReport
from .start import Start, check_start, start_in
from .training import Training, TrainingFiles, check_training, files_in
from .unfinished import set_aside
from .zeros import ZeroCount


@dataclass(frozen=True)
class SceneReport:
    """What :func:`complete_scene` has done.

    Attributes:
        meshes: what was done to each completed mesh, by its path.
        failed: why each of the other meshes that move could not be completed, in one line.
        still: the paths of the meshes that do not move.
        remarks: remarks about the output for the user, one line each.
    """

    meshes: Mapping[str, FileReport]
    failed: Mapping[str, str]
    still: tuple[str, ...]
    remarks: tuple[str, ...] = ()


@takes_settings
def complete_scene(
    path: PathLike,
    output: PathLike,
    *,
    start: Start = 0,
    training: TrainingFiles | None = None,
    source: Source | None = None,
    output_format: str | None = None,
    overlay: bool = False,
    provenance: bool = False,
    drop_above: float | None = None,
    overwrite: bool = False,
    watch: Watch | None = None,
    **settings: Unpack[Settings],
) -> SceneReport:
    """Completes every mesh of a USD stage or an Alembic archive that moves, each by itself.

    If one of them cannot be completed, the others still are. From Alembic to Alembic and with
    `overlay`, the output shows the whole scene; meshes that do not move and those that cannot be
    completed are as in the input. Otherwise it holds the completed meshes alone, at their paths.
    Memory does not grow with the number of meshes or frames. The frames of one mesh at a time wait
    on disk beside the output, which appears under its name when it is complete.

    Args:
        path: a USD stage or an Alembic archive.
        output: path of the result, USD or Alembic.
        start: the number of a frame that is whole in every mesh, counted from 0, or "whole" for the
            first whole frame of each; see :func:`complete_file`.
        training: see :func:`complete_file`. A scene with the meshes at the same paths, or a file
            with the only mesh that moves.
        source: how to read the input: `format` and `missing` as in :func:`dynmesh.open`.
        output_format: "usd" or "alembic"; None means the format of the suffix.
        overlay: whether to write a USD layer that holds the completed points and what follows from
            them, with the input as its sublayer.
        provenance: whether to write the generation and the age of every vertex, and with
            `uncertainty` its standard error.
        drop_above: see :func:`complete_file`.
        overwrite: whether to replace an existing output.
        watch: called with the frames of all meshes, their number and 0; it must pass the frames on.
        **settings: `method`, `noise` and the other settings of :class:`dynmesh.Completer`, which
            explains them. The method is detail unless another one is given.

    Raises:
        FileExistsError: the output exists.
        BlockingIOError: another process is writing it.
        ValueError: no mesh can be completed; the message says why for each.
        OSError, ImportError, TypeError, ValueError: the input cannot be opened, or the output
            cannot be written; a setting is refused.
    """
    check_path("path", path)
    check_path("output", output)
    check_start(start, None)
    wanted = with_uncertainty(all_settings(settings), drop_above)
    training_files = check_training(training, wanted)
    check_callable("watch", watch)
    source = _checked(source or {})
    target = files.target_of(output, output_format, overlay=overlay)
    if not issubclass(target.writer, SceneWriter):
        raise InputError(
            "this format holds a single mesh; write all meshes of a scene to USD or Alembic",
            file=target.path,
        )
    scene = open_scene(Path(path), source.get("format"))
    if overlay and not target.keeps(scene):
        raise InputError(
            f"must be USD ({files.listed(files.formats['usd'].suffixes)}), as an overlay changes "
            "meshes in a USD stage",
            file=scene.path,
        )
    job = _Job(scene, target, start, training_files, source, provenance, wanted, drop_above)
    return job.run(overwrite=overwrite, watch=watch)


def _checked(source: Source) -> Source:
    """Refuses what can only be said of one mesh."""
    for name in ("faces", "known"):
        if source.get(name) is not None:
            raise InputError("is for one mesh; choose it by its path with prim", argument=name)
    if source.get("prim") not in (None, every_mesh):
        raise InputError(
            f"must be '{every_mesh}', not {source.get('prim')!r}; complete_file completes one mesh",
            argument="prim",
        )
    check_missing(source.get("missing"))
    return source


class _Job:
    """A completion of all meshes, while it runs."""

    def __init__(
        self,
        scene: Scene,
        target: Target,
        start: Start,
        training_files: tuple[Path, ...],
        source: Source,
        provenance: bool,
        settings: Settings,
        drop_above: float | None,
    ) -> None:
        self._scene = scene
        self._target = target
        self._start = start
        self._training_files = training_files
        self._missing = source.get("missing")
        self._provenance = provenance
        self._drop_above = drop_above
        self._settings = settings
        self._moving = tuple(mesh for mesh, moves in scene.moves.items() if moves)
        self._still = tuple(mesh for mesh, moves in scene.moves.items() if not moves)
        self._origin = Origin(scene, self._moving) if target.keeps(scene) else None
        self._reports: dict[str, FileReport] = {}
        self._failed: dict[str, str] = {}
        self._writer: SceneWriter | None = None

    def run(self, *, overwrite: bool, watch: Watch | None) -> SceneReport:
        """Completes all meshes."""
        output = self._target.path
        self._overwrite = overwrite
        if not self._moving:
            found = f"none of {listed(list(self._still))} moves" if self._still else "has no mesh"
            raise InputError(f"{found}, so there is nothing to complete", file=self._scene.path)
        training_files = files_in(self._training_files)
        self._target.check(overwrite=overwrite, reader=self._scene, others=training_files)
        lengths = self._lengths()
        folder = unfinished_folder(output)
        aside = []
        if os.path.lexists(folder) and not folder.is_dir():
            aside.append(set_aside(folder, output, f"{folder}: is not a folder"))
        with lock_folder(folder, output) as unlocked:
            try:
                with contextlib.ExitStack() as writing:
                    frames = self._frames(list(lengths), folder, writing)
                    total = sum(lengths.values())
                    for _ in frames if watch is None else watch(frames, total, 0):
                        pass
                    writer = self._writer
                    if writer is None:
                        reasons = [f"{mesh}: {why}" for mesh, why in self._failed.items()]
                        raise InputError(
                            f"no mesh can be completed: {listed(reasons, 3)}", file=self._scene.path
                        )
            finally:
                shutil.rmtree(folder, ignore_errors=True)
        remarks = (*aside, *writer.remarks, *self._remarks(), *unlocked)
        return SceneReport(self._reports, self._failed, self._still, remarks)

    def _lengths(self) -> dict[str, int]:
        """The number of frames of each mesh; a mesh that cannot be read has failed."""
        lengths = {}
        for mesh in self._moving:
            with self._noting(mesh), open_mesh(self._scene, mesh) as reader:
                lengths[mesh] = reader.n_frames
        return lengths

    def _frames(
        self, meshes: list[str], folder: Path, writing: contextlib.ExitStack
    ) -> Iterator[Frame]:
        """Completes mesh after mesh and yields each frame after its completion, as it was read."""
        spool = files.target_of(folder / "mesh.npz")
        for mesh in meshes:
            with self._noting(mesh), open_mesh(self._scene, mesh, self._missing) as reader:
                header = output_header(
                    reader.header,
                    self._settings,
                    provenance=self._provenance,
                    drop_above=self._drop_above,
                )
                start_frame = start_in(reader, self._start)
                training = Training(self._training_files, reader)
                passes = Directions(
                    reader, start_frame, self._settings, training, drop_above=self._drop_above
                )
                zeros = ZeroCount()
                with spool.create(header) as waiting:
                    completing = _completing(passes, waiting, folder / "before")
                    for number, frame in enumerate(completing):
                        zeros.add(number, frame.points, frame.known)
                        yield frame
                told = passes.tally.remarks(header.metres_per_unit)
                remarks = (*start_frame.remarks(self._settings["noise"]), *told, *zeros.hint())
                n_frames, first = header.n_frames, start_frame.number
                self._reports[mesh] = passes.tally.report(n_frames, 0, remarks, first)
            if mesh in self._reports:
                self._take_over(spool.path, header, writing)

    def _take_over(self, spool: Path, header: Header, writing: contextlib.ExitStack) -> None:
        """Writes a completed mesh to the output, which begins with the first one."""
        if self._writer is None:
            folder = spool.with_name("files")
            made = self._target.create(
                header, folder=folder, origin=self._origin, overwrite=self._overwrite
            )
            assert isinstance(made, SceneWriter)
            self._writer = writing.enter_context(made)
        else:
            self._writer.next_mesh(header)
        with files.open(spool) as reader:
            for frame in reader:
                self._writer.append(frame.points, frame.known, **frame.provenance())

    @contextlib.contextmanager
    def _noting(self, mesh: str) -> Iterator[None]:
        """Notes why this mesh cannot be completed; errors of settings are about all meshes."""
        try:
            yield
        except SettingError:
            raise
        except DynmeshError as error:
            training_file = error.file if error.file in self._training_files else None
            place = type(error)(
                error.reason, argument=error.argument, frame=error.frame, file=training_file
            )
            self._failed[mesh] = str(place)
        except (ValueError, TypeError) as error:
            self._failed[mesh] = str(error)

    def _remarks(self) -> Iterator[str]:
        """Yields what became of everything else in the scene."""
        if self._origin is not None:
            if self._still:
                yield f"meshes that do not move are as they were: {listed(list(self._still))}"
            return
        lost = "the transforms, materials and other objects of the scene"
        if self._still:
            lost += f" and the meshes that do not move ({listed(list(self._still))})"
        has_overlay = files.formats[self._scene.format].overlay is not None
        advice = "as .abc, it would keep them"
        if has_overlay:
            is_usd = self._target.format == self._scene.format
            advice = (
                "--overlay keeps them" if is_usd else "as USD with --overlay, it would keep them"
            )
        yield f"holds the completed meshes without {lost}; {advice}"


def _completing(passes: Directions, writer: Writer, waiting: Path) -> Iterator[Frame]:
    """Completes all frames of a mesh and yields each after its completion, as it was read."""
    read: list[Frame] = []

    def noted(frames: Iterator[Frame]) -> Iterator[Frame]:
        for frame in frames:
            read.append(frame)
            yield frame

    with contextlib.closing(passes.frames()) as frames:
        for _ in passes.steps(noted(frames), writer, waiting):
            yield from read
            read.clear()
