"""File formats: their readers and writers, faces for files without, and one mesh of several.

A scene states the unit of length and the up axis of its space, in which transforms place a mesh, as
when a cache in centimetres stands in a shot in metres, under a scale of 0.01. What is read and
written are points in the own space of the mesh.
"""

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .._errors import InputError, naming
from .._report import listed, some_of
from ..frame import Frame, Frames
from ..header import Header
from ..polygons import Polygons
from ..stored import Stored
from .text import Metadata

Write: TypeAlias = Callable[[Path, Header, Frames], Iterable[str] | None]
Gaps: TypeAlias = Literal["refuse", "lost"]
"""What becomes of frames that are missing: an error, or frames without observations."""


STATED = {
    "fps": "frame rate",
    "polygons": "faces of more than three corners",
    "up_axis": "up axis",
    "name": "path of the mesh",
    "start": "number of the first frame",
    "times": "times of the frames",
    "metres_per_unit": "unit of length",
    "subdivision": "subdivision scheme",
}
"""What a header may state and a format keeps or not, by name, in words."""

ARRAYS = frozenset({"known", "provenance", "float64"})
"""What formats keep that store arrays as they are."""

OTHER_MESHES = (
    "missing vertices keep their places, as NaN or zeros; dynmesh track follows one mesh through "
    "frames that are not of the same vertices"
)
HOLDS_FACES = "holds its faces; faces can be given only for files that hold none"

_NOT_TAKEN = {
    "faces": HOLDS_FACES,
    "prim": "holds a single mesh; prim is only for USD and Alembic",
    "gaps": "gaps is only for one file per frame, USD and Alembic; mark what was not observed as "
    "missing",
    "primvar": "has no primvars, as only USD has them",
}


@dataclass(frozen=True, eq=False)
class Template:
    """A mesh that provides the faces of a file without faces."""

    faces: NDArray[np.integer[Any]]
    polygons: Polygons | None
    n_vertices: int | None
    """None if only faces were given."""
    metadata: Metadata = field(default_factory=Metadata)
    files: tuple[Path, ...] = ()
    """Those that it was read from."""


def template_of(reader: Stored) -> Template:
    """The mesh that is read to provide its faces."""
    header = reader.header
    metadata = Metadata(header.up_axis, header.metres_per_unit)
    return Template(header.faces, header.polygons, header.n_vertices, metadata, tuple(reader.files))


class NoFacesError(InputError):
    """The file holds no faces, and none were given."""


def find_template(
    given: Template | None, n_vertices: int, beside: Mapping[Path, Callable[[Path], Template]]
) -> Template:
    """Returns the mesh that provides the faces of a file with so many vertices.

    If none is given, it is read from the first of the files `beside` that exists.
    """
    there = [path for path in beside if path.exists()]
    if given is None and not there:
        names = " or ".join(path.name for path in beside)
        raise NoFacesError(
            f"holds only positions{f', and there is no {names} beside it' if names else ''}; "
            "give a mesh with its faces; dynmesh track takes scans"
        )
    template = given
    if template is None:
        with naming(there[0]):
            template = beside[there[0]](there[0])
    if template.n_vertices not in (None, n_vertices):
        raise InputError(
            f"has {n_vertices} vertices, but the mesh with its faces has {template.n_vertices}"
        )
    return template


@dataclass(frozen=True)
class Format:
    """A file format.

    Attributes:
        name: by which users choose the format, such as "npz".
        suffixes: of file names, in lower case, such as ".npz".
        read: opens the frames of a file, of a path and what it takes.
        write: writes to a path, of a header and :class:`dynmesh.Frames`, in a folder that is moved
            to where it belongs when all frames are written (see :func:`destination_of`), and
            returns remarks for the user; None if the format can only be read.
        keeps: what the format stores beside triangles and positions of float32: "known", masks,
            without which unknown positions are stored as NaN; "provenance", generation, age and
            standard errors; "texture", texture coordinates; "float64"; and the attributes of a
            :class:`dynmesh.Header` "fps", "polygons", "up_axis", "name", "start", "times",
            "metres_per_unit" and "subdivision". What is not kept, writing says.
        takes: which keywords `read` takes: "faces", a `Template`; "prim", the path of one mesh
            among several; "gaps", what becomes of missing frames, of one file per frame or of a
            scene; "primvar", the name of the known mask in a scene.
        library: the module that the format needs, and the extra that installs it; None if it needs
            none.
        meshes: the paths of all meshes of a file, and whether each moves; None if a file holds a
            single mesh.
        overlay: writes a layer that changes one mesh of a scene and nothing else; None if the
            format has no layers.
        existing: those that exist of the files that writing to a path may replace or remove; None
            if it is one file.
    """

    name: str
    suffixes: tuple[str, ...]
    read: Callable[..., Stored]
    write: Write | None = None
    keeps: frozenset[str] = frozenset()
    takes: frozenset[str] = frozenset()
    library: tuple[str, str] | None = None
    meshes: Callable[[Path], Mapping[str, bool]] | None = None
    overlay: Write | None = None
    existing: Callable[[Path, Header], list[Path]] | None = None

    @property
    def is_per_frame(self) -> bool:
        """Whether a file holds one frame."""
        return "gaps" in self.takes and self.meshes is None

    def open(self, path: Path, **given: Any) -> Stored:
        """Opens a sequence with these keywords, and refuses what `read` does not take."""
        for name, value in given.items():
            if name not in self.takes and value not in (None, "refuse"):
                raise InputError(_NOT_TAKEN[name])
        return self.read(path, **{name: given[name] for name in self.takes})


