"""Every function takes polygons and lists as faces, and arrays of any byte order and layout."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from entries import ENTRIES, FRAMES, KNOWN, MASKS, MESH, QUADS
from every_format import FORMATS, place

import dynmesh
from dynmesh.baselines import LaplacianInterpolation, LeastSquaresMesh
from dynmesh.polygons import Polygons

MIXED = [*MESH.faces[:2].tolist(), *QUADS[1:].tolist()]
POLYGONS = Polygons(np.array([3, 3] + [4] * (len(QUADS) - 1)), np.concatenate(MIXED))
FACES: dict[str, Any] = {
    "triangles in lists": MESH.faces.tolist(),
    "quads": QUADS,
    "quads in tuples": tuple(map(tuple, QUADS.tolist())),
    "mixed lists": MIXED,
    "rows of an array": [np.array(polygon, np.uint32) for polygon in MIXED],
    "Polygons": POLYGONS,
}
RECORDS = {"write", "write_ply", "scan_folder"}
"""Entries that are given records, which hold arrays."""
ARRAYS = {"out", "times"}
"""Arguments that must be arrays."""


def layouts(array: Any) -> dict[str, Any]:
    """The same array as others hold it in memory."""
    unaligned: Any = np.ndarray(array.shape, array.dtype, bytearray(array.nbytes + 1), 1)
    unaligned[...] = array
    protected = array.copy()
    protected.flags.writeable = False
    return {
        "of the other byte order": array.astype(array.dtype.newbyteorder()),
        "unaligned": unaligned,
        "strided": np.repeat(array, 2, axis=-1)[..., ::2],
        "backwards": array[::-1].copy()[::-1],
        "by columns": np.asfortranarray(array),
        "read-only": protected,
    }


def sequence_of(faces: Any) -> dynmesh.Sequence:
    return dynmesh.Sequence(FRAMES, faces, MASKS)


def plain(found: Any) -> Any:
    """What a call returned, as arrays, lists and dicts."""
    if isinstance(found, list | tuple):
        return [plain(one) for one in found]
    if isinstance(found, LeastSquaresMesh | LaplacianInterpolation):
        return found.complete(FRAMES[1], KNOWN)
    for name in ("state", "toarray"):
        if hasattr(found, name):
            return getattr(found, name)()
    if hasattr(found, "__dict__"):
        return [plain(value) for name, value in vars(found).items() if name != "polygons"]
    return found


@pytest.mark.parametrize("name", ENTRIES)
def test_every_function_takes_polygons_and_lists(name: str, tmp_path: Path) -> None:
    call, given = ENTRIES[name]
    arrays = {a: v for a, v in given.items() if isinstance(v, np.ndarray) and a not in ARRAYS}
    lists = {} if name in RECORDS else {a: values.tolist() for a, values in arrays.items()}
    changes = [{}, lists, *({"faces": one} for one in FACES.values() if "faces" in given)]
    made = []
    for number, change in enumerate(changes):
        (tmp_path / f"{number}").mkdir()
        made.append(plain(call(tmp_path / f"{number}", **given | change)))
    for other in made[1:]:
        np.testing.assert_equal(other, made[0])


@pytest.mark.parametrize("name", ENTRIES)
def test_the_layout_of_an_array_does_not_matter(name: str, tmp_path: Path) -> None:
    call, given = ENTRIES[name]
    (tmp_path / "packed").mkdir()
    expected = plain(call(tmp_path / "packed", **given))
    for argument, array in given.items():
        if not isinstance(array, np.ndarray) or argument in ARRAYS:
            continue
        for layout, other in layouts(array).items():
            folder = tmp_path / f"{argument} {layout}"
            folder.mkdir()
            found = plain(call(folder, **given | {argument: other}))
            np.testing.assert_equal(found, expected, err_msg=f"{argument} {layout}")


@pytest.mark.parametrize("format", FORMATS)
def test_formats_write_arrays_of_any_layout(format: str, tmp_path: Path) -> None:
    given = {"vertices": np.float32(FRAMES), "faces": MESH.faces.astype(np.int32)}
    for argument, array in given.items():
        for number, other in enumerate(layouts(array).values()):
            path = place(tmp_path / f"{argument}{number}", format)
            dynmesh.write(path, dynmesh.Sequence(**given | {argument: other}))
            back = dynmesh.read(path)
            for name, expected in given.items():
                np.testing.assert_array_equal(getattr(back, name), expected)


def test_lists_of_whole_numbers_are_positions_but_arrays_of_them_are_not() -> None:
    corners: Any = [[0, 0, 0], [2, 0, 0], [2, 3, 0], [0, 3, 0]]
    known: Any = [1, 0, 1, 1]
    completed = dynmesh.Completer([[0, 1, 2, 3]], corners).push(corners, known)
    assert completed.dtype == np.float64
    np.testing.assert_allclose(completed, corners, atol=1e-12)
    lists: dict[str, Any] = {"vertices": [corners] * 2, "faces": [[0, 1, 2, 3]], "times": [3, 7]}
    sequence = dynmesh.Sequence(**lists)
    assert sequence.vertices.dtype == np.float64
    with pytest.raises(TypeError, match="first_frame: must be float32 or float64, not int64"):
        dynmesh.Completer([[0, 1, 2, 3]], np.array(corners))


def test_a_sequence_keeps_the_polygons() -> None:
    every = Polygons(np.full(len(QUADS), 4), QUADS.ravel())
    given: Any
    for given, polygons in ((QUADS, every), (MIXED, POLYGONS), (POLYGONS, POLYGONS)):
        made = sequence_of(given)
        np.testing.assert_array_equal(made.faces, MESH.faces)
        np.testing.assert_equal(made.polygons, polygons)
        assert made[1:3].polygons is made.polygons
    assert sequence_of(FACES["triangles in lists"]).polygons is None


BAD: dict[str, tuple[Any, str]] = {
    "two corners": ([[0, 1, 2], [0, 1]], "faces: polygon 1 has 2 corners"),
    "no corners": ([[0, 1, 2], []], "faces: polygon 1 has 0 corners"),
    "a corner twice": (np.array([[0, 1, 6, 5], [0, 1, 6, 1]]), "polygon 1 has the corner 1 twice"),
    "a corner of -1": ([[0, 1, 2], [0, 1, 6, -1]], "faces: polygon 1 refers to vertex -1"),
    "too large a corner": ([[0, 1, 2], [0, 1, 6, 25]], "faces: polygon 1 refers to vertex 25"),
    "no list": ([[0, 1, 2], 5], "faces: polygon 1 must be integers"),
    "a fraction": ([[0, 1, 2], [0, 1, 6, 0.5]], "faces: polygon 1 must be integers"),
    "lists in lists": ([[0, 1, 2], [0, 1, [6, 5]]], "faces: polygon 1 must be integers"),
}


@pytest.mark.parametrize("bad", BAD)
def test_bad_polygons_are_named_by_every_function(bad: str, tmp_path: Path) -> None:
    faces, message = BAD[bad]
    for name, (call, given) in ENTRIES.items():
        if "faces" in given and name != "read":  # of which the errors are those of files
            with pytest.raises((ValueError, TypeError), match=message):
                call(tmp_path, **given | {"faces": faces})
