"""Alembic archives of other programs."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sequences import assert_refused

import dynmesh

alembic = pytest.importorskip("alembic3d")
imath: Any = pytest.importorskip("imath")
Abc, Core, Geometry = alembic.Abc, alembic.AbcCoreAbstract, alembic.AbcGeom
VERTEX = Geometry.GeometryScope.kVertexScope
CORNERS = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)], np.float32)


def integers(*values: int) -> Any:
    return imath.IntArrayFromBuffer(np.array(values, np.int32))


def add_mesh(archive: Any, name: str, heights: list[float], sampling: int = 0) -> Any:
    """Adds a triangle that rises; returns its schema."""
    schema = Geometry.OPolyMesh(archive.getTop(), name).getSchema()
    schema.setTimeSampling(sampling)
    for height in heights:
        schema.set(sample(CORNERS + np.float32(height), 2, 1, 0))
    return schema


def sample(points: Any, *corners: int) -> Any:
    faces = (integers(*corners), integers(3)) if corners else ()
    return Geometry.OPolyMeshSchemaSample(imath.V3fArrayFromBuffer(points), *faces)


def archive_of(path: Path, heights: list[float], times: Any = None) -> Path:
    archive = Abc.OArchive(str(path))
    add_mesh(archive, "Body", heights, 0 if times is None else archive.addTimeSampling(times))
    return path


def stored_at(*times: float, cycle: float | None = None) -> Any:
    """Samples at these times, or at these of each cycle."""
    stored = Core.TimeVector()
    stored[:] = times
    kind = Core.AcyclicFlag.kAcyclic if cycle is None else (len(times), cycle)
    kinds = kind if isinstance(kind, tuple) else (kind,)
    return Core.TimeSampling(Core.TimeSamplingType(*kinds), stored)


@pytest.mark.parametrize(
    ("sampling", "fps", "start", "times"),
    [
        (None, None, 0, None),
        (Core.TimeSampling(1 / 25, 0.04), 25, 1, None),
        (Core.TimeSampling(1001 / 30000, 1001 * 1001 / 30000), 30000 / 1001, 1001, None),
        (Core.TimeSampling(1.0, 5.0), None, 5, None),
        (stored_at(1 / 24, 5 / 24, 6 / 24), 24, 1, [1, 5, 6]),
        (stored_at(5.0, 6.0, 9.5), None, 5, [5, 6, 9.5]),
        (stored_at(0.0, 0.25, cycle=1.0), 4, 0, [0, 1, 4]),
    ],
)
def test_samples_of_archives_are_frames(
    tmp_path: Path, sampling: Any, fps: float | None, start: float, times: list[float] | None
) -> None:
    sequence = dynmesh.read(archive_of(tmp_path / "a.abc", [1, 2, 3], sampling))
    np.testing.assert_array_equal(sequence.vertices[:, 0, 2], [1, 2, 3])
    np.testing.assert_array_equal(sequence.faces, [[0, 1, 2]])  # counterclockwise
    assert sequence.fps == (None if fps is None else pytest.approx(fps))
    assert sequence.start == start
    assert (None if sequence.times is None else sequence.times.tolist()) == times
    assert sequence.name == "/Body"


@pytest.mark.parametrize("rate", [24.0, 59.94, 30000 / 1001])
def test_uneven_samples_are_counted_at_the_rate_of_the_program(tmp_path: Path, rate: float) -> None:
    path = tmp_path / "a.abc"
    archive = Abc.CreateArchiveWithInfo(str(path), rate, "another program", "")
    times = [1001, 1003, 1005, 1010]
    sampling = archive.addTimeSampling(stored_at(*(time / rate for time in times)))
    add_mesh(archive, "Body", [1, 2, 3, 4], sampling)
    del archive
    again = dynmesh.read(path)
    assert again.fps == rate
    np.testing.assert_array_equal(again.times, times)
    dynmesh.write(tmp_path / "b.abc", again)
    found = Abc.IArchive(str(tmp_path / "b.abc")).getTop().getChild("Body")
    stored = Geometry.IPolyMesh(found.getParent(), "Body").getSchema().getTimeSampling()
    np.testing.assert_array_equal(
        [stored.getSampleTime(i) for i in range(4)], np.array(times) / rate
    )


def parameter(schema: Any, kind: str, scope: Any, *samples: Any) -> None:
    parameter = getattr(Geometry, f"O{kind}GeomParam")(
        schema.getArbGeomParams(), "known", False, scope, 1
    )
    for sample in samples:
        parameter.set(getattr(Geometry, f"O{kind}GeomParamSample")(sample, scope))


def masked(*values: int) -> Any:
    array = imath.UnsignedCharArray(len(values))
    np.asarray(array)[:] = values
    return array


FACEVARYING = Geometry.GeometryScope.kFacevaryingScope
UNSUITABLE: list[tuple[Callable[[Any], None], str]] = [
    (lambda s: parameter(s, "Int32", VERTEX, integers(1, 1, 0)), "known: .*uchar"),
    (lambda s: parameter(s, "Uchar", FACEVARYING, masked(1, 1, 0)), "known: .*per vertex"),
    (lambda s: parameter(s, "Uchar", VERTEX, masked(1, 1, 0), masked(1, 0, 0)), "known: .*2 .*3"),
    (
        lambda s: parameter(s, "Uchar", VERTEX, *[masked(1, 1, 1)] * 2, masked(0, 1, 255)),
        "frame 2: known: .*0 or 1",
    ),
    (lambda s: s.set(sample(CORNERS, 0, 1, 2)), "frame 3: .*faces"),
]


@pytest.mark.parametrize(("add", "told"), UNSUITABLE)
def test_unsuitable_meshes_of_archives_are_refused(tmp_path: Path, add: Any, told: str) -> None:
    path = tmp_path / "a.abc"
    archive = Abc.OArchive(str(path))
    add(add_mesh(archive, "Body", [1, 2, 3]))
    del archive
    assert_refused(path, told)


def test_a_mask_may_be_constant_and_an_archive_empty(tmp_path: Path) -> None:
    path = tmp_path / "a.abc"
    archive = Abc.OArchive(str(path))
    parameter(add_mesh(archive, "Body", [1, 2, 3]), "Uchar", VERTEX, masked(1, 1, 0))
    del archive
    np.testing.assert_array_equal(dynmesh.read(path).known, [[True, True, False]] * 3)
    assert_refused(archive_of(tmp_path / "empty.abc", []))


def test_empty_samples_of_archives_are_frames_that_were_lost(tmp_path: Path) -> None:
    path = tmp_path / "a.abc"
    archive = Abc.OArchive(str(path))
    schema = Geometry.OPolyMesh(archive.getTop(), "Body").getSchema()
    nothing = imath.V3fArray(0), imath.IntArray(0), imath.IntArray(0)
    for height in (None, 1, 2, None, 4):
        is_empty = height is None
        empty = Geometry.OPolyMeshSchemaSample(*nothing)
        schema.set(empty if is_empty else sample(CORNERS + np.float32(height), 2, 1, 0))
    del archive, schema
    assert_refused(path, "frame 0: .*empty; with `gaps` lost")
    partial = dynmesh.read(path, gaps="lost")
    np.testing.assert_array_equal(np.isfinite(partial.vertices[:, 1, 1]), [0, 1, 1, 0, 1])
    np.testing.assert_array_equal(partial.vertices[[1, 2, 4], 0, 2], [1, 2, 4])
    filled = dynmesh.complete(partial, start=1)
    np.testing.assert_array_equal(filled.vertices[[1, 2, 4]], partial.vertices[[1, 2, 4]])
    add = add_mesh(archive := Abc.OArchive(str(path)), "Body", [1])
    add_mesh(archive, "Hat", [1])
    del archive, add
    assert_refused(path, "several meshes together are only for USD", prim="all")


def test_written_archives_follow_conventions(tmp_path: Path) -> None:
    """Also bounds are those of known points."""
    vertices = np.random.default_rng(0).random((3, 4, 3)).astype(np.float32)
    known = np.ones((3, 4), bool)
    vertices[1, 2], vertices[2, 0], known[2, 0] = np.nan, -77, False
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    path = tmp_path / "a.abc"
    about: Any = {"fps": 25, "name": "/Him/Body", "start": 1}
    dynmesh.write(path, dynmesh.Sequence(vertices, faces, known, **about))
    archive = Abc.IArchive(str(path))
    above = archive.getTop().getChild("Him")
    assert Geometry.IXform.matches(above.getHeader())
    schema = Geometry.IPolyMesh(above, "Body").getSchema()
    assert list(schema.getFaceIndicesProperty().getValue(0)) == [2, 1, 0, 3, 2, 0]  # clockwise
    assert schema.getTopologyVariance() == Geometry.MeshTopologyVariance.kHomogenousTopology
    assert [schema.getTimeSampling().getSampleTime(i) for i in range(3)] == [0.04, 0.08, 0.12]
    assert Abc.GetArchiveInfo(archive)["dccFPS"] == 25
    for points, seen, bounds in zip(
        vertices, known, schema.getSelfBoundsProperty().samples, strict=True
    ):
        there = points[seen & np.isfinite(points).all(axis=1)]
        np.testing.assert_array_equal(tuple(bounds.min()), there.min(axis=0))
        np.testing.assert_array_equal(tuple(bounds.max()), there.max(axis=0))