def not_written(frames: Frames, held: Iterable[str]) -> list[str]:
    """Says what the file of a mesh holds that is not written, but for what is held."""
    source = frames.origin
    lost = set() if source is None else {*source.holds} - {*held}
    if source is None or not lost:
        return []
    return [f"{listed(sorted(lost))} of {source.path.name} are not written"]


def not_read(moved_by: Collection[str], unknown: str) -> tuple[str, ...]:
    """Says what moves a mesh beside its points, in words, and what is unknown of its space."""
    remarks = [unknown] if unknown else []
    if moved_by:
        remarks.insert(
            0,
            f"the mesh is moved by {listed(moved_by)}, which dynmesh does not read; bake its "
            "points, unless their own motion is meant",
        )
    return tuple(remarks)


def choose_mesh(meshes: Mapping[str, bool], prim: str | Iterable[str] | None) -> str:
    """Chooses a mesh by its path, else the only one that moves, else the only one."""
    names = [prim] if isinstance(prim, str) else [*(prim or ())]
    names = [*meshes] if names == ["all"] else names
    if len(names) > 1:
        raise InputError("several meshes together are only for USD", argument="prim")
    prim = names[0] if names else None
    if not meshes:
        raise InputError("contains no polygon mesh")
    if prim is not None:
        if prim not in meshes:
            raise InputError(
                f"has no mesh {prim!r}; the meshes are {some_of(list(meshes))}",
                argument="prim",
                value=prim,
            )
        return prim
    candidates = [path for path, moves in meshes.items() if moves] or list(meshes)
    if len(candidates) > 1:
        raise InputError(
            f"contains several meshes; choose by their paths, or all in USD: {some_of(candidates)}",
            argument="prim",
        )
    return candidates[0]


def check_same_faces(first: Polygons, later: Polygons, when: str) -> None:
    """Raises an error, with `when`, unless later faces equal those of the first frame."""
    if not all(np.array_equal(one, other) for one, other in zip(first, later, strict=True)):
        raise InputError(
            f"{when}: the faces differ from those of the first frame, but must not change"
        )


_TOLERANCE = 1e-5
"""How far from a uniform scale and from right angles transforms may be, as programs round them."""


def of_points(
    up: str | None, metres: float | None, transforms: Iterable[NDArray[np.float64]]
) -> tuple[str | None, float | None, str]:
    """Returns the up axis and the metres per unit of points, and a remark if one is unknown.

    Args:
        up: the up axis of the scene, or None.
        metres: the metres in a unit of the scene, or None.
        transforms: (3, 3) matrices that take directions, which are rows, from the space of the mesh
            to that of the scene: one for each moment that matters.
    """
    if up is None and metres is None:
        return None, None, ""
    axes, scales = set[str | None](), list[float]()
    for matrix in transforms:
        scale = float(np.cbrt(abs(np.linalg.det(matrix))))
        turn = matrix / (scale or 1.0)
        if not np.allclose(turn @ turn.T, np.eye(3), rtol=0, atol=_TOLERANCE):
            return None, None, _unknown(up, metres, "stretch the mesh unevenly")
        axes.add(None if up is None else _upwards(turn, up))
        scales.append(scale)
    is_one_size = np.allclose(scales, scales[0], rtol=_TOLERANCE, atol=0)
    axis = axes.pop() if len(axes) == 1 else None
    remark = _unknown(None if axis else up, None, "tilt the mesh")
    if is_one_size or metres is None:
        unit = None if metres is None else _scaled(metres, scales[0])
        return axis, unit, remark
    return axis, None, _unknown(None if axis else up, metres, "change the size of the mesh")


def extent_of(frame: Frame) -> NDArray[np.float32]:
    """Returns the two corners of the bounding box; without points, those of an empty range."""
    points, most = frame.points[frame.present], np.finfo(np.float32).max
    corners = points.min(axis=0, initial=most), points.max(axis=0, initial=-most)
    return np.stack(corners).astype(np.float32)


def _upwards(turn: NDArray[np.float64], up: str) -> str | None:
    """The axis of a mesh that points upwards in the scene; None if it is none."""
    direction = turn @ np.eye(3)["xyz".index(up)]
    highest = int(direction.argmax())
    return "xyz"[highest] if direction[highest] > 1 - _TOLERANCE else None


def _scaled(metres: float, scale: float) -> float:
    """A scaled unit with the fewest digits that the rounding of the transforms allows."""
    if np.isclose(scale, 1, rtol=1e-9, atol=0):
        return metres
    every = (float(f"{metres * scale:.{digits}g}") for digits in range(1, 18))
    return next(one for one in every if np.isclose(one, metres * scale, rtol=1e-7, atol=0))


def _unknown(up: str | None, metres: float | None, why: str) -> str:
    """Says what of what a scene states is not known of the points; empty if that is nothing."""
    stated = {"up axis": up, "unit of length": metres}
    lost = [name for name, value in stated.items() if value is not None]
    if not lost:
        return ""
    verb = "is" if len(lost) == 1 else "are"
    return f"transforms {why}, so the {' and '.join(lost)} of its points {verb} unknown"
