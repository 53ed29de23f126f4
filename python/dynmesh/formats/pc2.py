"""PC2, the point cache of 3ds Max and Blender: a header, then the positions of every frame.

`POINTCACHE2` and a zero byte, int32 version 1, int32 vertices, float32 start frame, float32 sample
rate, int32 frames, then float32 positions; all little-endian. The rate counts samples per frame of
a scene, not per second, so frames per second cannot be stored.

The file holds neither faces nor masks nor provenance. The faces, the up axis and the unit come from
a mesh beside it, `NAME.obj` or `NAME.ply`, to which an animation program applies the cache; the
writer writes frame 0 as `NAME.obj`. Unknown positions are written as NaN, and float64 is rounded.
"""

import struct
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from .._checks import native
from .._errors import InputError, naming
from .._report import Report
from ..frame import Frame, Frames, Indices
from ..header import Header
from ..polygons import as_polygons
from ..run import Run
from ..stored import FileFrames
from .format import STATED, Format, Template, find_template, not_written, template_of
from .obj import ObjFrames, write_obj
from .output import destination_of
from .ply import PlyFrames

signature = b"POINTCACHE2\0"
layout = struct.Struct("<12siiffi")
largest_count = 2**31 - 1

_DTYPE = np.dtype("<f4")
_MESHES = {".obj": ObjFrames, ".ply": PlyFrames}
"""What reads the mesh beside a file; the preferred kind comes first."""


class Pc2Frames(FileFrames):
    """A sequence in a PC2 file."""

    def __init__(self, path: Path, faces: Template | None) -> None:
        with path.open("rb") as file:
            begin = file.read(layout.size)
        if not begin.startswith(signature):
            raise InputError("is not a PC2 file, as it does not begin with POINTCACHE2")
        if len(begin) < layout.size:
            raise InputError(f"ends in its header, after {len(begin)} of {layout.size} bytes")
        _, version, n_vertices, start, _, n_frames = layout.unpack(begin)
        if version != 1:
            raise InputError(f"is a PC2 file of version {version}, but only version 1 is supported")
        if n_frames < 0 or n_vertices < 0:
            raise InputError(f"declares an array of shape {(n_frames, n_vertices, 3)}")
        size, expected = path.stat().st_size, layout.size + 12 * n_frames * n_vertices
        if size != expected:
            raise InputError(f"its header declares {expected} bytes, but the file has {size}")
        beside = dict.fromkeys(map(path.with_suffix, _MESHES), _mesh)
        template = find_template(faces, n_vertices, beside)
        header = Header(
            faces=template.faces,
            n_frames=n_frames,
            n_vertices=n_vertices,
            dtype=np.dtype(np.float32),
            polygons=template.polygons,
            **template.metadata._asdict(),
            start=float(str(np.float32(start))),  # the shortest digits of the float32
        )
        super().__init__(path, header, [path, *template.files])

    def _frames(self, numbers: Indices) -> Iterator[Frame]:
        count = 3 * self.n_vertices
        for number in numbers:
            begin = layout.size + number * count * _DTYPE.itemsize
            row = np.fromfile(self.path, _DTYPE, count, offset=begin)
            yield Frame(native(row.reshape(self.n_vertices, 3)))


def _mesh(path: Path) -> Template:
    with _MESHES[path.suffix](path) as reader:
        return template_of(reader)


def write_pc2(path: Path, header: Header, frames: Frames) -> list[str]:
    """Writes a PC2 file, and the mesh beside it.

    An existing `NAME.obj` with the same faces is kept, since it may contain more, such as texture
    coordinates. It is replaced if it has other faces or states another up axis or another length of
    a unit.
    """
    for what, count in (("frames", header.n_frames), ("vertices", header.n_vertices)):
        if count > largest_count:
            raise InputError(f"can hold at most {largest_count} {what}, not {count}")
    mesh = destination_of(path).with_suffix(".obj")
    needs_mesh = not _is_kept(mesh, header)
    if needs_mesh and len(header.faces) == 0:
        raise InputError("the sequence has no faces, which the mesh beside it needs")
    remarks = [] if needs_mesh else [*not_written(frames, ()), *_unstated(mesh, header)]
    with path.open("wb") as file:
        counts = layout.pack(signature, 1, header.n_vertices, header.start, 1.0, header.n_frames)
        file.write(counts)
        for number, frame in enumerate(frames):
            if number == 0 and needs_mesh:
                single = replace(header, n_frames=1, times=None, attributes=())
                first = partial(iter, [Frame(frame.points)])
                mesh_alone: Run[Report] = Run(single, first, origin=frames.origin)
                remarks += write_obj(path.with_suffix(".obj"), single, mesh_alone)
            file.write(frame.points.astype(_DTYPE, order="C", copy=False).data)
    return remarks


def _existing(path: Path, header: Header) -> list[Path]:
    """The cache, and the mesh beside it, if it is replaced."""
    mesh = path.with_suffix(".obj")
    return [
        *filter(Path.exists, [path]),
        *([] if _is_kept(mesh, header) else filter(Path.exists, [mesh])),
    ]


def _is_kept(path: Path, header: Header) -> bool:
    """Whether there is a mesh that fits the sequence."""
    if not path.is_file():
        return False
    with naming(Path(path.name)):
        mesh = _mesh(path)
    there, wanted = (as_polygons(m.faces, m.polygons) for m in (mesh, header))
    return (
        mesh.n_vertices == header.n_vertices
        and all(map(np.array_equal, there, wanted))
        and mesh.metadata.up_axis in (None, header.up_axis)
        and mesh.metadata.metres_per_unit in (None, header.metres_per_unit)
    )


def _unstated(path: Path, header: Header) -> list[str]:
    """Says what a mesh that is kept does not state of the sequence."""
    stated = _mesh(path).metadata
    names = [name for name in ("up_axis", "metres_per_unit") if name in header.stated]
    lost = [STATED[name] for name in names if getattr(stated, name) is None]
    return [f"not written, as {path.name} is kept as it is: {', '.join(lost)}"] if lost else []


pc2 = Format(
    "pc2",
    (".pc2",),
    Pc2Frames,
    write_pc2,
    frozenset({"polygons", "up_axis", "metres_per_unit", "start"}),
    frozenset({"faces"}),
    existing=_existing,
)
