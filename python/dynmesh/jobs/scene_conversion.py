"""Conversion of all meshes of a scene into one file, in constant memory."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple, TypeAlias, cast

import numpy as np

from .._errors import InputError
from ..files import Frame, Header, Reader, Source, Target
from ..files.conversion import Conversion
from ..files.scene_files import naming_mesh, open_if_whole, open_mesh
from ..files.scene_writer import SceneWriter
from ..frames.scenes import Origin, Scene, every_mesh, listed
from ..frames.times import frame_seconds
from .conversion_options import ConversionOptions

Watch: TypeAlias = Callable[[Iterable[Frame], int], Iterable[Frame]]


@dataclass(frozen=True)
class ConversionReport:
    """What :func:`convert_file` has done.

    Attributes:
        frames: number of frames in the output; of a scene, those of its longest mesh.
        vertices: number of vertices of each; of a scene, those of all meshes.
        remarks: remarks about the output for the user, one line each.
        meshes: the paths of the meshes, if those of a whole scene were converted.
    """

    frames: int
    vertices: int
    remarks: tuple[str, ...] = ()
    meshes: tuple[str, ...] = ()


class _Mesh(NamedTuple):
    reader: Reader
    header: Header
    conversion: Conversion


def whole_scene(path: Path, source: Source, target: Target) -> Scene | None:
    """Opens the scene of a file if it has several meshes, none is chosen, and all can be written.

    Raises:
        ValueError: all meshes are asked for, but the output holds one.
    """
    prim = source.get("prim")
    if prim not in (None, every_mesh):
        return None
    if not issubclass(target.writer, SceneWriter):
        if prim == every_mesh:
            raise InputError(
                f"{target.format} holds a single mesh, and not those of a scene; name one with "
                "--prim (in Python, source={'prim': PATH}), or write USD or Alembic",
                file=target.path,
            )
        return None
    return open_if_whole(path, source)


def convert_scene(
    scene: Scene,
    target: Target,
    asked: ConversionOptions,
    source: Source,
    *,
    overwrite: bool,
    watch: Watch,
) -> ConversionReport:
    """Converts all meshes as :func:`dynmesh.convert_file` does one.

    In a scene that the output keeps, meshes that do not move are as they were.
    """
    target.check(overwrite=overwrite, reader=scene)
    moving = [mesh for mesh, moves in scene.moves.items() if moves]
    meshes = dict(_opened(scene, moving, asked, source))
    first, *_ = meshes.values()
    keeps = target.keeps(scene)
    origin = (
        Origin(scene, tuple(moving)) if keeps and moving and not first.conversion.moves else None
    )
    written = meshes if origin is None else {mesh: meshes[mesh] for mesh in moving}
    total = sum(mesh.header.n_frames for mesh in written.values())
    with target.create(first.conversion.header, origin=origin, overwrite=overwrite) as made:
        writer = cast(SceneWriter, made)
        for _ in watch(_frames(written, writer), total):
            pass
    remarks = [*writer.remarks, *first.conversion.remarks(target, None)]
    if origin is None:
        remarks.append(
            "holds the meshes alone, each in its own space, without the transforms, materials and "
            "other objects of the scene"
        )
    headers = [mesh.conversion.header for mesh in meshes.values()]
    return ConversionReport(
        max(header.n_frames for header in headers),
        sum(header.n_vertices for header in headers),
        tuple(remarks),
        tuple(scene.moves),
    )


def _opened(
    scene: Scene, moving: list[str], asked: ConversionOptions, source: Source
) -> Iterator[tuple[str, _Mesh]]:
    """Opens all meshes, those that move first, which are shown from the first frame of the others.

    Raises:
        ValueError: a mesh cannot be read or converted, or the meshes have different frames, but are
            to have other ones.
    """
    still = [mesh for mesh in scene.moves if mesh not in moving]
    lead: Header | None = None
    seconds = None
    for mesh in (*moving, *still):
        moves = mesh in moving
        own = asked if moves else replace(asked, frames=None, fps=None, retime=None)
        with naming_mesh(mesh):
            reader = own.stated(open_mesh(scene, mesh, source.get("missing")))
            header = replace(reader.header, fps=own.fps or reader.fps)
            conversion = own.conversion(header, scene.path)
        if moves and (asked.fps or asked.retime):
            times = frame_seconds(reader.header)
            if seconds is not None and not np.array_equal(seconds, times):
                raise InputError(
                    f"the meshes have different frames, those of {mesh} and {moving[0]} among them;"
                    " convert one of them with --prim (in Python, source={'prim': PATH})",
                    argument="fps" if asked.fps else "retime",
                    file=scene.path,
                )
            seconds = times
        if lead is None:
            lead = conversion.header
        elif not moves and reader.n_frames == 1:
            timed = replace(conversion.header, fps=lead.fps, start=lead.number(0), times=None)
            conversion = replace(conversion, header=timed)
        yield mesh, _Mesh(reader, header, conversion)


def _frames(meshes: Mapping[str, _Mesh], writer: SceneWriter) -> Iterator[Frame]:
    """Writes mesh after mesh, and yields each frame as it was read."""
    for number, (mesh, (reader, header, conversion)) in enumerate(meshes.items()):
        if number:
            writer.next_mesh(conversion.header)
        output = conversion.output(writer)
        with naming_mesh(mesh):
            for frame in reader:
                values = frame.attributes()
                output.append(frame.points, **{name: values[name] for name in header.attributes})
                yield frame


def left_out(reader: Reader) -> Iterator[str]:
    """Says that one mesh alone was taken of a scene, since the only one that moves was chosen."""
    scene = reader.scene
    if scene is not None and len(scene.moves) > 1:
        still = listed([mesh for mesh in scene.moves if mesh != reader.header.name])
        yield f"holds {reader.header.name} alone, without the meshes that do not move: {still}"
