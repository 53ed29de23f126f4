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
from ..files import Frame, Header, PathLike, Source, Target
from ..files.lock import lock_folder, unfinished_folder
from ..files.masks import check_missing
from ..files.scene_files import open_mesh, open_scene
from ..files.scene_writer import SceneWriter
from ..frames.scenes import Origin, Scene, every_mesh, listed
from .completion_options import CompletionOptions, SceneKeywords, completion_options
from .directions import Directions, Watch
from .option import paths_of, takes
from .report import FileReport
from .start import start_in
from .training import Training, files_in
from .unfinished import set_aside
from .zeros import ZeroCount

_FOR_ONE_MESH = "is for one mesh; choose it by its path with prim"


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


@takes(CompletionOptions, "template", "fps")
def complete_scene(
    path: PathLike,
    output: PathLike,
    *,
    overwrite: bool = False,
    watch: Watch | None = None,
    **options: Unpack[SceneKeywords],
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
        start: the frame of each mesh from which its completion starts; see :func:`complete_file`.
        training: see :func:`complete_file`. A scene with the meshes at the same paths, or a file
            with the only mesh that moves.
        source: how to read the input: `format` and `missing` as in :func:`dynmesh.open`.
        output_format: "usd" or "alembic"; None means the format of the suffix.
        overlay: see :func:`complete_file`.
        bidirectional: see :func:`complete_file`.
        provenance: see :func:`complete_file`.
        drop_above: see :func:`complete_file`.
        overwrite: whether to replace an existing output.
        watch: called with the frames of all meshes, their number and 0; it must pass the frames on.
        **options: those above, and `method`, `noise` and the other settings of
            :class:`dynmesh.Completer`, which explains them. The method is detail unless another one
            is given.

    Raises:
        FileExistsError: the output exists.
        BlockingIOError: another process is writing it.
        ValueError: no mesh can be completed; the message says why for each.
        OSError, ImportError, TypeError, ValueError: the input cannot be opened, or the output
            cannot be written; a setting is refused.
    """
    check_path("path", path)
    check_path("output", output)
    check_callable("watch", watch)
    return complete_meshes(
        Path(path), Path(output), completion_options(options), overwrite, watch=watch
    )


def complete_meshes(
    path: Path,
    output: Path,
    options: CompletionOptions,
    overwrite: bool,
    *,
    watch: Watch | None = None,
) -> SceneReport:
    """As :func:`complete_scene`, with an object for the options."""
    of_one_mesh = [name for name in ("fps", "template") if getattr(options, name) is not None]
    for name in (*of_one_mesh, *options.changed):
        raise InputError(_FOR_ONE_MESH, argument=name, file=path)
    options = options.checked()
    _check_source(options.source)
    target = files.target_of(output, options.output_format, overlay=options.overlay)
    if not issubclass(target.writer, SceneWriter):
        raise InputError(
            "this format holds a single mesh; write all meshes of a scene to USD or Alembic",
            file=target.path,
        )
    scene = open_scene(path, options.source.get("format"))
    if options.overlay and not target.keeps(scene):
        raise InputError(
            f"must be USD ({files.listed(files.formats['usd'].suffixes)}), as an overlay changes "
            "meshes in a USD stage",
            file=scene.path,
        )
    return _Job(scene, target, options).run(overwrite=overwrite, watch=watch)


def _check_source(source: Source) -> None:
    """Refuses what can only be said of one mesh."""
    for name in ("faces", "known"):
        if source.get(name) is not None:
            raise InputError(_FOR_ONE_MESH, argument=name)
    if source.get("prim") not in (None, every_mesh):
        raise InputError(
            f"must be '{every_mesh}', not {source.get('prim')!r}; complete_file completes one mesh",
            argument="prim",
        )
    check_missing(source.get("missing"))


class _Job:
    """A completion of all meshes, while it runs."""

    def __init__(self, scene: Scene, target: Target, options: CompletionOptions) -> None:
        self._scene = scene
        self._target = target
        self._options = options
        self._training_files = paths_of(options.training)
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
        options = self._options
        missing = options.source.get("missing")
        for mesh in meshes:
            with self._noting(mesh), open_mesh(self._scene, mesh, missing) as reader:
                header = options.header(reader.header)
                start_frame = start_in(reader, options)
                training = Training(self._training_files, reader)
                read: list[Frame] = []
                zeros = ZeroCount()
                watch = _collecting(read, zeros)
                passes = Directions(reader, start_frame, options, training, watch=watch)
                with spool.create(header) as waiting:
                    for _ in passes.steps(waiting, folder):
                        yield from read
                        read.clear()
                told = passes.tally.remarks(header.metres_per_unit)
                doubts = start_frame.remarks(header, options.settings["noise"])
                remarks = (*doubts, *told, *zeros.hint())
                self._reports[mesh] = passes.tally.report(
                    header.n_frames,
                    0,
                    remarks,
                    start_frame.number_in(header),
                    start_frame.doubtful,
                )
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
                self._writer.append(frame.points, **frame.attributes())

    @contextlib.contextmanager
    def _noting(self, mesh: str) -> Iterator[None]:
        """Notes why this mesh cannot be completed; errors of settings are about all meshes."""
        try:
            yield
        except SettingError:
            raise
        except DynmeshError as error:
            error.file = error.file if error.file in self._training_files else None
            self._failed[mesh] = str(error)
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
        if files.formats[self._scene.format].overlay is None:
            advice = "as .abc, it would keep them"
        elif self._target.format == self._scene.format:
            advice = "--overlay keeps them"
        else:
            advice = "as USD with --overlay, it would keep them"
        yield f"holds the completed meshes without {lost}; {advice}"


def _collecting(read: list[Frame], zeros: ZeroCount) -> Watch:
    """Notes the frames of a mesh when they are read, and counts their zeros."""

    def watch(frames: Iterator[Frame], *_: int) -> Iterator[Frame]:
        for frame in zeros.watch(frames):
            read.append(frame)
            yield frame

    return watch
