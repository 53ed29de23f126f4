"""Files of points: those of others, folders of them, and damaged ones."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import LONGER
from hypothesis import example, given, settings
from hypothesis import strategies as st
from plain_files import ply
from scan_files import a_rig, some_points

from dynmesh._errors import DynmeshError
from dynmesh.scans import PointFolder, PointScan, open_scans, read_points


def write_as(file: Path, scan: PointScan) -> None:
    """Writes points by other means than dynmesh."""
    table = scan.points if scan.normals is None else np.hstack([scan.points, scan.normals])
    names = ["x", "y", "z", "nx", "ny", "nz"][: table.shape[1]]
    if file.suffix == ".xyz":
        np.savetxt(file, table, fmt="%.17g", header="made by a scanner")
    else:
        rows = "".join(" ".join(f"{value:.17g}" for value in row) + "\n" for row in table)
        properties = ", ".join(f"double {name}" for name in names)
        file.write_bytes(ply(f"vertex {len(table)}: {properties}", rows.encode()))


@pytest.mark.parametrize("suffix", [".ply", ".xyz"])
@pytest.mark.parametrize("with_normals", [False, True])
def test_points_of_others_are_read(tmp_path: Path, suffix: str, with_normals: bool) -> None:
    scan = some_points()
    scan = scan if with_normals else scan._replace(normals=None)
    write_as(tmp_path / f"a{suffix}", scan)
    found = read_points(tmp_path / f"a{suffix}").scan
    np.testing.assert_array_equal(found.points, scan.points)
    assert (found.normals is None) == (not with_normals)
    if scan.normals is not None and found.normals is not None:
        np.testing.assert_allclose(found.normals, scan.normals, rtol=1e-14)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_folders_of_points_come_back(tmp_path: Path, dtype: Any) -> None:
    scans = [some_points(dtype, n) for n in (5, 0, 9)]
    rig = a_rig(3, unit=0.001)
    with PointFolder(tmp_path / "scans", rig) as folder:
        for scan in scans:
            folder.append(scan)
    reader = open_scans(tmp_path / "scans")
    assert (reader.n_frames, reader.metres_per_unit) == (3, 0.001)
    for pattern in ("frame_%05d.ply", "frame_#####.ply"):
        assert open_scans(tmp_path / "scans" / pattern).n_frames == 3
    for scan, found in zip(scans, reader, strict=True):
        assert isinstance(found, PointScan)
        assert found.points.dtype == dtype
        np.testing.assert_array_equal(found.points, scan.points)
        np.testing.assert_allclose(np.asarray(found.viewpoints), rig.viewpoints, rtol=1e-6)


def test_what_was_not_measured_is_left_out(tmp_path: Path) -> None:
    (tmp_path / "a.xyz").write_text("# a cloud\n0 0 1\nnan nan nan\n\n1, 2, 3 # the last\n")
    np.testing.assert_array_equal(
        read_points(tmp_path / "a.xyz").scan.points, [[0, 0, 1], [1, 2, 3]]
    )


def read_or_refused(file: Path) -> tuple[PointScan | None, str]:
    """Returns the points, which are finite, or else why they were refused."""
    try:
        found = read_points(file).scan
    except DynmeshError as error:
        return None, str(error)
    assert np.isfinite(found.points).all()
    return found, ""


@given(st.binary(max_size=200), st.sampled_from([".xyz", ".ply"]))
@example(b"1 2 3\n1 2\n", ".xyz")
@settings(max_examples=150 * LONGER)
def test_any_bytes_are_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, content: bytes, suffix: str
) -> None:
    file = tmp_path_factory.getbasetemp() / f"bytes{suffix}"
    file.write_bytes(content)
    found, told = read_or_refused(file)
    assert found is not None or told.startswith(str(file))


WORDS = st.sampled_from(
    ["1", "2.5", "-3e2", "nan", "inf", "1_0", "x", "#", ",", "0x1", "\x00", "é"]
)


@given(st.lists(st.lists(WORDS, max_size=7), max_size=6))
@settings(max_examples=150 * LONGER)
def test_lines_of_words_are_read_or_refused_with_their_number(
    tmp_path_factory: pytest.TempPathFactory, lines: list[list[str]]
) -> None:
    file = tmp_path_factory.getbasetemp() / "words.xyz"
    file.write_text("\n".join(" ".join(line) for line in lines), encoding="latin-1")
    found, told = read_or_refused(file)
    if found is None:
        (number,) = re.findall(r"\.xyz: line (\d+): ", told)
        assert lines[int(number) - 1]
